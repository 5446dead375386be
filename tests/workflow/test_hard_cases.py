"""A reduced part of the hard-case matrix (benchmarks/hard_cases.py): ``auto``, judged by the certificate.

The cases are taken from the committed list by their size and place in it, not by what becomes of them.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

from hvi_fenicsx import read_tables
from hvi_fenicsx.certify import certificate
from hvi_fenicsx.equilibrium_search.enumeration import Enumeration
from hvi_fenicsx.load_paths.following import PathRun
from hvi_fenicsx.model import PathTable
from hvi_fenicsx.workflow import solve
from hvi_fenicsx.workflow.equilibria import Equilibria

BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"
sys.path.insert(0, str(BENCHMARKS))

import hard_equilibria  # noqa: E402
import hard_run  # noqa: E402
import hard_scenes  # noqa: E402
from covering import Case, Table, cases  # noqa: E402

TABLE = Table.read(BENCHMARKS / "hard_cases.toml")
LISTED = cases(TABLE)
SMALL = [c for c in LISTED if c["cells"] <= 8 and c["ranks"] == 1]
FAST = SMALL[:: max(1, len(SMALL) // 6)]
REST = [c for c in LISTED if c["cells"] <= 32 and c["ranks"] == 1 and c not in FAST][::4]
SOLVED = ("certified", "escapes", "no_equilibrium")


def parameters(chosen: list[Case]) -> list[Any]:
    return [pytest.param(case, id=case.key) for case in chosen]


def solve_and_judge(case: Case, degree: int = 1) -> None:
    case = replace(case, fixed={**case.fixed, "degree": degree})
    record = hard_run.attempt(case, TABLE.data, "auto", TABLE.data["limit"])
    assert record["outcome"] in SOLVED, f"{case.values}: {record['reason']} {record.get('certificate')}"


@pytest.mark.parametrize("case", parameters(FAST))
def test_auto_solves_a_small_case(case: Case) -> None:
    solve_and_judge(case)


def test_a_bonded_block_just_below_its_peak_has_no_equilibrium_proven_in_few_cells() -> None:
    """The enumeration of all states says so, too (docs/hard-cases.md). Cells that reach far were divided in vain."""
    case = next(c for c in LISTED if c.key == "6507789c7d")
    problem = Equilibria(hard_scenes.prepare(case, TABLE.data, "auto", MPI.COMM_SELF)).problem
    assert problem is not None
    search = Enumeration(problem=problem)
    search.start()
    assert search.run(lambda: search.cells > 200, lambda _: None)
    assert not search.points


STEEP = [case for case in LISTED if case.key in ("9206d05c90", "135630e77f")]
"""They were not certified at degree 2: a law smoothed with ε = 1e-6, 1e-5 from the limit load, and a body a hundred
times as long as high, bent so far that the rounding of the matrix had a net force."""


@pytest.mark.long
@pytest.mark.parametrize("case", parameters([*FAST, *(case for case in STEEP if case not in FAST)]))
def test_auto_solves_a_small_case_at_degree_two(case: Case) -> None:
    solve_and_judge(case, degree=2)


@pytest.mark.long
@pytest.mark.parametrize("case", parameters(REST))
def test_auto_solves_a_case(case: Case) -> None:
    solve_and_judge(case)


TURNED = next(case for case in LISTED if case.key == "9e6b0c4cab")
"""A body a hundred times as high as wide, which turns by 90 times its strain: the rows of the matrix round alike, and
left a net force of 5e-6 that contact and laws had to carry."""


FAR = [(32, 1e-3), pytest.param(128, TURNED["stretch"], marks=pytest.mark.long)]


@pytest.mark.parametrize(("cells", "slenderness"), FAR)
def test_a_body_that_turns_far_balances(cells: int, slenderness: float) -> None:
    """The net force has no excuse: it is within the tolerance itself."""
    case = replace(TURNED, values={**TURNED.values, "cells": cells, "stretch": slenderness})
    record = hard_run.attempt(case, TABLE.data, "auto", TABLE.data["limit"])
    assert record["outcome"] == "certified"
    assert record["certificate"]["net_force"] < 1e-9


AGREED = [
    ("quadratic_linear", "peak", "exact", 4, 0),
    pytest.param("one_sided", "peak", "quadratic", 4, 0, marks=pytest.mark.long),
    pytest.param("graph", "peak", "exact", 8, 0, marks=pytest.mark.long),
    ("tresca", "wall", "exact", 4, 1),
]


@pytest.mark.parametrize(("law", "support", "smoothing", "cells", "expected"), AGREED)
def test_a_search_with_a_proof_and_auto_agree_on_whether_there_is_an_equilibrium(
    law: str, support: str, smoothing: str, cells: int, expected: int
) -> None:
    """Pushed blocks that no state of their floors holds, and one at a wall that exactly one does."""
    wanted = {"law": law, "support": support, "smoothing": smoothing, "cells": cells, "side": "under"}
    case = next(c for c in LISTED if all(c[axis] == value for axis, value in wanted.items()))
    assert hard_equilibria.number_of_equilibria(case, TABLE.data) == expected
    record = hard_run.attempt(case, TABLE.data, "auto", TABLE.data["limit"])
    assert record["outcome"] == ("certified" if expected else "no_equilibrium")


def test_a_run_finds_an_equilibrium_that_neither_loading_nor_another_start_leads_to() -> None:
    """Two of the eight that a search proves are minimisers."""
    friction = {"law": "graph", "points": [[0, 1.6e6], [9.4e-5, 6.2e5], [1.4e-4, 0]]}
    glue = {"law": "graph", "points": [[0, 5.4e6], [1.6e-4, 2.1e6], [2.4e-4, 0]], "one_sided": True}
    table = {
        "domain": {"shape": "rectangle", "size": [1.9, 1.1], "cells": [2, 1]},
        "material": {"model": "plane_strain", "youngs_modulus": 5.5e9, "poisson_ratio": 0.21},
        "boundary": {
            "floor": {"on": "bottom", "friction": friction, "adhesion": glue, "contact": {"gap": 0.0}},
            "pull": {"on": "right", "traction": [-1e6, 1.1e4]},
            "top": {"on": "top", "traction": [-3.4e5, 4.5e5]},
        },
    }
    found = solve(read_tables(table), MPI.COMM_SELF)
    assert found.examination is not None
    assert found.converged
    assert np.isclose(found.examination.energy * found.problem.scales.energy, [-505.9196, -484.8706], atol=1e-3).any()


def test_algebraic_multigrid_that_takes_too_long_goes_over_to_the_direct_solver() -> None:
    """A nearly incompressible body on graded cells, GAMG wanted: with it alone the case ends at 6e-8."""
    solve_and_judge(
        next(c for c in LISTED if (c["material"], c["linear"]) == ("plane_strain 0.4999", "gamg") and c["ranks"] == 1)
    )


PLAIN = {
    "body": "plate",
    "question": "path",
    "degree": 1,
    "support": "tip",
    "law": "softening",
    "strength": 0.1,
    "delta": 0.2,
    "lift": "tilted",
    "margin": 1e-3,
    "side": "over",
    "smoothing": "quadratic",
    "epsilon": 1e-3,
    "cells": 4,
    "stretch": 1.0,
    "units": "m",
    "modulus": 2.15e11,
    "material": "plane_stress 0.29",
    "linear": "lu",
    "ranks": 1,
}
LOST = {
    # a smoothed law that unloads from its first piece, along which its chord already goes
    "block in space": {"body": "block", "support": "peak", "strength": 3.0, "side": "under", "stretch": 10.0},
    # no load at all is borne: the path went astray at factors of 1e-13
    "stack that tips": {"body": "stack", "law": "exponential", "smoothing": "chks"},
    "block that tips": {"body": "block", "law": "tresca", "smoothing": "chks"},
    # a length of 5e-17 set out backwards
    "block that comes off": {"body": "block", "support": "wall", "law": "graph", "strength": 3.0, "lift": "none",
                             "smoothing": "chks", "stretch": 100.0, "material": "plane_strain 0.4999"},
}  # fmt: skip
SLOW = {"block in space": pytest.mark.long}


@pytest.mark.parametrize("name", [pytest.param(name, marks=SLOW.get(name, ())) for name in LOST])
def test_a_path_that_was_lost_ends_where_the_body_comes_off(name: str) -> None:
    """Cases of benchmarks/hard_wide.toml, on fewer cells."""
    wide = Table.read(BENCHMARKS / "hard_wide.toml")
    case = Case(number=1, values=PLAIN | LOST[name], fixed=wide.data["fixed"])
    record = hard_run.attempt(case, wide.data, "auto", wide.data["limit"])
    assert record["outcome"] == "certified", record
    assert record["end"] == "escapes"


STOOD = ("c8e5a9caa4", "ba3ba6f79c")
"""Smoothed laws: a body that leans far, and events near to each other."""
PATIENCE = 200.0
"""Seconds."""


@pytest.mark.long
@pytest.mark.parametrize("key", STOOD)
def test_a_path_that_found_no_step_short_enough_reaches_its_end(key: str) -> None:
    """All rows are certified, and the end is not against what limit analysis proves; how long it takes is not asked."""
    wide = Table.read(BENCHMARKS / "hard_wide.toml")
    (case,) = (case for case in cases(wide) if case.key == key)
    record = hard_run.attempt(case, wide.data, "auto", PATIENCE)
    assert record["outcome"] == "certified", record


@pytest.mark.long
def test_a_slender_body_that_slides_under_its_limit_load_meets_nothing_far_off() -> None:
    """Rounding of its motion opened gaps after 1e10 of its slip; the path went there, and back to smaller loads."""
    wide = Table.read(BENCHMARKS / "hard_wide.toml")
    (case,) = (case for case in cases(wide) if case.key == "f90687491c")
    prepared = hard_scenes.prepare(case, wide.data, "auto", MPI.COMM_SELF)
    path = PathRun(prepared, PathTable()).follow()
    assert path.end == "escapes"
    assert path.uncertified == 0
    assert path.rows[-1].factor == pytest.approx(prepared.solvability.lambda_held, rel=1e-9)


@pytest.mark.long
def test_a_path_along_short_steep_pieces_reaches_its_end() -> None:
    """Ends of pieces that are 1e-7 of the unit long were passed so early that forces jumped by a thousandth."""
    wide = Table.read(BENCHMARKS / "hard_wide.toml")
    (case,) = (case for case in cases(wide) if case.key == "6d6853fc81")
    case = replace(case, values={**case.values, "cells": 4})
    record = hard_run.attempt(case, wide.data, "auto", wide.data["limit"])
    assert record["outcome"] == "certified", record
    assert record["end"] == "reached"


TALL = {
    "on a block": {"body": "stack", "support": "peak", "law": "quadratic_linear", "strength": 10.0, "margin": 0.01,
                   "side": "under", "modulus": 1e3},
    "at degree 2": {"body": "stack", "support": "tip", "strength": 0.1, "margin": 1e-7, "side": "under",
                    "degree": 2, "units": "um", "modulus": 1e12},
}  # fmt: skip


@pytest.mark.parametrize("name", TALL)
def test_the_rows_of_a_tall_body_are_certified_as_they_are_written(name: str) -> None:
    """Rounding of the stiffness had left forces at open gaps; each displacement passes the certificate by itself."""
    wide = Table.read(BENCHMARKS / "hard_wide.toml")
    sharp = {"smoothing": "exact", "epsilon": "none", "cells": 8, "stretch": 0.1}
    case = Case(number=1, values=PLAIN | sharp | TALL[name], fixed=wide.data["fixed"])
    prepared = hard_scenes.prepare(case, wide.data, "auto", MPI.COMM_SELF)
    run = PathRun(prepared, PathTable())
    path = run.follow()
    assert len(path.rows) > 5
    assert path.uncertified == 0
    plain = [n for n, state in enumerate(run.states) if not np.any(state.memory)]
    assert all(certificate.examine(*run.state(n), prepared.options.tolerance).certificate.passed for n in plain)


@pytest.mark.long
def test_no_jump_leads_off_where_the_body_is_held() -> None:
    """A slender plate about to tip: a motion went out of all reach and came back; the path had ended there."""
    wide = Table.read(BENCHMARKS / "hard_wide.toml")
    law = {"law": "quadratic_linear", "strength": 10.0, "margin": 0.1, "side": "under", "degree": 2, "cells": 8}
    rest = {"smoothing": "chks", "epsilon": 1e-6, "stretch": 10.0, "material": "plane_strain 0.4999", "linear": "gamg"}
    case = Case(number=1, values=PLAIN | law | rest, fixed=wide.data["fixed"])
    record = hard_run.attempt(case, wide.data, "auto", limit=600.0)
    assert record["state"] == "held"
    assert record["end"] == "reached"
    assert record["outcome"] == "certified"
