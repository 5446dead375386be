"""An attack on the program with random scenes, judged by a referee of our own (docs/attack.md).

./hvi exec python3 tests/attack/attack.py --seed 1 --scenes 1000
./hvi exec python3 tests/attack/attack.py --seed 1 --number 37      # one scene again
"""

from __future__ import annotations

import argparse
import collections
import logging
import sys
import tempfile
import time
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

import tomli_w
from generator.kinds import Drawn, draw
from judge import CONTRADICTS, MISSED, UNDECIDED, Verdict, judge
from program import Answer, run
from referee.meshes import write_msh

FINDS = (CONTRADICTS, MISSED)
"""The verdicts for which an attack is made: a false statement, a solution that was not found."""


def write(drawn: Drawn, folder: Path, stem: str) -> Path:
    """The scene file, and the mesh file beside it."""
    table = dict(drawn.table)
    if drawn.mesh is not None:
        table["domain"] = table["domain"] | {"file": f"{stem}.msh"}
        write_msh(drawn.mesh, folder / f"{stem}.msh")
    file = folder / f"{stem}.toml"
    file.write_text(tomli_w.dumps(table), encoding="utf-8")
    return file


def attack(seed: int, number: int, folder: Path, limit: float) -> tuple[Drawn, Answer, Verdict]:
    """Draw, run and judge one scene."""
    drawn = draw(seed, number)
    file = write(drawn, folder, f"seed{seed}_{number}")
    answer = run(file, limit)
    try:
        verdict = judge(drawn.table, drawn.mesh, answer, number)
    except Exception as error:
        verdict = Verdict(UNDECIDED, f"referee broke down: {type(error).__name__}: {error}")
    return drawn, answer, verdict


def _arguments(words: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=int(time.time()) // 86400, help="by default the day's number")
    parser.add_argument("--scenes", type=int, default=100)
    parser.add_argument("--number", type=int, help="this scene of the seed only")
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--out", type=Path, help="where scenes are kept that were contradicted or missed")
    parser.add_argument("--limit", type=float, default=30.0, help="seconds of processor time for one solve")
    parser.add_argument("--verbose", action="store_true")
    return parser.parse_args(words)


@dataclass
class Counts:
    """How often each verdict and each exit code came."""

    words: collections.Counter[str] = field(default_factory=collections.Counter)
    codes: collections.Counter[int] = field(default_factory=collections.Counter)
    began: float = field(default_factory=time.monotonic)

    def __str__(self) -> str:
        seconds = time.monotonic() - self.began
        words, codes = (dict(sorted(c.items())) for c in (self.words, self.codes))
        return f"{sum(self.words.values())} scenes in {seconds:.0f} s: {words}, exit codes {codes}"


def series(seed: int, numbers: Iterable[int], out: Path, limit: float = 30.0, *, verbose: bool = False) -> Counts:
    """Attack with some scenes of a seed; what is contradicted or missed is printed and kept in a folder.

    Args:
        seed: of the scenes.
        numbers: which scenes of it.
        out: the folder.
        limit: seconds of processor time for one solve.
        verbose: whether to print every verdict, and to keep every scene.
    """
    counts = Counts()
    print(f"seed {seed}", flush=True)
    for number in numbers:
        with tempfile.TemporaryDirectory() as scratch:
            drawn, answer, verdict = attack(seed, number, Path(scratch), limit)
        counts.words[verdict.word] += 1
        counts.codes[answer.code] += 1
        if verbose or verdict.word in FINDS or "referee" in verdict.why:
            line = f"{number} {drawn.kind} exit {answer.code} {answer.state} {answer.seconds:.1f} s: "
            print(f"{line}{verdict.word}: {verdict.why}", flush=True)
        if verdict.word in FINDS:
            _keep(drawn, verdict, out, f"seed{seed}_{number}")
    return counts


def _keep(drawn: Drawn, verdict: Verdict, out: Path, stem: str) -> None:
    out.mkdir(parents=True, exist_ok=True)
    file = write(drawn, out, stem)
    file.write_text(f"# {verdict.word}: {verdict.why}\n" + file.read_text(encoding="utf-8"), encoding="utf-8")


def main(words: list[str]) -> int:
    """Run an attack; 1 if it found anything."""
    logging.disable(logging.WARNING)
    given = _arguments(words)
    out = given.out or Path(f"attack_{given.seed}")
    one = given.number is not None
    numbers = [given.number] if one else range(given.first, given.first + given.scenes)
    counts = series(given.seed, numbers, out, given.limit, verbose=given.verbose or one)
    print(counts)
    return int(any(counts.words[word] for word in FINDS))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
