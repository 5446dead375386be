"""Multigrid for displacements and averaged pressures solves what a factorisation solves, anywhere as fast.

A wrong block (regions, slanted frames, relative displacements, held unknowns) still converges, to another solution or
slowly; so solutions are compared with those of a factorisation, and iterations are counted.
"""

from __future__ import annotations

import numpy as np
import pytest
from mpi4py import MPI
from scenes import NESTED, Table, model, two_blocks

from hvi_fenicsx import prepare, read_tables
from hvi_fenicsx.runtime.cost import Timer
from hvi_fenicsx.solvers import nested_iteration
from hvi_fenicsx.system.held_solver import HeldPreconditioner, LinearSettings
from hvi_fenicsx.system.multigrid import Levels
from hvi_fenicsx.workflow import Preparation


def rubber(nu: float, kind: str = "plane_strain") -> Table:
    return {"model": kind, "youngs_modulus": 1e7, "poisson_ratio": nu}


def square(cells: int, nu: float) -> Table:
    return model(cells, degree=2) | {"material": rubber(nu)}


def cube() -> Table:
    return {
        "domain": {"shape": "box", "size": [1.0, 1.0, 1.0], "cells": [4, 4, 4]},
        "material": rubber(0.4999, "three_dimensional"),
        "boundary": {
            "walls": {"on": ["left", "front"], "contact": {"gap": 0.0}},
            "floor": {"on": "bottom", "contact": {"gap": 0.0}},
            "press": {"on": "top", "traction": [0.0, 0.0, "-1e6*(1.2 - 0.8*x)"]},
        },
        "solver": {"degree": 2},
    }


def half_disk() -> Table:
    """Normals of all directions: the unknowns of Γc are in local components."""
    return {
        "domain": {"shape": "half_disk", "radius": 0.1, "mesh_size": 0.01},
        "material": rubber(0.499),
        "boundary": {
            "press": {"on": "top", "displacement": [0.0, -1e-4]},
            "floor": {"on": "arc", "contact": {"obstacle": {"point": [0.0, 0.0], "normal": [0.0, 1.0]}}},
        },
        "solver": {"degree": 2},
    }


def blocks() -> Table:
    """Two nearly incompressible regions, and relative displacements between meshes that do not match."""
    table = two_blocks("rectangle", [1.0], [[12, 8], [9, 6]], "plane_strain", degree=2)
    return table | {
        "material": {name: rubber(nu) | {"region": name} for name, nu in (("lower", 0.4999), ("upper", 0.48))}
    }


def prepared(table: Table) -> tuple[Preparation, Levels]:
    scene = read_tables(table)
    found = prepare(scene, MPI.COMM_SELF, thresholds=NESTED)
    levels = nested_iteration.coarser_levels(found.task(), found.system)
    assert levels
    return found, levels


@pytest.mark.parametrize("name", ["square", "cube", "half_disk", "blocks"])
def test_it_solves_what_a_factorisation_solves(name: str) -> None:
    """With a tangent of the laws, and with some unknowns of Γc held."""
    tables = {"square": square(16, 0.49999), "cube": cube(), "half_disk": half_disk(), "blocks": blocks()}
    found, levels = prepared(tables[name])
    system, generator = found.system, np.random.default_rng(1)
    system.jacobian.set_rates([np.eye(k.shape[1]) * generator.random((len(k), 1, 1)) for k in system.jacobian.rates])
    some = system.jacobian.rows.dofs[generator.random(len(system.jacobian.rows.dofs)) < 0.4]
    held = np.setdiff1d(some, system.problem.fixed_here).astype(np.int32)
    load, expected, x = (system.load.duplicate() for _ in range(3))
    load.array[:] = generator.standard_normal(load.local_size)
    load.array[held] = load.array[system.problem.fixed_here] = 0.0
    for vector, settings, below in (
        (expected, LinearSettings("lu"), ()),
        (x, LinearSettings("mixed"), levels),
    ):
        vector.set(0.0)
        solver = HeldPreconditioner(system, below, settings, Timer())
        solver.prepare(held)
        assert solver.solve(load.copy(), vector, 1e-11)[1] > 0
    x.axpy(-1.0, expected)
    assert x.norm() < 1e-8 * expected.norm()


def iterations(table: Table) -> int:
    found, levels = prepared(table)
    solver = HeldPreconditioner(found.system, levels, LinearSettings("mixed"), Timer())
    solver.prepare(np.setdiff1d(found.system.bounds[0].component()[0], found.problem.fixed_here).astype(np.int32))
    return solver.solve(found.system.load.copy(), found.system.undisplaced(), 1e-6)[0]


def test_its_iterations_depend_neither_on_the_mesh_nor_on_the_material() -> None:
    counts = [iterations(square(cells, nu)) for cells, nu in ((16, 0.49999), (32, 0.499))]
    assert max(counts) < 1.5 * min(counts) < 300
