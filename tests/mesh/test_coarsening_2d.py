"""Why: a coarser mesh of another body, or one that lost a side, would only make the solve slow, which nobody sees.

The thinned outline is held to the lengths of the sides and the areas of the regions; the prolongation to linear fields.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import meshes
import numpy as np
import pytest
from dolfinx import fem
from dolfinx.mesh import entities_to_geometry
from domains import measure, volume
from mpi4py import MPI
from runs import RANKS
from scenes import NESTED

from hvi_fenicsx import Model, read_scene, workflow
from hvi_fenicsx.mesh import gmsh_file
from hvi_fenicsx.mesh.domain import Domain
from hvi_fenicsx.mesh.domain import MeshThresholds as Thresholds
from hvi_fenicsx.mesh.hierarchy import with_hierarchy
from hvi_fenicsx.mesh.shapes import HalfDisk
from hvi_fenicsx.mesh.transfer import Transfer

HERE = Path(__file__).parent
DEMOS = Path(__file__).parents[2] / "demos"
COMM = MPI.COMM_WORLD
POLYGONS = {
    "halves": meshes.HALVES.replace("0.2", "0.03"),
    "graded": meshes.GRADED,
    "two bodies": meshes.BLOCKS.format(size=0.04, dimension=2, named=True),
}


COARSER = Thresholds(hierarchy_from=500, coarsest=100)
"""Coarser meshes for small ones too."""


def from_file(path: Path, body: str) -> Domain:
    return gmsh_file.read(COMM, meshes.make(path / "m.msh", body), 2)


def _nested(given: Model) -> workflow.Solution:
    domain = with_hierarchy(given.domain.build(COMM, 2), COARSER)
    return workflow.finish(workflow.prepare(given, domain=domain, thresholds=NESTED))


def coarser_of(body: Domain) -> Domain:
    coarser = with_hierarchy(body, COARSER).coarser()
    assert coarser is not None
    return coarser[0]


def area(body: Domain, name: str) -> float:
    x = body.mesh.geometry.x[body.mesh.geometry.dofmap[body.cells([name])]][:, :, :2]
    return float(np.abs(np.linalg.det(x[:, 1:] - x[:, :1])).sum() / 2)


@pytest.mark.parametrize("name", POLYGONS)
def test_a_polygon_keeps_its_sides_and_regions(name: str, tmp_path: Path) -> None:
    body = from_file(tmp_path, POLYGONS[name])
    coarse = coarser_of(body)
    assert volume(coarse) == pytest.approx(volume(body), rel=1e-12)
    assert {s: measure(coarse, s) for s in coarse.sides} == pytest.approx({s: measure(body, s) for s in body.sides})
    regions = {r: area(body, r) for r in body.regions}
    assert {r: area(coarse, r) for r in coarse.regions} == pytest.approx(regions, rel=0.1)
    fewer = body.mesh.topology.index_map(2).size_global / coarse.mesh.topology.index_map(2).size_global
    assert 2.5 < fewer < 6


def test_known_curves_are_met_on_all_levels() -> None:
    body = coarser_of(HalfDisk(radius=0.5, mesh_size=0.02).build(COMM, 2))
    x = body.mesh.geometry.x[np.unique(entities_to_geometry(body.mesh, 1, body.sides["arc"]))]
    assert np.hypot(x[:, 0], x[:, 1] - 0.5) == pytest.approx(0.5, rel=1e-12)


@pytest.mark.parametrize("name", POLYGONS)
def test_linear_fields_are_prolonged_as_they_are(name: str, tmp_path: Path) -> None:
    body = from_file(tmp_path, POLYGONS[name])
    fine, coarse = (fem.functionspace(b.mesh, ("Lagrange", 1, (2,))) for b in (body, coarser_of(body)))
    fields = [fem.Function(space) for space in (fine, coarse)]
    for field in fields:
        field.interpolate(lambda x: np.array([1 + 2 * x[0] - x[1], x[0] + 3 * x[1]]))
    found = Transfer().prolongation(fine, coarse) * fields[1].x.petsc_vec
    assert found.array == pytest.approx(fields[0].x.array, abs=1e-12)


def scene(path: Path, *overrides: str) -> Model:
    file = meshes.make(path / "m.msh", meshes.GOOD.replace("0.2", "0.03"))
    return read_scene(DEMOS / "strong_law.toml", [f'domain={{shape="file", file="{file}"}}', *overrides])


def test_a_start_from_another_mesh_ends_where_mumps_does(tmp_path: Path) -> None:
    """Without friction the minimiser is unique."""
    convex = ["boundary.wall.displacement=[0.0, 0.0]", 'boundary.floor={on="bottom", contact={gap=0.0}}']
    nested = _nested(scene(tmp_path, *convex))
    alone = scene(tmp_path, *convex, 'solver={linear_solver="lu"}')
    direct = workflow.finish(workflow.prepare(alone, domain=alone.domain.build(COMM, 2), thresholds=NESTED))
    assert nested.solve_result is not None
    assert nested.solve_result.levels > 1
    assert nested.converged
    assert direct.solve_result is not None
    assert direct.solve_result.levels == 1
    assert nested.examination.energy == pytest.approx(direct.examination.energy, rel=1e-9)  # type: ignore[union-attr]


@pytest.mark.parametrize("several", RANKS[1:])
def test_ranks_make_the_same_meshes_and_prolong_alike(several: int, tmp_path: Path) -> None:
    file = meshes.make(tmp_path / "m.msh", POLYGONS["halves"])
    printed = []
    for ranks in (1, several):
        command = ["mpirun", "--oversubscribe", "-n", str(ranks), sys.executable, "coarsened_ranks.py", str(file)]
        run = subprocess.run(command, cwd=HERE, capture_output=True, text=True, timeout=120)
        assert run.returncode == 0, run.stderr
        printed.append([float(word) for word in run.stdout.split()])
    assert printed[1] == pytest.approx(printed[0], rel=1e-10)


def test_coarse_bodies_slide_along_a_curved_part_as_the_fine_one_does() -> None:
    """A half-disk in a cavity: its normals turn, and what holds them must not hold the tangents of the coarse ones."""
    shape = '{shape="half_disk", radius=0.1, mesh_size=3e-3, mesh_size_below=2e-3}'
    law = '{law="quadratic_linear", gamma1=1e4, gamma2=5e3, delta=1e-4}'
    overrides = [f"domain={shape}", 'boundary.top={on="top", traction=[0.0, -2e4]}']
    floor = f'boundary.floor={{on="arc", contact={{gap=0.0}}, friction={law}}}'
    found = _nested(read_scene(DEMOS / "hertz.toml", [*overrides, floor]))
    assert found.converged
    assert found.solve_result is not None
    assert found.solve_result.levels > 1
    assert found.solve_result.counts.linear < 45
