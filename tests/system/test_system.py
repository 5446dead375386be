"""The discrete equations against their own energy: residual and tangent by finite differences, boundary terms by sums.

A wrong derivative still converges, only slowly or to the wrong branch; so it is looked for here, not in a solution.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import ufl
from dolfinx import fem
from petsc4py import PETSc
from scenes import DELTA, NU, E, P, Q, Table, energy, model, quadratic_linear, solved

from hvi_fenicsx import Superpotential, prepare, read_tables
from hvi_fenicsx.workflow import Preparation

Array = npt.NDArray[np.float64]
STRONG = quadratic_linear(3e6)
SMOOTHED: dict[str, Table] = {
    "paper": {"smoothing": "paper", "epsilon_absolute": 2.0},
    "quadratic": {"smoothing": "quadratic", "epsilon": 0.5},
    "chks": {"smoothing": "chks", "epsilon": 0.1},
    "log_exp": {"smoothing": "log_exp", "epsilon": 0.1},
}


@dataclass(frozen=True)
class Smooth:
    """A smooth law as it stands: j, j', j''."""

    law: Superpotential

    def value(self, x: Array) -> Array:
        return self.law.value(x)

    def derivative(self, x: Array) -> Array:
        return (self.law.left(x) + self.law.right(x)) / 2

    def second(self, x: Array) -> Array:
        return self.law.convex.second(x) - self.law.concave.second(x)


def ready(table: Table) -> Preparation:
    return prepare(read_tables(table))


def random_state(prepared: Preparation, seed: int = 1) -> PETSc.Vec:
    """Slips on all pieces of the law, and between them."""
    x = prepared.system.load.duplicate()
    x.array[:] = (
        1.2 * DELTA / prepared.problem.scales.displacement * np.random.default_rng(seed).normal(size=x.local_size)
    )
    return x


def residual(prepared: Preparation, x: PETSc.Vec, models: list[Any]) -> Array:
    out = prepared.system.load.duplicate()
    prepared.system.equations.residual(x, out, models)
    found: Array = out.array_r.copy()
    return found


def moved(x: PETSc.Vec, step: Array) -> PETSc.Vec:
    y = x.copy()
    y.array[:] += step
    return y


def free(prepared: Preparation) -> npt.NDArray[np.bool_]:
    return ~np.isin(np.arange(prepared.system.load.local_size), prepared.problem.fixed)


@pytest.mark.parametrize("name", SMOOTHED)
def test_the_residual_is_the_gradient_of_the_energy(name: str) -> None:
    prepared = ready(model(4, 3e6, 1e6, STRONG, **SMOOTHED[name]))
    models = [Smooth(t.law) for t in prepared.system.terms]
    x, h = random_state(prepared), 1e-5
    r, size = residual(prepared, x, models), x.local_size
    for i in np.flatnonzero(free(prepared)):
        step = h * np.eye(1, size, i).ravel()
        up, down = (prepared.system.equations.energy(moved(x, s * step), models) for s in (1, -1))
        assert (up - down) / (2 * h) == pytest.approx(r[i], abs=1e-6 * np.max(np.abs(r)))


@pytest.mark.parametrize("name", SMOOTHED)
def test_the_matrix_is_the_derivative_of_the_residual(name: str) -> None:
    """Along random directions; after two changes of tangent, so that an update in place shows."""
    prepared = ready(model(4, 3e6, 1e6, STRONG, **SMOOTHED[name]))
    system = prepared.system
    models = [Smooth(t.law) for t in system.terms]
    system.jacobian.set_rates(system.equations.tangents(random_state(prepared, 5), models))
    x, h = random_state(prepared), 1e-7
    system.jacobian.set_rates(system.equations.tangents(x, models))
    for seed in range(5):
        direction = np.random.default_rng(seed).normal(size=x.local_size) * free(prepared)
        product = system.jacobian.matrix * moved(0.0 * x, direction)
        difference = residual(prepared, moved(x, h * direction), models) - residual(
            prepared, moved(x, -h * direction), models
        )
        np.testing.assert_allclose(difference / (2 * h), product.array_r, atol=2e-6 * np.max(np.abs(product.array_r)))


