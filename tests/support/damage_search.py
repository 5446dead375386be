"""Damaged paths, searches for equilibria and scenes of two bodies, each made from its number alone."""

from __future__ import annotations

import copy
import random
import shutil
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any
from unittest.mock import patch

import damage
import tomli_w
from damage_study import WAYS
from scenes import Table, model, quadratic_linear, two_blocks

from hvi_fenicsx.cli import main
from hvi_fenicsx.runtime.journal import Journal

SEARCH, TORN_SEARCH = 5000, 6000
"""Where their numbers begin, and those of folders that are torn before they are resumed."""
STOPPED = "stopped"
"""The title of the scene of these folders."""
BOND = {"law": "graph", "points": [[0, 0], [1e-6, 2e6], [2e-5, 0]], "one_sided": True}
LIMIT = ["--limit", "3"]
_APPEND = Journal.append
COMMANDS = {"run": [], "path": [], "equilibria": LIMIT}


def _two(cells: int = 3, **interface: object) -> Table:
    table = two_blocks("rectangle", [0.6], [[cells, 2], [cells - 1, 2]], "plane_strain")
    table["interface"]["seam"] |= interface
    return table


def _bases() -> list[Table]:
    glued = _two()
    glued["interface"]["seam"] = {"between": ["upper.bottom", "lower.top"], "contact": {}, "cohesion": dict(BOND)}
    tied = _two()
    tied["interface"]["seam"] = {"between": ["upper.bottom", "lower.top"], "tied": True}
    solid = two_blocks("box", [0.6, 0.5], [[2, 1, 1], [1, 1, 1]], "three_dimensional")
    strong = model(3, 6e6, friction=quadratic_linear(3e6))
    return [_two(), _two(4, adhesion=dict(BOND)), glued, tied, solid, strong]


_PROGRAMMES = [1.5, [1.0, 0.2, 1.1], [-1.0, 1.0], [], [0.0], [1.0, 1.0], "1", [float("nan")], [float("inf")], [1e300]]
_PROGRAMMES += [1e-300, [[1.0]], True, {}, [0.5] * 3, 40, [1, -1, 1, -1]]
_SCALED = [[], ["push.traction"], ["push"], ["", ""], "push.traction", ["press.traction", "press.traction"], [3], ["x"]]
_PLACES = ["upper.bottom", "lower.top", "lower.bottom", "upper.top", "upper.left", "bottom", "", "upper", 3, "up.per"]
_ORIGINS = [[0.0, 0.5], [0.21, 0.4], [0.21, 0.5 + 1e-9], [5.0, 0.5], [0.0], "0", [float("nan"), 0.5], [1e300, 0.5]]
_SEAMS = [
    {"tied": True},
    {"tied": "yes"},
    {"contact": {"gap": "measured"}},
    {"contact": {"gap": -1e-6}},
    {"contact": {"gap": "1/x"}},
    {"contact": {"lower": 1e-6, "upper": 2e-6}},
    {"cohesion": {**BOND, "beta": 0.0}},
    {"cohesion": {**BOND, "beta": -1}},
    {"cohesion": {"law": "graph", "points": [[0, 0], [0, 1]]}},
    {"displacement": [0.0, 0.0]},
    {"traction": [1e6, 0.0]},
    {"adhesion": {**BOND, "multiplier": "x - 0.3"}},
]


def programme(chance: random.Random, table: Table) -> None:
    table["path"] = {"to": copy.deepcopy(chance.choice(_PROGRAMMES))}
    if chance.random() < 0.5:
        table["path"]["scaled"] = copy.deepcopy(chance.choice(_SCALED))
    if chance.random() < 0.3:
        table["path"] |= chance.choice([{"states": 1}, {"contact_at": [0.5, 9.0]}, {"contact_at": "x"}, {"memry": 1}])


def ends(chance: random.Random, table: Table) -> None:
    found = table["interface"]["seam"]["between"]
    found[chance.randrange(2)] = chance.choice(_PLACES)


def moved(chance: random.Random, table: Table) -> None:
    table["domain"]["upper"]["origin"] = copy.deepcopy(chance.choice(_ORIGINS))


def third(chance: random.Random, table: Table) -> None:
    """A third body: somewhere else, or in another."""
    at = chance.choice([[0.0, 2.0], [0.1, 0.1], [0.21, 0.9]])
    table["domain"]["third"] = {"shape": "rectangle", "size": [0.3, 0.3], "cells": [1, 1], "origin": at}


