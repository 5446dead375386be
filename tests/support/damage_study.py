"""Damaged requests (``run --accuracy``, ``study``) and study folders, each made from its number alone."""

from __future__ import annotations

import random
import shutil
from collections.abc import Callable
from pathlib import Path

import damage
import tomli_w
from scenes import model, quadratic_linear

ACCURACY, STUDY, TORN = 2000, 3000, 4000
"""Where the numbers of each kind of case begin; below there is ``run``."""
SOUND = model(2, friction=quadratic_linear(1e6)) | {"title": "torn"}
ASKED = ["--axis", "epsilon=1", "--repeat", "1", "--limit", "20"]
"""Of a study with two points, whose reference is one more."""
_WORDS = ["nan", "inf", "0", "-1", "1e-300", "1e300", "x", "", "1", "0.5,0.1", "𝟙"]
_OPTIONS = ["--accuracy", "--quantity"]
_QUANTITIES = ["energy", "u_t", "sigma_t", "resultant", "lambda_held", "lambda_peak", "enrgy", ""]
_AXES = [
    "mesh",
    "epsilon",
    "epsilon_absolute",
    "smoothing",
    "method",
    "tolerance",
    "linear_solver",
    "accuracy",
    "msh",
    "",
]
_VALUES = [
    *_WORDS,
    "2",
    "3",
    "exact",
    "exact,exact",
    "paper",
    "branch",
    "gamg",
    ",",
    "=",
    "0.5",
    "1/3",
    "10**9",
    "99999999",
]


def words(number: int, folder: Path) -> list[str]:
    """Write a case below `TORN` into an empty folder; the arguments of its call, without ``--out``."""
    chance = random.Random(number)
    if number < ACCURACY or chance.random() < 0.5:
        damage.make(number, folder)
        sound = [] if number < ACCURACY else _sound(number)
        return [*_command(number, folder), *sound]
    (folder / "scene.toml").write_text(tomli_w.dumps(SOUND), encoding="utf-8")
    return [*_command(number, folder), *(_odd_run(chance) if number < STUDY else _odd_study(chance))]


def _command(number: int, folder: Path) -> list[str]:
    study = number >= STUDY
    return ["study" if study else "run", str(folder / "scene.toml"), *([] if study else ["--no-pictures"])]


def _sound(number: int) -> list[str]:
    return ASKED if number >= STUDY else ["--accuracy", "0.3"]


def _odd_run(chance: random.Random) -> list[str]:
    """A later option wins."""
    option = chance.choice(_OPTIONS)
    values = _QUANTITIES if option == "--quantity" else _WORDS
    return ["--accuracy", "0.3", f"{option}={chance.choice(values)}"]


def _odd_study(chance: random.Random) -> list[str]:
    kind = chance.randrange(4)
    if kind == 0:
        return [
            *ASKED,
            f"{chance.choice(['--repeat', '--limit', '--np'])}={chance.choice(['0', '-1', 'x', 'nan', ''])}",
        ]
    return [*ASKED[2:], *(f"--axis={chance.choice(_AXES)}={chance.choice(_VALUES)}" for _ in range(min(kind, 2)))]


def _shorter(chance: random.Random, file: Path) -> None:
    file.write_bytes(file.read_bytes()[: chance.randrange(file.stat().st_size)])


def _zeros(chance: random.Random, file: Path) -> None:
    """As a power cut leaves a file whose length is on disk and whose blocks are not."""
    raw = file.read_bytes()
    at = chance.randrange(len(raw))
    file.write_bytes(raw[:at] + bytes(len(raw) - at))


def _other(chance: random.Random, file: Path) -> None:
    file.write_bytes(chance.choice([b"", b"[]", b"3", b"null", b"{}", b'{"converged": true}', b"\xff\xfe", b"nan"]))


def _gone(chance: random.Random, file: Path) -> None:
    file.unlink()


def _dangling(chance: random.Random, file: Path) -> None:
    file.unlink()
    file.symlink_to(file.parent / "absent")


WAYS: list[Callable[[random.Random, Path], None]] = [_shorter, _shorter, _zeros, _other, _other, _gone, _dangling]


def tear(number: int, finished: Path, folder: Path) -> str:
    """A copy of a finished study, one to three of its files damaged; what was done."""
    chance = random.Random(number)
    shutil.copytree(finished, folder)
    files = sorted(file for file in folder.rglob("*") if file.is_file())
    done = []
    for file in chance.sample(files, chance.choice([1, 1, 2, 3])):
        way = chance.choice(WAYS)
        way(chance, file)
        done.append(f"{way.__name__} {file.relative_to(folder)}")
    return ", ".join(done)


__all__ = ["ACCURACY", "ASKED", "SOUND", "STUDY", "TORN", "WAYS", "tear", "words"]
