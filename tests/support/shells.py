"""Lamé's hollow ball of two bodies in contact, and the errors of solutions.

An eighth of a ball, radii 1 and 2 m, under pressure inside; the two bodies meet at 1.5 m. The error in the energy norm
is integrated over the bodies as they are meshed.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import lame
from lame import BULK, NU, SHEAR, E, Errors, P

import hvi_fenicsx as hvi

SHELLS = """
SetFactory("OpenCASCADE");
Sphere(1) = {{0, 0, 0, 1, 0, Pi/2, Pi/2}}; Sphere(2) = {{0, 0, 0, 1.5, 0, Pi/2, Pi/2}};
Sphere(3) = {{0, 0, 0, 1.5, 0, Pi/2, Pi/2}}; Sphere(4) = {{0, 0, 0, 2, 0, Pi/2, Pi/2}};
BooleanDifference(5) = {{ Volume{{2}}; Delete; }}{{ Volume{{1}}; Delete; }};
BooleanDifference(6) = {{ Volume{{4}}; Delete; }}{{ Volume{{3}}; Delete; }};
Physical Volume("first") = {{5}}; Physical Volume("second") = {{6}};
Physical Surface("within") = {{17}}; Physical Surface("around") = {{26}}; Physical Surface("inner") = {{21}};
Physical Surface("outer") = {{22}}; Physical Surface("left") = {{18, 23}}; Physical Surface("bottom") = {{19, 24}};
Physical Surface("front") = {{20, 25}};
MeshSize{{ PointsOf{{ Volume{{5}}; }} }} = {size}; MeshSize{{ PointsOf{{ Volume{{6}}; }} }} = {other};
{matching}
Mesh.ElementOrder = {order};
"""
"""An eighth of a hollow ball of two bodies, with cells of different sizes; of equal sizes the meshes match."""
FLAT = ("left", "front", "bottom")


def displacement(r: Any) -> Any:
    """The radial displacement under pressure inside (Lamé)."""
    return P / 7 * (r / (3 * BULK) + 8 / (4 * SHEAR * r**2))


def script(size: float, other: float) -> str:
    """The bodies for gmsh.

    Args:
        size: of the cells of the first body, m.
        other: of those of the second; where it is the same and the bodies meet, the meshes match.
    """
    matching = "Periodic Surface {26} = {17} Translate {0, 0, 0};" if size == other else ""
    return SHELLS.format(size=size, other=other, order=2, matching=matching)


def bodies(size: float, other: float) -> hvi.Body:
    """The bodies with the interface ``fit``.

    Args:
        size: of the cells of the first body, m.
        other: of those of the second.
        order: of the mesh.
        apart: the distance between the bodies, m.
    """
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "shells.geo"
        file.write_text(script(size, other))
        return hvi.Body.file(file, dimension=3).interface("fit", "within", "around")


def material(expansion: float = 0.0) -> hvi.Isotropic:
    """The material of both bodies."""
    return hvi.Isotropic(youngs_modulus=E, poisson_ratio=NU, model="three_dimensional", thermal_expansion=expansion)


def symmetry() -> list[hvi.Displacement]:
    """The planes of symmetry are held along their normals."""
    return [hvi.Displacement(name, [0.0 if i == axis else None for i in range(3)]) for axis, name in enumerate(FLAT)]


def under_pressure(body: hvi.Body) -> hvi.Solution:
    """The solution of degree 2 with pressure inside."""
    effects = [material(), *symmetry(), hvi.Pressure("inner", P), hvi.Contact("fit")]
    return hvi.solve(hvi.Model(body, effects), degree=2)


def errors(found: hvi.Solution) -> Errors:
    """The errors of a solution under pressure."""
    return lame.errors(found, displacement)