def seams(chance: random.Random, table: Table) -> None:
    table["interface"]["seam"] |= copy.deepcopy(chance.choice(_SEAMS))


def doubled(chance: random.Random, table: Table) -> None:
    table["interface"]["again"] = copy.deepcopy(table["interface"]["seam"])


def unheld(chance: random.Random, table: Table) -> None:
    del table["boundary"][chance.choice(list(table["boundary"]))]


OWN: list[Callable[[random.Random, Table], None]] = [programme, programme, ends, moved, third, seams, doubled, unheld]
_WORDS = ["nan", "inf", "-inf", "0", "-1", "1e-300", "1e300", "x", "", "1,5", "²", "1_0", " 1 ", "0x10", "1" * 400]
_OPTIONS = {
    "path": [
        "--np",
        "--set=path.to",
        "--set=path.follow",
        "--set=path.memory",
        "--set=path.states",
        "--out",
        "--petsc",
    ],
    "equilibria": ["--gap", "--limit", "--np", "--set=solver.tolerance", "--set=solver.degree", "--petsc", "--out"],
    "run": ["--np", "--set=solver.degree", "--set=domain.upper.cells", "--set=domain.upper.origin", "--petsc"],
}


def words(number: int, folder: Path) -> list[str]:
    """Write a case into an empty folder; the arguments of its call, without ``--out``."""
    chance = random.Random(number)
    command = list(COMMANDS)[number % 3]
    table = copy.deepcopy(chance.choice(_bases()))
    if command != "equilibria" and chance.random() < 0.5:
        table["path"] = {"to": 1.2, "follow": chance.choice(["stable", "exact"]), "memory": chance.random() < 0.5}
    odd = number % 8 == 0
    if not odd:
        for one in chance.sample([*damage.TABLES, *OWN, *OWN], chance.choice([1, 1, 2])):
            try:
                one(chance, table)
            except (KeyError, IndexError, TypeError, ValueError, AttributeError):
                continue  # a damage that this table has no place for
    (folder / "scene.toml").write_text(tomli_w.dumps(table), encoding="utf-8")
    found = [command, str(folder / "scene.toml"), "--no-pictures", *COMMANDS[command]]
    return [*found, *(_odd(chance, command) if odd else [])]


def _odd(chance: random.Random, command: str) -> list[str]:
    option = chance.choice([o for o in _OPTIONS[command] if o != "--out"])
    return [f"{option}={chance.choice(_WORDS)}", *(["--lowest"] if command == "equilibria" else [])]


def stopped(command: str, folder: Path) -> tuple[list[str], Path]:
    """The arguments of a call, and the folder that it has left when it was stopped; made once.

    A path's is as a kill leaves it: the journal, and a manifest.
    """
    table = model(3, 6e6, friction=quadratic_linear(3e6)) | {"title": STOPPED, "path": {"to": 1.0}}
    scene, out = folder / "stopped.toml", folder / f"stopped-{command}"
    asked = [command, str(scene), "--no-pictures"]
    if not out.exists():
        scene.write_text(tomli_w.dumps(table), encoding="utf-8")
        if command == "equilibria":
            assert main([*asked, "--out", str(out), "--limit", "1e-9"]) == 4
        else:
            with patch.object(Journal, "append", _appended_until_death), suppress(_Dead):
                main([*asked, "--out", str(out)])
    return asked, out


class _Dead(BaseException):
    """The end of a process."""


def _appended_until_death(journal: Journal, record: Any) -> None:
    """As the journal does it, for a few rows."""
    if record.get("factor", 0.0) > 0.5:
        raise _Dead
    _APPEND(journal, record)


def tear(number: int, finished: Path, folder: Path) -> str:
    """A copy of a path or a search that was stopped, one to three of its files damaged; what was done."""
    chance = random.Random(number)
    shutil.copytree(finished, folder)
    files = sorted(file for file in folder.rglob("*") if file.is_file())
    likely = [file for file in files if file.name in ("path.journal", "search.journal", "manifest.json")]
    done = []
    for file in dict.fromkeys([chance.choice(likely), *chance.sample(files, chance.choice([0, 1, 2]))]):
        way = chance.choice(WAYS)
        way(chance, file)
        done.append(f"{way.__name__} {file.relative_to(folder)}")
    return ", ".join(done)
