"""Lamé's thick wall of one body and of two in contact, and the errors of solutions.

A quarter of a ring, radii 1 and 2 m, under pressure inside; the two bodies meet at 1.5 m. The error in the energy norm
is integrated: that of the energy has another order where polygons take the place of curves, since the body is another.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import lame
from lame import NU, E, Errors, P

import hvi_fenicsx as hvi

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


def displacement(r: Any) -> Any:
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
    """The errors of a solution under pressure."""
    return lame.errors(found, displacement)
