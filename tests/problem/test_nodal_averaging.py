"""Why: above ν = 0.45 P1 cells lock, and a certificate of a locked solution certifies the wrong problem (solver-notes).

The averaged dilatation is compared with quadratic elements, which do not lock, on a scene without contact.
"""

from __future__ import annotations

from typing import Any

import pytest
import ufl
from dolfinx import fem
from dolfinx.fem.petsc import assemble_matrix, assemble_vector
from dolfinx.mesh import CellType, create_rectangle, locate_entities_boundary, meshtags
from mpi4py import MPI
from petsc4py import PETSc

from hvi_fenicsx import Model, read_tables, solve

NU, FORCE = 0.4999, 1.0e-3


def scene(cells: int, nu: float = NU) -> Model:
    return read_tables(
        {
            "domain": {"shape": "rectangle", "size": [1.0, 1.0], "cells": [cells, cells]},
            "material": {"model": "plane_strain", "youngs_modulus": 1.0, "poisson_ratio": nu},
            "boundary": {
                "clamp": {"on": "left", "displacement": [0.0, 0.0]},
                "shear": {"on": "right", "traction": [0.0, -FORCE]},
            },
        }
    )


def energy(cells: int) -> float:
    solution = solve(scene(cells))
    assert solution.examination is not None
    assert solution.converged
    return solution.examination.energy * solution.problem.scales.energy


def plain_energy(cells: int, degree: int) -> float:
    """The same body with plain elements of a degree, written out by hand."""
    mesh = create_rectangle(MPI.COMM_WORLD, [[0.0, 0.0], [1.0, 1.0]], [cells, cells], CellType.triangle)
    space = fem.functionspace(mesh, ("Lagrange", degree, (2,)))
    u, v = ufl.TrialFunction(space), ufl.TestFunction(space)
    lam, two_mu = NU / ((1 + NU) * (1 - 2 * NU)), 1 / (1 + NU)
    strain = lambda w: ufl.sym(ufl.grad(w))  # noqa: E731
    form = (two_mu * ufl.inner(strain(u), strain(v)) + lam * ufl.div(u) * ufl.div(v)) * ufl.dx
    left = locate_entities_boundary(mesh, 1, lambda x: x[0] < 1e-9)
    right = locate_entities_boundary(mesh, 1, lambda x: x[0] > 1 - 1e-9)
    ds = ufl.Measure("ds", domain=mesh, subdomain_data=meshtags(mesh, 1, right, right * 0 + 1))(1)
    clamp = fem.dirichletbc(fem.Function(space), fem.locate_dofs_topological(space, 1, left))
    return _half_work(assemble_matrix(fem.form(form), [clamp]), assemble_vector(fem.form(-FORCE * v[1] * ds)), clamp)


def _half_work(matrix: PETSc.Mat, load: PETSc.Vec, clamp: Any) -> float:
    matrix.assemble()
    clamp.set(load.array_w)
    ksp, x = PETSc.KSP().create(), load.duplicate()
    ksp.setOperators(matrix)
    ksp.setType("preonly")
    ksp.getPC().setType("lu")
    ksp.getPC().setFactorSolverType("mumps")
    ksp.solve(load, x)
    return -0.5 * float(load.dot(x))


def test_no_locking_beside_quadratic_elements() -> None:
    truth = plain_energy(48, degree=2)
    errors = [abs(energy(n) / truth - 1) for n in (16, 32)]
    assert errors[0] < 0.06
    assert errors[1] < 0.6 * errors[0]
    assert abs(plain_energy(32, degree=1) / truth - 1) > 0.35  # what would be certified without it


def test_plain_p1_is_kept_where_it_does_not_lock() -> None:
    assert not solve(scene(4, 0.3)).problem.bulk.averaged
    assert solve(scene(4, 0.46)).problem.bulk.averaged


@pytest.mark.parametrize("load", [1.0, 3.0])
def test_a_uniform_stress_is_reproduced(load: float) -> None:
    """Patch test: a body between a wall and a floor, pressed on top; plane strain, u1 = 0 on both sides."""
    nu = 0.49
    tables = scene(5, nu).tables()
    tables["boundary"] = {
        "walls": {"on": ["left", "right"], "displacement": [0.0, "free"]},
        "floor": {"on": "bottom", "contact": {"gap": 0.0}},
        "press": {"on": "top", "traction": [0.0, -load]},
    }
    solution = solve(read_tables(tables))
    stiffness = (1 - nu) / ((1 + nu) * (1 - 2 * nu))
    assert solution.converged
    assert solution.examination is not None
    assert solution.examination.energy * solution.problem.scales.energy == pytest.approx(
        -(load**2) / stiffness / 2, rel=1e-9
    )
