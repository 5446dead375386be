"""Lamé's thick wall at degree 2, of one body and of two in contact: errors with curved cells and with straight ones.

    ./hvi exec python3 benchmarks/rings.py

A quarter of a ring, radii 1 and 2 m, under pressure inside; the two bodies meet at 1.5 m. The error in the energy norm
is integrated: that of the energy has another order where polygons take the place of curves, since the body is another.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import ufl
from dolfinx import fem

import hvi_fenicsx as hvi
from hvi_fenicsx.problem import spaces

RING = """
h = {size};
Point(1) = {{0, 0, 0, h}};
Point(2) = {{1, 0, 0, h}}; Point(3) = {{2, 0, 0, h}}; Point(4) = {{0, 2, 0, h}}; Point(5) = {{0, 1, 0, h}};
Line(1) = {{2, 3}}; Circle(2) = {{3, 1, 4}}; Line(3) = {{4, 5}}; Circle(4) = {{5, 1, 2}};
Curve Loop(1) = {{1, 2, 3, 4}}; Plane Surface(1) = {{1}};
Physical Curve("bottom") = {{1}}; Physical Curve("left") = {{3}}; Physical Curve("inner") = {{4}};
Physical Curve("outer") = {{2}}; Physical Surface("body") = {{1}};
Mesh.ElementOrder = {order};
"""
"""A quarter of a ring, radii 1 and 2."""
RINGS = """
h = {size}; k = {other};
Point(1) = {{0, 0, 0, h}};
Point(2) = {{1, 0, 0, h}}; Point(3) = {{1.5, 0, 0, h}}; Point(4) = {{0, 1.5, 0, h}}; Point(5) = {{0, 1, 0, h}};
Point(6) = {{1.5, 0, 0, k}}; Point(7) = {{2, 0, 0, k}}; Point(8) = {{0, 2, 0, k}}; Point(9) = {{0, 1.5, 0, k}};
Line(1) = {{2, 3}}; Circle(2) = {{3, 1, 4}}; Line(3) = {{4, 5}}; Circle(4) = {{5, 1, 2}};
Line(5) = {{6, 7}}; Circle(6) = {{7, 1, 8}}; Line(7) = {{8, 9}}; Circle(8) = {{9, 1, 6}};
Curve Loop(1) = {{1, 2, 3, 4}}; Plane Surface(1) = {{1}};
Curve Loop(2) = {{5, 6, 7, 8}}; Plane Surface(2) = {{2}};
Physical Curve("bottom") = {{1, 5}}; Physical Curve("left") = {{3, 7}}; Physical Curve("inner") = {{4}};
Physical Curve("outer") = {{6}}; Physical Curve("within") = {{2}}; Physical Curve("around") = {{8}};
Physical Surface("first") = {{1}}; Physical Surface("second") = {{2}};
Mesh.ElementOrder = {order};
"""
"""The same of two bodies, which meet at 1.5; their cells may be of different sizes."""
E, NU, P = 1e7, 0.3, 1e5


@dataclass(frozen=True, kw_only=True)
class Errors:
    """Relative errors: in the energy norm, as it is estimated, of the energy, and of the largest nodal displacement."""

    unknowns: int
    norm: float
    estimated: float
    energy: float
    nodal: float

    def __str__(self) -> str:
        return (
            f"{self.unknowns} unknowns: energy norm {self.norm:.2e}, estimated {self.estimated:.2e} (index "
            f"{self.estimated / self.norm:.2f}), energy {self.energy:.1e}, largest nodal error {self.nodal:.1e}"
        )


def lame(r: Any) -> Any:
    """The radial displacement under pressure inside (Lamé)."""
    return (1 + NU) / E * P / 3 * ((1 - 2 * NU) * r + 4 / r)


def solved(script: str, *effects: Any) -> hvi.Solution:
    """The solution of degree 2 on gmsh's mesh of a script; with an interface ``fit`` where there are two bodies."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "ring.geo"
        file.write_text(script)
        body = hvi.Body.file(file)
        if "within" in body.sides:
            body = body.interface("fit", "within", "around")
    material = hvi.Isotropic(youngs_modulus=E, poisson_ratio=NU, model="plane_strain")
    symmetry = [hvi.Displacement("bottom", [None, 0.0]), hvi.Displacement("left", [0.0, None])]
    return hvi.solve(hvi.Model(body, [material, *symmetry, hvi.Pressure("inner", P), *effects]), degree=2)


def errors(found: hvi.Solution) -> Errors:
    """The errors of a solution."""
    x = found.problem.positions[:, :2]
    r = np.linalg.norm(x, axis=1, keepdims=True)
    away = spaces.values(found.problem.space, found.u.x.array) - lame(r) * x / r
    place = ufl.SpatialCoordinate(found.problem.space.mesh)
    radius = ufl.sqrt(ufl.dot(place, place))
    assert found.estimate is not None
    return Errors(
        unknowns=found.dofs,
        norm=energy_error(found, lame(radius) / radius * place),
        estimated=found.estimate.relative,
        energy=float(found.energy / (-0.25 * np.pi * P * lame(1.0)) - 1),
        nodal=float(np.abs(away).max() / lame(1.0)),
    )


def energy_error(found: hvi.Solution, exact: Any) -> float:
    """The relative error in the energy norm, integrated; the displacement is given as a UFL expression."""
    return float(np.sqrt(_energy(found.u - exact) / _energy(exact)))


def _energy(v: Any) -> float:
    strain, shear = ufl.sym(ufl.grad(v)), E / (1 + NU)
    density = shear * (ufl.inner(strain, strain) + NU / (1 - 2 * NU) * ufl.tr(strain) ** 2)
    return float(fem.assemble_scalar(fem.form(density * ufl.dx(metadata={"quadrature_degree": 8}))))


def table(cells: Sequence[int]) -> None:
    """All errors on meshes of so many cells across the wall."""
    for order in (2, 1):
        for name, other in (("one body", None), ("two bodies, matching", 1.0), ("two bodies, not matching", 0.7)):
            for n in cells:
                if other is None:
                    found = solved(RING.format(size=1 / n, order=order))
                else:
                    found = solved(RINGS.format(size=1 / n, other=other / n, order=order), hvi.Contact("fit"))
                print(f"{name}, file of order {order}, {errors(found)}", flush=True)


if __name__ == "__main__":
    table((2, 4, 8, 16))
