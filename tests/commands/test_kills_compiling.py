"""Kills while forms compile: the next run with the same cache works and gives the right answer; nothing strays.

``HVI_KILLS=30 ./hvi test --long tests/commands/test_kills_compiling.py`` makes as many; ``HVI_SEED`` draws others.
"""

from __future__ import annotations

import os
import random
import time
from pathlib import Path

import pytest
from kills import end, started
from runs import command, hvi, summary, write_scene
from scenes import model, quadratic_linear

pytestmark = pytest.mark.long

KILLS, SEED = int(os.environ.get("HVI_KILLS", "4")), int(os.environ.get("HVI_SEED", "1"))
FORMS = 14
"""Of one run; the kill comes with one of them."""
LONGEST = 0.5
"""Seconds that a form takes to compile on a busy machine."""
WAYS = ("SIGKILL", "SIGTERM twice", "SIGHUP", "SIGINT twice", "SIGTERM", "SIGHUP twice")
"""After one request to stop a small run ends at its first iteration, or whole."""


@pytest.mark.parametrize("number", range(KILLS))
def test_a_kill_while_forms_compile_spoils_no_later_run(number: int, tmp_path: Path) -> None:
    chance, cache, out = random.Random(f"{SEED}-{number}"), tmp_path / "cache", tmp_path / "r"
    scene = write_scene(tmp_path / "square.toml", model(2, friction=quadratic_linear(1e3)))
    assert hvi("run", scene, "--out", out, "--no-pictures").returncode == 0
    energy = summary(out)["energy"]
    (out / "mine.txt").write_text("precious")
    ranks = chance.choice([(), (), ("--np", "2")])
    words = command("run", scene, "--out", out, "--force", "--no-pictures", *ranks)
    way = WAYS[number % len(WAYS)]
    killed(chance, words, way, cache)
    assert strays(cache) == []
    if way != "SIGKILL":
        assert not [*(tmp_path / "tmp").glob("hvi-*")]
    done = started(words, own(cache)).communicate(timeout=300)
    assert "Traceback" not in done[1], done[1]
    assert summary(out)["energy"] == pytest.approx(energy, rel=1e-9)
    assert (out / "mine.txt").read_text() == "precious"
    assert sorted(f.name for f in tmp_path.iterdir()) == ["cache", "r", "square.toml", "tmp"]
    assert not [f.name for f in forms(cache) if ".building-" in f.name]
    assert len([f for f in forms(cache) if f.is_dir()]) >= FORMS


def own(cache: Path) -> dict[str, str]:
    """The environment of a run with a cache and temporary files of its own."""
    temporary = cache.with_name("tmp")
    temporary.mkdir(exist_ok=True)
    return os.environ | {"XDG_CACHE_HOME": str(cache), "TMPDIR": str(temporary)}


def forms(cache: Path) -> list[Path]:
    """The forms of a cache, finished or not."""
    return list((cache / "fenics" / "hvi_fenicsx").glob("*"))


def killed(chance: random.Random, words: list[str], way: str, cache: Path) -> None:
    """Start a run and end it while it compiles one of its forms."""
    process, wanted, seen = started(words, own(cache)), chance.randrange(1, FORMS + 1), set[str]()
    while process.poll() is None and len(seen) < wanted:
        seen |= {f.name.partition(".")[0] for f in forms(cache) if ".building-" in f.name}
        time.sleep(0.02)
    time.sleep(chance.uniform(0, LONGEST))
    end(process, way, chance)


def strays(cache: Path) -> list[str]:
    """Processes that know this cache and do not end within some seconds."""
    end = time.monotonic() + 20
    while (found := [*_knowing(str(cache))]) and time.monotonic() < end:
        time.sleep(0.1)
    return found


def _knowing(cache: str) -> list[str]:
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            if f"XDG_CACHE_HOME={cache}".encode() in (process / "environ").read_bytes().split(b"\0"):
                found.append((process / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace"))
        except OSError:
            continue  # it has ended, or is another user's
    return found