def test_the_boundary_term_is_the_sum_of_nodal_tractions() -> None:
    """∫ τ·v ds by vertex quadrature is w j'(u_t) at each vertex, w the trapezoidal weight of the floor."""
    prepared = ready(model(5, 3e6, 1e6, STRONG))
    x = random_state(prepared)

    class Nothing:
        def value(self, x: Array) -> Array:
            return 0.0 * x

        derivative = second = value

    (term,) = prepared.system.terms
    difference = residual(prepared, x, [Smooth(term.law)]) - residual(prepared, x, [Nothing()])
    points = prepared.problem.space.tabulate_dof_coordinates()
    wanted = np.zeros((len(points), 2))
    for i in np.flatnonzero((points[:, 1] == 0) & (points[:, 0] > 0)):  # the wall holds the corner's slip
        slip = x.array_r[2 * i] * prepared.problem.scales.displacement
        weight = 0.1 if points[i, 0] == 1 else 0.2
        traction = slip / DELTA * 3e6 if abs(slip) < DELTA else np.sign(slip) * 1.5e6
        wanted[i, 0] = weight * traction / prepared.problem.scales.stress
    np.testing.assert_allclose(difference, wanted.ravel(), atol=1e-12)


def test_weights_in_space_add_up_to_the_area() -> None:
    table: Table = {
        "domain": {"shape": "box", "size": [2.0, 1.0, 0.5], "cells": [4, 2, 2]},
        "material": {"model": "three_dimensional", "youngs_modulus": E, "poisson_ratio": NU},
        "boundary": {name: {"on": name, "contact": {"gap": 0.0}} for name in ("bottom", "front")},
    }
    bottom, front = ready(table).problem.surfaces
    assert np.sum(bottom.weights) * 4.0 == pytest.approx(2.0, rel=1e-14)
    assert np.sum(front.weights) * 4.0 == pytest.approx(1.0, rel=1e-14)
    np.testing.assert_array_equal(bottom.normals, [[0, 0, -1]] * len(bottom.normals))
    np.testing.assert_array_equal(front.normals, [[0, -1, 0]] * len(front.normals))
    for surface in (bottom, front):  # t2 = n x t1, t1 the projected x-axis
        np.testing.assert_array_equal(surface.tangents[:, 0], [[1, 0, 0]] * len(surface.normals))
        np.testing.assert_array_equal(surface.tangents[:, 1], np.cross(surface.normals, surface.tangents[:, 0]))


LAWS: dict[str, Table] = {
    "quadratic_linear": STRONG,
    "stronger": quadratic_linear(1e7),
    "tresca": {"law": "tresca", "yield_traction": 7e5},
    "sawtooth": {"law": "graph", "points": [[0, 0], [4e-6, 8e5], [4e-6, 3e5], [9e-6, 9e5], [9e-6, 2e5]]},
    "falling": {"law": "graph", "points": [[0, 0], [4e-6, 2e6], [2e-5, 2e5]]},
}


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize(("pull", "press"), [(3e6, 1e6), (6e6, 1e5)])
def test_the_energy_falls_in_every_convex_step(law: str, pull: float, press: float) -> None:
    found = solved(model(8, pull, press, LAWS[law]))
    assert found.exit_code == 0
    assert found.solve_result is not None
    energies = np.array(found.solve_result.energies)
    assert len(energies) == found.solve_result.counts.branch >= 1
    assert np.all(np.diff(energies) <= 1e-10 * np.abs(energies[:-1]))


def by_ufl(u: fem.Function, pull: float, gamma1: float) -> float:
    """Energy, J/m, of a displacement in m: the paper's formulas in UFL, in SI, the law by its printed minimum."""
    mesh = u.function_space.mesh
    n, e = ufl.FacetNormal(mesh), ufl.sym(ufl.grad(u))
    sigma = E / (1 - NU**2) * ((1 - NU) * e + NU * ufl.tr(e) * ufl.Identity(2))
    right, top = (ufl.conditional(ufl.gt(n[i], 0.5), 1.0, 0.0) for i in (0, 1))
    floor = ufl.conditional(ufl.lt(n[1], -0.5), 1.0, 0.0)
    j = ufl.min_value(gamma1 / (2 * DELTA) * u[0] ** 2, gamma1 / 2 * abs(u[0]))
    vertex = ufl.ds(metadata={"quadrature_rule": "vertex", "quadrature_degree": 1})
    # one by one: in a sum, ds without and with a vertex rule are integrated by one rule
    terms = (ufl.inner(sigma, e) / 2 * ufl.dx, (top * Q * u[1] - right * pull * u[0]) * ufl.ds, floor * j * vertex)
    return sum(float(fem.assemble_scalar(fem.form(term))) for term in terms)


@pytest.mark.parametrize(("pull", "gamma1"), [(P, 1e3), (3e6, 1e6), (6e6, 3e6)])
def test_the_certified_energy_is_that_of_the_papers_formulas(pull: float, gamma1: float) -> None:
    found = solved(model(8, pull, Q, quadratic_linear(gamma1)))
    assert found.solve_result is not None
    u = fem.Function(found.problem.space)
    u.x.array[:] = found.solve_result.u.x.array * found.problem.scales.displacement
    assert energy(found) == pytest.approx(by_ufl(u, pull, gamma1), rel=1e-12)
