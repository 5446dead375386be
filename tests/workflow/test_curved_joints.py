"""Two bodies that meet at a curve, at degree 2: closed forms of rings, uniform stresses, balance, ranks, adaptivity.

Cells have curved edges on both sides. Sides that stay polygons leave room between them or overlap, and the pressure
turns with the facets: all bounds here fail on them by a factor of ten or more.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import lame
import numpy as np
import pytest
import rings
import ufl
from dolfinx import fem
from lame import NU, E, P
from rings import RINGS
from runs import LONG_RANKS, summary
from runs import hvi as command

import hvi_fenicsx as hvi
from hvi_fenicsx import laws

HELD = [hvi.Displacement("bottom", [0.0, 0.0]), hvi.Displacement("left", [0.0, 0.0])]
SYMMETRY = [hvi.Displacement("bottom", [None, 0.0]), hvi.Displacement("left", [0.0, None])]
MATERIAL = hvi.Isotropic(youngs_modulus=E, poisson_ratio=NU, model="plane_strain", thermal_expansion=1e-2)


def body(folder: Path, size: float, other: float, *, exchanged: bool = False) -> hvi.Body:
    file = folder / "rings.geo"
    file.write_text(RINGS.format(size=size, other=other, order=2))
    return hvi.Body.file(file).interface("fit", *(("around", "within") if exchanged else ("within", "around")))


@pytest.mark.parametrize("ratio", [1.0, 0.7])
def test_two_rings_under_pressure_converge_as_one_body(ratio: float) -> None:
    coarse, fine = (
        rings.errors(rings.solved(RINGS.format(size=size, other=ratio * size, order=2), hvi.Contact("fit")))
        for size in (1 / 4, 1 / 8)
    )
    finer = np.sqrt(fine.unknowns / coarse.unknowns)
    assert coarse.norm / fine.norm > finer**1.7
    assert coarse.nodal / fine.nodal > finer**2.1
    assert coarse.energy / fine.energy > finer**3.4
    assert abs(fine.energy) < 1.2e-5
    for found in (coarse, fine):
        assert found.estimated == pytest.approx(found.norm, rel=0.05)


@pytest.mark.parametrize("exchanged", [False, True])
def test_a_uniform_pressure_passes_a_curve_exactly_where_meshes_match(exchanged: bool, tmp_path: Path) -> None:
    """Of rings that are heated between walls; the pressure is the same everywhere. Gmsh spaces nodes evenly to 1e-9."""
    rigid = [hvi.Contact("outer"), hvi.Contact("inner"), hvi.Contact("fit"), hvi.Temperature(1.0)]
    found = hvi.solve(
        hvi.Model(body(tmp_path, 0.5, 0.5, exchanged=exchanged), [MATERIAL, *HELD, *rigid]), degree=2, estimate=False
    )
    assert found.certificate.passed
    part = found.contact["fit"]
    inside = np.all(part.x > 1e-6, axis=1)
    np.testing.assert_allclose(part.pressure[inside], E / (1 - 2 * NU) * 1e-2, rtol=1e-9)


def test_a_uniform_stress_has_little_estimated_error(tmp_path: Path) -> None:
    """What is left is that of the ends, whose share is carried by neighbours with other normals."""
    loads = [hvi.Pressure("inner", P), hvi.Pressure("outer", P), hvi.Contact("fit")]
    coarse, fine = (
        hvi.solve(hvi.Model(body(tmp_path, size, 0.7 * size), [MATERIAL, *SYMMETRY, *loads]), degree=2).estimate
        for size in (0.5, 0.25)
    )
    assert coarse is not None
    assert fine is not None
    assert fine.relative < 2e-3
    assert fine.relative < 0.5 * coarse.relative


@pytest.mark.parametrize("exchanged", [False, True])
def test_a_shrink_fit_has_the_pressure_of_lame(exchanged: bool, tmp_path: Path) -> None:
    """Rings that overlap by d before they are put together, on meshes that do not match."""
    a, b, c, d = 1.0, 1.5, 2.0, 1e-3
    wanted = d * E / (1 - NU**2) / b / ((c**2 + b**2) / (c**2 - b**2) + (b**2 + a**2) / (b**2 - a**2))
    away = []
    for size in (1 / 8, 1 / 16):
        made = body(tmp_path, size, 0.7 * size, exchanged=exchanged)
        found = hvi.solve(hvi.Model(made, [MATERIAL, *SYMMETRY, hvi.Contact("fit", gap=-d)]), degree=2, estimate=False)
        assert found.certificate.passed
        one, other = found.resultant("fit"), found.resultant("fit.second")
        np.testing.assert_allclose(one, -np.asarray(other), rtol=1e-12)
        part = found.contact["fit"]
        inside = np.all(part.x > 0.1, axis=1)
        away.append(float(np.abs(part.pressure[inside] / wanted - 1).max()))
        assert part.pressure[inside].mean() == pytest.approx(wanted, rel=0.01 * size)
    assert away[1] < 4e-3
    assert away[1] < 0.6 * away[0]


TURN, GLUE = 1e-3, 2e7
TWISTED = [
    hvi.Displacement("bottom", [0.0, None]),
    hvi.Displacement("left", [None, 0.0]),
    hvi.Displacement("inner", [f"-{TURN}*y", f"{TURN}*x"]),
]
"""The inside of a quarter of a ring is turned; the sign of the tangent in files changes at 45 degrees."""


def glued(name: str) -> hvi.Friction:
    return hvi.Friction(name, laws.Graph(points=((0.0, 0.0), (1.0, GLUE))))


def around(found: hvi.Solution, along: Callable[[Any], Any]) -> Any:
    """A displacement along the circles."""
    x = ufl.SpatialCoordinate(found.problem.space.mesh)
    r = ufl.sqrt(ufl.dot(x, x))
    return along(r) * ufl.as_vector([-x[1], x[0]]) / r


def test_a_law_in_a_twisted_joint_slips_as_in_closed_form_and_the_estimate_is_the_error(tmp_path: Path) -> None:
    """The outer ring is held outside; the traction k slip is 2 G B/b²."""
    b, shear = 1.5, E / (2 * (1 + NU))
    B = GLUE * TURN * b**3 / (2 * shear + 0.75 * GLUE * b**3)
    away = []
    for size in (1 / 4, 1 / 8):
        made, held = body(tmp_path, size, 0.7 * size), hvi.Displacement("outer", [0.0, 0.0])
        found = hvi.solve(hvi.Model(made, [MATERIAL, *TWISTED, held, glued("fit")]), degree=2)
        assert found.certificate.passed
        x, u = lame.nodal(found)
        r = np.linalg.norm(x, axis=1)
        turned = (u[:, 1] * x[:, 0] - u[:, 0] * x[:, 1]) / r
        exact = np.where(r < b, (TURN - B) * r, -B / 4 * r) + B / r
        off = np.abs(r - b) > 1e-9  # nodes of both bodies are there
        away.append(float(np.abs(turned - exact)[off].max()) / TURN)
        inside = fem.Function(fem.functionspace(found.problem.space.mesh, ("DG", 0)))
        inside.interpolate(lambda x: np.hypot(x[0], x[1]) < b)
        wanted = around(found, lambda r, on=inside: ufl.conditional(on > 0.5, (TURN - B) * r, -B / 4 * r) + B / r)
        assert found.estimate is not None
        assert found.estimate.relative == pytest.approx(lame.energy_error(found, wanted), rel=0.06)
    assert away[1] < 2e-4
    assert away[1] < 0.25 * away[0]


@pytest.mark.parametrize("ranks", LONG_RANKS[1:])
def test_curved_joints_are_the_same_on_ranks(ranks: int, tmp_path: Path) -> None:
    file = tmp_path / "rings.geo"
    file.write_text(RINGS.format(size=0.25, other=0.2, order=2))
    found = []
    for number in (1, ranks):
        out = tmp_path / str(number)
        done = command("run", scene(tmp_path, file), "--out", out, "--no-pictures", ranks=number)
        assert done.returncode == 0
        found.append([summary(out)["energy"], summary(out)["estimate"]["relative"]])
    assert found[1] == pytest.approx(found[0], rel=1e-7)


def scene(folder: Path, file: Path) -> Path:
    lines = [
        f'[domain]\nshape = "file"\nfile = "{file}"',
        f'[material]\nmodel = "plane_strain"\nyoungs_modulus = {E}\npoisson_ratio = {NU}',
        '[boundary.bottom]\non = "bottom"\ndisplacement = ["free", 0.0]',
        '[boundary.left]\non = "left"\ndisplacement = [0.0, "free"]',
        f'[boundary.inner]\non = "inner"\npressure = {P}',
        '[interface.fit]\nbetween = ["within", "around"]\ncontact = { gap = 0.0 }',
        "[solver]\ndegree = 2",
    ]
    path = folder / "rings.toml"
    path.write_text("\n".join(lines))
    return path
