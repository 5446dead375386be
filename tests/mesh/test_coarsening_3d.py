"""Why: a coarser mesh of another body, or none at all, would only make the solve slow, which nobody sees.

Sides and regions keep their sizes about; linear fields are prolonged exactly; what is solved does not change.
"""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import meshes
import numpy as np
import pytest
from domains import lost, space_on
from mpi4py import MPI
from runs import LONG_RANKS

from hvi_fenicsx import read_tables, workflow
from hvi_fenicsx.mesh import coarsening, gmsh_file
from hvi_fenicsx.mesh.domain import Domain
from hvi_fenicsx.mesh.domain import MeshThresholds as Thresholds
from hvi_fenicsx.mesh.hierarchy import with_hierarchy
from hvi_fenicsx.mesh.transfer import Transfer
from hvi_fenicsx.system.thresholds import Thresholds as SolverThresholds

HERE = Path(__file__).parent
COMM = MPI.COMM_WORLD
LIFTED: dict[str, Any] = {
    "material": {"model": "three_dimensional", "youngs_modulus": 3e10, "poisson_ratio": 0.2},
    "boundary": {
        "floor": {
            "on": "bottom",
            "contact": {"gap": 0.0},
            "friction": {"law": "quadratic_linear", "gamma1": 4e5, "gamma2": 2e5, "delta": 1e-5},
        },
        "press": {"on": "top", "traction": [5e4, 0.0, "-1e6*(1 - 1.9*x*y)"]},
    },
}
"""A block with a bore, pressed down at three of its corners and pulled up at the fourth."""


COARSER = Thresholds(hierarchy_from=500, coarsest=400)
"""Coarser meshes for small ones too."""


@pytest.fixture(scope="module")
def bored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return meshes.make(tmp_path_factory.mktemp("bored") / "m.msh", meshes.BORED.format(radius=0.2, size=0.09))


def with_coarser(file: Path) -> tuple[Domain, Domain]:
    body = gmsh_file.read(COMM, file, 3)
    coarser = with_hierarchy(body, COARSER).coarser()
    assert coarser is not None
    return body, coarser[0]


def test_a_bored_block_keeps_its_sides_and_regions(bored: Path) -> None:
    body, coarse = with_coarser(bored)
    fine, found = coarsening.measures(body), coarsening.measures(coarse)
    assert found == pytest.approx(fine, rel=0.1)
    flat = {name: size for name, size in fine.items() if name[1] in ("left", "right", "bottom", "top")}
    assert {name: found[name] for name in flat} == pytest.approx(flat, rel=1e-9)
    assert 5 < body.mesh.topology.index_map(3).size_global / coarse.mesh.topology.index_map(3).size_global < 30


def test_a_linear_field_is_prolonged_exactly(tmp_path: Path) -> None:
    body, coarse = with_coarser(meshes.make(tmp_path / "m.msh", meshes.BORED.format(radius=0, size=0.12)))
    fine, under = space_on(body.mesh), space_on(coarse.mesh)
    assert lost(Transfer().prolongation(fine, under), fine, under, linear=True) < 1e-10


@pytest.mark.long
def test_what_is_solved_does_not_change(bored: Path) -> None:
    thresholds = SolverThresholds(nested_from=500)
    scene = read_tables(LIFTED | {"domain": {"shape": "file", "file": str(bored)}})
    domain = with_hierarchy(scene.domain.build(COMM, 3), COARSER)
    nested = workflow.finish(workflow.prepare(scene, domain=domain, thresholds=thresholds))
    alone = workflow.finish(workflow.prepare(scene, domain=replace(domain, coarsening=None), thresholds=thresholds))
    assert [s.solve_result.levels for s in (nested, alone)] == [2, 1]  # type: ignore[union-attr]
    assert nested.converged
    assert alone.converged
    assert nested.examination.energy == pytest.approx(alone.examination.energy, rel=1e-9)  # type: ignore[union-attr]


@pytest.mark.parametrize("ranks", LONG_RANKS[1:])
def test_the_coarse_mesh_is_the_same_on_several_ranks_shared_like_the_fine_one(ranks: int, bored: Path) -> None:
    command = ["mpirun", "--oversubscribe", "-n", str(ranks), sys.executable, "remeshed_ranks.py", str(bored)]
    run = subprocess.run(command, cwd=HERE, capture_output=True, text=True, timeout=120)
    assert run.returncode == 0, run.stderr
    printed = np.array([[float(word) for word in line.split()] for line in run.stdout.splitlines()])
    assert len(printed) == ranks
    assert np.all(printed[:, 0] > 0.5 / ranks), "of the coarse cells"
    assert np.all(printed[:, 1] < 0.2), "distance of the parts' centres over the body"
    assert np.all(printed[:, 2] < 0.1), "of a side's area"
    coarse = with_coarser(bored)[1]
    alone = [coarse.mesh.topology.index_map(3).size_global, *coarsening.measures(coarse).values()]
    np.testing.assert_allclose(printed[:, 3:], [alone] * ranks, rtol=1e-12)
