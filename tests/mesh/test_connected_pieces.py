"""Why: a joint in one mesh file is as large as one in two, and must not take ten times as long.

Each body has its own coarser mesh. What a body does not see it must not move; what is solved does not change.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import meshes
import pytest
from mpi4py import MPI
from runs import LONG_RANKS, on_ranks

from hvi_fenicsx import read_tables, workflow
from hvi_fenicsx.mesh.domain import MeshThresholds as Thresholds
from hvi_fenicsx.mesh.hierarchy import with_hierarchy
from hvi_fenicsx.system.thresholds import Thresholds as SolverThresholds

COARSER = Thresholds(hierarchy_from=500, coarsest=100)
"""Coarser meshes for small ones too."""
JOINT: dict[str, Any] = {
    "material": {"model": "plane_stress", "youngs_modulus": 1e9, "poisson_ratio": 0.3},
    "boundary": {
        "base": {"on": "lower_low", "displacement": [0.0, 0.0]},
        "press": {"on": "upper_high", "traction": [2e4, -1e5]},
    },
    "interface": {
        "glue": {
            "between": ["lower_high", "upper_low"],
            "contact": {"gap": 0.0},
            "friction": {"law": "graph", "points": [[0, 0], [1e-5, 1e5], [1e-4, 2e4]]},
        }
    },
}


@pytest.mark.parametrize("ranks", LONG_RANKS)
@pytest.mark.parametrize(("dimension", "size"), [(2, 0.05), pytest.param(3, 0.13, marks=pytest.mark.long)])
def test_each_body_has_its_own_coarser_mesh(dimension: int, size: float, ranks: int, tmp_path: Path) -> None:
    file = meshes.make(tmp_path / "two.msh", meshes.TOUCHING.format(size=size, dimension=dimension))
    found = on_ranks(ranks, "tests/mesh/connected_pieces_ranks.py", file, dimension)
    assert found["error"] < 1e-10
    assert all(found["names"])
    assert all(found["facets"])
    fine, coarse = found["vertices"]
    assert fine > 3 * coarse


def test_what_is_solved_does_not_change(tmp_path: Path) -> None:
    file = meshes.make(tmp_path / "two.msh", meshes.TOUCHING.format(size=0.05, dimension=2))
    scene = read_tables(JOINT | {"domain": {"shape": "file", "file": str(file)}})
    thresholds, made = SolverThresholds(nested_from=500), scene.domain.build(MPI.COMM_WORLD, 2)
    nested, alone = (
        workflow.finish(workflow.prepare(scene, domain=domain, thresholds=thresholds))
        for domain in (with_hierarchy(made, COARSER), made)
    )
    assert nested.solve_result.levels > alone.solve_result.levels == 1  # type: ignore[union-attr]
    assert nested.converged
    assert alone.converged
    assert nested.examination.energy == pytest.approx(alone.examination.energy, rel=1e-9)  # type: ignore[union-attr]
