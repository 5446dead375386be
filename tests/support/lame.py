"""What the hollow bodies of Lamé share: material, pressure, and the errors of a solution against a closed form."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import ufl
from dolfinx import fem

import hvi_fenicsx as hvi
from hvi_fenicsx.typing import Array

E, NU, P = 1e7, 0.3, 1e5
BULK, SHEAR = E / (3 * (1 - 2 * NU)), E / (2 * (1 + NU))


@dataclass(frozen=True, kw_only=True)
class Errors:
    """Relative errors: in the energy norm, as it is estimated, of the energy, the worst nodal displacement, stress."""

    unknowns: int
    norm: float
    estimated: float
    energy: float
    nodal: float
    stress: float

    def __str__(self) -> str:
        return (
            f"{self.unknowns} unknowns: energy norm {self.norm:.2e}, estimated {self.estimated:.2e} (index "
            f"{self.estimated / self.norm:.2f}), energy {self.energy:.1e}, largest nodal error {self.nodal:.1e}, "
            f"stress in the mean square {self.stress:.2e}"
        )


def nodal(found: hvi.Solution) -> tuple[Array, Array]:
    """Places (n, d) and displacements (n, d) of the local nodes, m."""
    d = found.problem.scales.dimension
    return found.u.function_space.tabulate_dof_coordinates()[:, :d], found.u.x.array.reshape(-1, d)


def errors(found: hvi.Solution, radial: Callable[[Any], Any]) -> Errors:
    """The errors of a solution under pressure inside, at the radius 1.

    Args:
        found: of a quarter of a ring, or of an eighth of a ball: the pressure acts on π/2 in both.
        radial: the displacement over the radius.
    """
    x, u = nodal(found)
    r = np.linalg.norm(x, axis=1, keepdims=True)
    away = u - radial(r) * x / r
    place = ufl.SpatialCoordinate(found.problem.space.mesh)
    radius = ufl.sqrt(ufl.dot(place, place))
    assert found.estimate is not None
    exact = radial(radius) / radius * place
    return Errors(
        unknowns=found.dofs,
        norm=energy_error(found, exact),
        estimated=found.estimate.relative,
        energy=float(found.energy / (-0.25 * np.pi * P * radial(1.0)) - 1),
        nodal=float(np.abs(away).max() / radial(1.0)),
        stress=stress_error(found, exact),
    )


def energy_error(found: hvi.Solution, exact: Any) -> float:
    """The relative error in the energy norm, integrated; the displacement is given as a UFL expression."""
    return float(np.sqrt(_energy(found.u - exact) / _energy(exact)))


def stress_error(found: hvi.Solution, exact: Any) -> float:
    """The relative error of the stress in the mean square; the displacement is given as a UFL expression."""
    sigma = _stress(exact)
    away = found.stress - sigma
    return float(np.sqrt(_integral(ufl.inner(away, away)) / _integral(ufl.inner(sigma, sigma))))


def _stress(v: Any) -> Any:
    """Of a body in space or in plane strain, (3, 3)."""
    gradient, d = ufl.grad(v), len(v)
    whole = ufl.as_matrix([[gradient[i, j] if max(i, j) < d else 0.0 for j in range(3)] for i in range(3)])
    strain = ufl.sym(whole)
    return 2 * SHEAR * strain + (BULK - 2 * SHEAR / 3) * ufl.tr(strain) * ufl.Identity(3)


def _energy(v: Any) -> float:
    strain = ufl.sym(ufl.grad(v))
    return _integral(2 * SHEAR * ufl.inner(strain, strain) + (BULK - 2 * SHEAR / 3) * ufl.tr(strain) ** 2)


def _integral(density: Any) -> float:
    return float(fem.assemble_scalar(fem.form(density * ufl.dx(metadata={"quadrature_degree": 8}))))
