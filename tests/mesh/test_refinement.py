"""Why: a side lost, a vertex off its curve or a wrong parent would still give a mesh, only of another body.

A refined mesh is held to the lengths and areas of the body, its prolongation to dolfinx's own interpolation.
"""

from __future__ import annotations

import functools
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import meshes
import numpy as np
import pytest
from dolfinx import fem
from dolfinx import mesh as dmesh
from domains import BODIES, COMM, half_disk, lost, measure, rough, towards, volume
from runs import LONG_RANKS
from scenes import model, quadratic_linear, solved_system

from hvi_fenicsx import Model, read_tables, workflow
from hvi_fenicsx.mesh import gmsh_file, refinement
from hvi_fenicsx.mesh.blocks import block
from hvi_fenicsx.mesh.domain import Domain
from hvi_fenicsx.runtime.timing import Timer
from hvi_fenicsx.solvers.context import RunControl
from hvi_fenicsx.solvers.nested_iteration import CoarseStart, solve_from_coarser
from hvi_fenicsx.solvers.registry import options_of
from hvi_fenicsx.solvers.thresholds import Thresholds as SolverThresholds
from hvi_fenicsx.system import levels
from hvi_fenicsx.system.system import System, assemble
from hvi_fenicsx.system.thresholds import Thresholds as LinearThresholds


@pytest.mark.parametrize("make", BODIES[:2])
def test_sides_and_volume_stay_those_of_the_body(make: Callable[[], Domain]) -> None:
    body = make()
    before = {name: measure(body, name) for name in body.sides}, volume(body)
    for fine in (refinement.uniform(body), towards(body, np.array([1.0, 0.0, 0.0])[: body.dimension], 4)[-1]):
        after = {name: measure(fine.domain, name) for name in body.sides}, volume(fine.domain)
        assert after[0] == pytest.approx(before[0], rel=1e-12)
        assert after[1] == pytest.approx(before[1], rel=1e-12)


def test_curved_sides_approach_their_curve() -> None:
    """A half-disk of radius ½: inscribed polygons of π/2, whose error falls by 4 when edges are halved."""
    body, errors = half_disk(), []
    for _ in range(3):
        body = refinement.uniform(body).domain
        errors.append(np.pi / 2 - measure(body, "arc"))
        assert measure(body, "top") == pytest.approx(1.0, rel=1e-12)
    assert errors[:-1] == pytest.approx([4 * e for e in errors[1:]], rel=2e-2)


def test_regions_keep_their_cells(tmp_path: Path) -> None:
    body = gmsh_file.read(COMM, meshes.make(tmp_path / "halves.msh", meshes.HALVES), 2)
    fine = towards(body, np.array([0.5, 0.5]), 3)[-1].domain
    for name, side in (("soft", -1.0), ("hard", 1.0)):
        middles = dmesh.compute_midpoints(fine.mesh, 2, fine.cells([name]))
        assert len(middles) > len(body.cells([name]))
        assert np.all(side * (middles[:, 0] - 0.5) > 0)


@pytest.mark.parametrize("make", BODIES[:2])
def test_prolongation_from_parent_cells(make: Callable[[], Domain]) -> None:
    """Against dolfinx's own interpolation between meshes that do not match."""
    body = make()
    d = body.dimension
    for step in (refinement.uniform(body), towards(body, np.zeros(d), 1)[0]):
        fine, coarse = (fem.functionspace(b.mesh, ("Lagrange", 1, (d,))) for b in (step.domain, body))
        assert lost(step.transfer.prolongation(fine, coarse), fine, coarse) < 1e-13


def test_in_space_the_diagonals_are_cut_and_no_shorter_edges() -> None:
    """Of n³ cubes cut into six: n³ diagonals of the cubes, 3 n² (n + 1) of their faces."""
    n, body = 6, block(COMM, [1.0, 1.0, 1.0], [6, 6, 6])
    everywhere = np.arange(body.mesh.topology.index_map(3).size_local, dtype=np.int32)
    fine = refinement.marked(body, everywhere).domain
    assert fine.mesh.topology.index_map(0).size_global == (n + 1) ** 3 + n**3 + 3 * n**2 * (n + 1)


def smallest_angle(body: Domain) -> float:
    """Of all cells (2D) or of their faces (3D), degrees."""
    corners = refinement.cell_corners(body.mesh)
    worst = np.inf
    count = corners.shape[1]
    for i in range(count):
        for j in range(count):
            for k in range(j):
                if i in (j, k):
                    continue
                a, b = corners[:, j] - corners[:, i], corners[:, k] - corners[:, i]
                cosine = np.sum(a * b, axis=1) / np.linalg.norm(a, axis=1) / np.linalg.norm(b, axis=1)
                worst = min(worst, float(np.min(np.degrees(np.arccos(cosine)))))
    return worst


