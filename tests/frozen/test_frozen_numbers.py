"""The frozen numbers (freeze.py) of a sample of each set in the fast tier, and of all small cases in the long one."""

from __future__ import annotations

from pathlib import Path

import pytest
from freeze import QUICK, Case, cases, golden
from runs import hvi

FAST = {
    "curved": ("exponential friction", "slip in space"),
    "paths": ("drop, 4 vertices", "block up to slide", "softening, stable"),
}
"""A few seconds in all."""
WHOLE = ("curved", "ranks")
"""Sets of which all cases are in the long tier; of others those that are quick."""
KNOWN = {
    "curved: slip in space": "one of six jumps releases 2.4e-5 more, as a motion in time does: held back it broke more",
    "curved: slip in space remembers": "the same",
    "ranks: slip in space, 3 ranks": "the same",
    "demos: check single_lap": "the vertex at the end of the overlap carries its law",
    "demos: run single_lap": "the same: the energy differs by 6e-4, of an error of 39 %",
    "ranks: exact path of two bodies, 3 ranks": "the same",
    "paths: single lap": "the same",
    "paths: single lap, unloaded": "the same",
    "paths: single lap up to its strength": "the same",
    "demos: run two_cylinders": "normals are the circles' own: the energy differs by 2e-4, of an error of 9e-3",
    "ranks: two cylinders, 3 ranks": "the same",
    "states: two cylinders, degree 2": "the same: the energy differs by 1.4e-8",
    "curved: glued plates, opening and slip": "two kinks at the place where one of seven jumps ends are gone",
    "curved: glued plates in space": "mean displacements of sides at the interface counted what is relative there",
    "curved: energies that differ by mode": "a path that was lost after a jump at a fold is followed to its end",
    "curved: energies that differ by mode, unloaded, power law": "work differs by 3e-6: its quadrature followed steps",
    "ranks: energies that differ by mode, 3 ranks": "dissipated differs by 3e-4, as do short steps: its quadrature",
    "curved: exponential glue lifted at its end": "bonds load again to where they were after one of twelve jumps",
    "demos: run ball_on_block": "the estimate differs by 8e-4: gaps between vertices are seen by one rule",
    "demos: run peeling_moment": "the forces of a moment alone are what a solve leaves",
}
"""Cases that differ from 3dad66c7, and how."""


def chosen() -> list[object]:
    """Each case as a parameter; those of the long tier are marked."""
    found: list[object] = []
    for group, members in cases().items():
        known = golden(group)
        for case in members:
            name = f"{group}: {case.name}"
            known_marks = [pytest.mark.xfail(reason=KNOWN[name], strict=True)] if name in KNOWN else []
            if case.name in FAST.get(group, ()):
                found.append(pytest.param(case, id=name, marks=known_marks))
            elif (
                case.name in known
                and group != "verification"  # which has a test of its own, against what others found
                and (group in WHOLE or known[case.name]["seconds"] < QUICK)
            ):
                found.append(pytest.param(case, id=name, marks=[pytest.mark.long, *known_marks]))
    return found


def run(words: list[str], ranks: int) -> tuple[int, str]:
    """Within this process, where one is enough."""
    done = hvi(*words, ranks=ranks)
    return done.returncode, done.stdout


@pytest.mark.parametrize("case", chosen())
def test_a_frozen_result_is_what_it_was(case: Case, tmp_path: Path) -> None:
    old = golden(case.group)[case.name]["record"]
    assert not case.differences(old, case.recorded(tmp_path, run))
