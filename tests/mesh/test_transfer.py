"""Why: a wrong prolongation, or a multigrid that moves a held vertex, would still converge, only elsewhere or slowly.

And a nested start must not decide what is certified.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import meshes
import numpy as np
import pytest
from domains import lost, space_on
from mpi4py import MPI
from scenes import NESTED, solved_system

from hvi_fenicsx import InputError, read_scene, workflow
from hvi_fenicsx.mesh.blocks import block
from hvi_fenicsx.runtime.cost import Timer
from hvi_fenicsx.solvers.active_set import ActiveSetSolver
from hvi_fenicsx.solvers.resting_start import contact_dofs
from hvi_fenicsx.system.held_solver import LinearSettings

DEMOS = Path(__file__).parents[2] / "demos"
SHAPES: list[tuple[list[float], list[int]]] = [
    ([1.0, 3.0], [16, 32]),
    ([1.0, 3.0], [101, 104]),
    ([1.0, 2.0, 0.5], [16, 16, 16]),
    ([1.0, 2.0, 0.5], [19, 22, 15]),
]


@pytest.mark.parametrize(("size", "cells"), SHAPES)
def test_prolongation_keeps_a_coarse_field(size: list[float], cells: list[int]) -> None:
    """Against dolfinx's own interpolation between meshes that do not match."""
    whole = block(MPI.COMM_WORLD, size, cells)
    coarser = whole.coarser()
    assert coarser is not None
    fine, coarse = space_on(whole.mesh), space_on(coarser[0].mesh)
    assert lost(coarser[1].prolongation(fine, coarse), fine, coarse) < 1e-13


def test_a_nested_solution_is_certified() -> None:
    found = workflow.solve(read_scene(DEMOS / "strong_law.toml", ["domain.cells=[64, 64]"]), thresholds=NESTED)
    assert found.converged
    assert found.solve_result is not None
    assert found.solve_result.levels == 3


def test_a_convex_scene_ends_where_the_direct_solve_ends() -> None:
    """Without friction the minimiser is unique, whatever the start and the linear solver."""
    overrides = ["domain.cells=[64, 64]", 'boundary.press.traction=[0.0, "-1e6*(1 - 1.5*x)"]']
    scene = read_scene(DEMOS / "strong_law.toml", [*overrides, 'boundary.floor={on="bottom", contact={gap=0.0}}'])
    direct = scene.with_solver(linear_solver="lu")
    energies = [workflow.solve(s, thresholds=NESTED).examination.energy for s in (scene, direct)]  # type: ignore[union-attr]
    assert energies[0] == pytest.approx(energies[1], rel=1e-9)


def test_multigrid_iterations_do_not_grow_with_the_mesh() -> None:
    assert [iterations(n) for n in (64, 127)] == pytest.approx([iterations(32)] * 2, abs=2)


def iterations(cells: int) -> int:
    """Of a solve with contact closed, to 1e-8."""
    scene = read_scene(DEMOS / "wall_left.toml", [f"domain.cells=[{cells}, {cells}]", "solver={}"])
    prepared = workflow.prepare(scene, thresholds=NESTED)
    levels = solved_system(prepared).levels
    solver = ActiveSetSolver(prepared.system, levels, LinearSettings("mg"), Timer())
    contact = contact_dofs(prepared.system).astype(np.int32)
    solver.held.prepare(contact)
    load, x = prepared.system.load.copy(), prepared.system.load.duplicate()
    load.array[contact] = 0.0
    x.set(0.0)
    return solver.held.solve(load, x, 1e-8)[0]


@pytest.mark.parametrize("body", [meshes.GOOD, meshes.SLANTED], ids=["straight", "slanted"])
def test_a_refined_file_is_solved_from_level_to_level(body: str, tmp_path: Path) -> None:
    """Without friction the minimiser is unique: that of the finest mesh alone, without a mesh hierarchy, by MUMPS."""
    file = meshes.make(tmp_path / "m.msh", body)
    convex = ["boundary.wall.displacement=[0.0, 0.0]", 'boundary.floor={on="bottom", contact={gap=0.0}}']
    scene, alone = (
        read_scene(DEMOS / "strong_law.toml", [*convex, f'domain={{shape="file", file="{file}", {more}}}', *solver])
        for more, solver in (("refinements=3", []), ("scale=1.0", ['solver={linear_solver="lu"}']))
    )
    mesh = replace(scene.domain.build_hierarchy(MPI.COMM_WORLD, 2), coarsening=None)
    direct = workflow.finish(workflow.prepare(alone, domain=mesh, thresholds=NESTED))
    found = workflow.solve(scene, thresholds=NESTED)
    assert found.solve_result is not None
    assert found.solve_result.levels > 1
    assert found.dofs == direct.dofs
    assert found.examination.energy == pytest.approx(direct.examination.energy, rel=1e-9)  # type: ignore[union-attr]


def test_refinements_that_memory_cannot_hold_are_refused(tmp_path: Path) -> None:
    file = meshes.make(tmp_path / "m.msh", meshes.GOOD)
    scene = read_scene(DEMOS / "strong_law.toml", [f'domain={{shape="file", file="{file}", refinements=10}}'])
    with pytest.raises(InputError, match=r"domain\.refinements: .* use fewer refinements"):
        workflow.solve(scene)