@pytest.mark.parametrize("make", BODIES)
def test_ten_steps_do_not_spoil_the_cells(make: Callable[[], Domain]) -> None:
    """Plaza's bisection leaves at least half the smallest angle of a triangle (Rosenberg and Stenger 1975)."""
    body = make()
    before = smallest_angle(body)
    steps = towards(body, np.zeros(body.dimension), 10)
    angles = [smallest_angle(step.domain) for step in steps]
    assert min(angles) > before / 2
    assert angles[9] > 0.9 * angles[5]


def slanted(cells: float) -> Model:
    """A disk in a bed of its own shape, so that frames turn, with a friction."""
    return read_tables(
        {
            "domain": {"shape": "disk", "radius": 0.5, "mesh_size": cells},
            "material": {"model": "plane_strain", "youngs_modulus": 1e7, "poisson_ratio": 0.3},
            "boundary": {
                "top": {"on": "upper_arc", "traction": [1e3, -2e4]},
                "bed": {
                    "on": "lower_arc",
                    "contact": {"gap": 0.0},
                    "friction": {"law": "tresca", "yield_traction": 1e4},
                },
            },
        }
    )


def test_prolongation_turns_with_the_frames() -> None:
    scene = slanted(0.15)
    coarse = assembled(scene, scene.domain.build(COMM, 2))
    step = refinement.uniform(coarse.problem.domain)
    fine = assembled(scene, step.domain)
    assert coarse.rotation is not None
    plain = step.transfer.prolongation(fine.problem.space, coarse.problem.space)
    turned = levels.prolongation(fine, coarse, step.transfer)
    known = fem.Function(coarse.problem.space)
    known.interpolate(lambda x: rough(x)[:2])
    cartesian = plain.createVecRight()
    cartesian.array[:] = known.x.array
    found = fine.displacement(turned * coarse.unknowns(known))
    assert np.max(np.abs(found.x.array - (plain * cartesian).array)) < 1e-14


@pytest.mark.parametrize("scene", [read_tables(model(8, 3e6, friction=quadratic_linear(1e6))), slanted(0.1)])
def test_multigrid_and_starts_on_a_refined_hierarchy(scene: Model) -> None:
    """The solution of the finest mesh is that of a direct solve from rest; few steps remain from the coarser one."""
    coarse, options = workflow.prepare(scene, COMM), options_of(scene.solver)
    small = SolverThresholds(linear=LinearThresholds(largest_direct={2: 500, 3: 500}))
    options = options.model_copy(update={"thresholds": small})
    control, found = RunControl(timer=Timer()), solved_system(coarse)
    for k in range(3):
        before = found.system.problem.domain
        step = refinement.uniform(before) if k else towards(before, np.zeros(2), 1)[0]
        system = assembled(scene, step.domain)
        up = levels.prolongation(system, found.system, step.transfer)
        start = CoarseStart(
            system=found.system,
            result=found.result,
            prolongation=up,
            levels=levels.with_coarser_system(system, found.system, found.levels, up),
        )
        found = solve_from_coarser(system, start, coarse.solvability, options, control)
    assert found.result.converged
    assert found.result.levels == 4
    direct = workflow.finish(workflow.prepare(scene, COMM, domain=step.domain)).solve_result
    assert direct is not None
    assert np.max(np.abs(found.result.u.x.array - direct.u.x.array)) < 1e-6 * np.max(np.abs(direct.u.x.array))
    assert found.result.counts.newton <= 4 * direct.counts.newton


def assembled(scene: Model, body: Domain) -> System:
    return assemble(body, scene.formulation(), Timer())


@pytest.mark.parametrize("ranks", LONG_RANKS[1:])
def test_ranks_agree(ranks: int) -> None:
    """The same lengths, vertices and transferred field, however the mesh is split; ghosts are where owners are."""
    parallel = _run(ranks)
    serial = _run(1)
    assert parallel == pytest.approx(serial, rel=1e-10)


@functools.cache
def _run(ranks: int) -> list[float]:
    mpi = ["mpirun", "-n", str(ranks)] if ranks > 1 else []
    words = [*mpi, sys.executable, "-m", "mpi4py", "-m", "refined_ranks"]
    root = Path(__file__).parent
    out = subprocess.run(words, cwd=root, capture_output=True, text=True, check=True, timeout=300).stdout
    return [float(word) for word in out.split()]
