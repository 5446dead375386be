"""Bodies that meet on a mesh of one's own: an interface between two tagged sides does what that of a scene does."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from dolfinx import mesh
from mpi4py import MPI
from scenes import NU, E, two_blocks

import hvi_fenicsx as hvi
from hvi_fenicsx import compat

TAGS = {"base": 1, "seat": 2, "foot": 3, "press": 4, "push": 5}
LAW = hvi.laws.QuadraticLinear(gamma1=1e6, gamma2=5e5, delta=1e-6)


def two_block_body() -> hvi.Body:
    """The blocks of :func:`scenes.two_blocks` as one mesh of two parts, its sides tagged."""
    kind = mesh.DiagonalType.right
    corners = [((0.0, 0.0), (1.0, 0.5)), ((0.21, 0.5), (1.21, 0.9))]
    parts = [
        mesh.create_rectangle(MPI.COMM_SELF, corner, cells, diagonal=kind)
        for corner, cells in zip(corners, ([9, 4], [7, 3]), strict=True)
    ]
    points = [part.geometry.x[:, :2] for part in parts]
    cells = [compat.geometry_dofmap(parts[0]), compat.geometry_dofmap(parts[1]) + len(points[0])]
    whole = compat.simplex_mesh(MPI.COMM_SELF, np.vstack(cells).astype(np.int64), np.vstack(points), "triangle")
    whole.topology.create_connectivity(1, 2)
    outer, of_facet = mesh.exterior_facet_indices(whole.topology), whole.topology.connectivity(1, 2)
    x, y = mesh.compute_midpoints(whole, 1, outer)[:, :2].T
    inner = mesh.compute_midpoints(whole, 2, of_facet.array[of_facet.offsets[outer]])[:, 1]
    level, inside = np.isclose(y, 0.5), inner < 0.5
    marks = {1: np.isclose(y, 0.0), 2: level & inside, 3: level & ~inside, 4: np.isclose(y, 0.9)}
    marks[5] = np.isclose(x, 0.21)
    values = sum(tag * mark.astype(np.int32) for tag, mark in marks.items())
    tags = mesh.meshtags(whole, 1, outer[values > 0], values[values > 0].astype(np.int32))
    return hvi.Body(whole, facets=tags, names=TAGS)


LOADS = [
    hvi.Isotropic(youngs_modulus=E, poisson_ratio=NU),
    hvi.Displacement("base", [0.0, 0.0]),
    hvi.Traction("press", [0.0, "-1e6*(2.4 - 2.6*x)"]),
    hvi.Traction("push", [6e5, 0.0]),
]


def test_an_interface_between_tagged_sides_is_that_of_a_scene() -> None:
    body = two_block_body().interface("seam", "foot", "seat")
    model = hvi.Model(body, [*LOADS, hvi.Contact("seam"), hvi.Friction("seam", LAW)])
    found = hvi.solve(model, tolerance=1e-10)
    table = two_blocks("rectangle", [1.0], [[9, 4], [7, 3]], "plane_stress", tolerance=1e-10)
    same = hvi.solve(hvi.read_tables(table), MPI.COMM_SELF)
    assert found.converged
    assert found.energy == pytest.approx(same.energy, rel=1e-9)
    assert found.contact["seam"].pressure == pytest.approx(same.contact["seam"].pressure, rel=1e-6, abs=1.0)
    assert found.resultant("seam") == pytest.approx(-found.resultant("seam.second"), rel=1e-9)


class Fading(hvi.laws.SampledLaw):
    """A law of a user's own: a parabola, then an exponential tail."""

    name = "fading_of_the_tests"

    def traction(self, x: Any) -> Any:
        z = x / 2e-6
        return 1.2e6 * np.where(z < 1, z * (2 - z), np.exp(1 - z))

    def ends(self) -> tuple[float, ...]:
        return 2e-6, 60e-6


LAWS = [
    LAW,
    hvi.laws.QuadraticLinearLiteral(gamma1=2e6, gamma2=1e6, delta=1e-6),
    hvi.laws.Tresca(3.2e5),
    hvi.laws.LinearSpring(1e12),
    hvi.laws.Sawtooth(1e6, 6e5, 5e-7, 3),
    hvi.laws.Exponential(4.5e5, 4e5, 2e-6),
    hvi.laws.Graph(points=((0.0, 0.0), (1e-6, 1.2e6), (8e-6, 4e5))),
    Fading(),
]


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.name)
def test_each_law_acts_on_an_interface(law: hvi.laws.Superpotential) -> None:
    """The traction that balances the bodies is that of the law at the relative slip, or between its limits there."""
    body = two_block_body().interface("seam", "foot", "seat")
    found = hvi.solve(hvi.Model(body, [*LOADS, hvi.Contact("seam"), hvi.Friction("seam", law)]))
    assert found.converged
    seam = found.contact["seam"]
    slip = np.ravel(seam.slip)
    below, above = (law.left(slip + step) for step in (-1e-13, 1e-13))
    low, high = np.minimum(below, above), np.maximum(below, above)
    assert np.abs(seam.friction).max() > 1e5
    assert np.all(np.ravel(seam.friction) >= low - 10.0)
    assert np.all(np.ravel(seam.friction) <= high + 10.0)


@pytest.mark.parametrize(
    ("first", "second", "effects", "words"),
    [
        ("foot", "sole", [], "sole"),
        ("foot", "seat", [], "nothing acts"),
        ("foot", "base", [hvi.Contact("seam")], "do not face each other"),
        ("foot", "seat", [hvi.Contact("seam"), hvi.Contact("seam")], "give it once"),
    ],
)
def test_what_does_not_fit_is_refused(first: str, second: str, effects: list[hvi.Contact], words: str) -> None:
    with pytest.raises(hvi.InputError, match=words):
        hvi.check(hvi.Model(two_block_body().interface("seam", first, second), [*LOADS, *effects]))


def halves() -> tuple[hvi.Body, hvi.Body]:
    """A block above the plane y = 0, and with it its mirror image: meshes, sides and numbers of vertices alike."""
    half = mesh.create_rectangle(MPI.COMM_SELF, ((0.0, 0.0), (1.0, 0.4)), (9, 4))
    points, cells = half.geometry.x[:, :2], compat.geometry_dofmap(half).astype(np.int64)
    every = np.vstack([cells, cells + len(points)]), np.vstack([points, points * [1.0, -1.0]])
    both = compat.simplex_mesh(MPI.COMM_SELF, *every, "triangle")
    return tagged_halves(half), tagged_halves(both).interface("seam", "foot", "seat")


def tagged_halves(whole: mesh.Mesh) -> hvi.Body:
    """Sides top and foot of the half above; of its mirror image top_ and seat."""
    whole.topology.create_connectivity(1, 2)
    outer, of_facet = mesh.exterior_facet_indices(whole.topology), whole.topology.connectivity(1, 2)
    y = mesh.compute_midpoints(whole, 1, outer)[:, 1]
    above = mesh.compute_midpoints(whole, 2, of_facet.array[of_facet.offsets[outer]])[:, 1] > 0.0
    top, flat = np.isclose(np.abs(y), 0.4), np.isclose(y, 0.0)
    places = {"top": top & above, "foot": flat & above, "top_": top & ~above, "seat": flat & ~above}
    names = {name: tag for tag, (name, here) in enumerate(places.items(), start=1) if here.any()}
    values = sum(tag * places[name].astype(np.int32) for name, tag in names.items())
    facets = mesh.meshtags(whole, 1, outer[values > 0], values[values > 0].astype(np.int32))
    return hvi.Body(whole, facets=facets, names=names)


BOND = [(0.0, 0.0), (1e-6, 1e6), (6e-6, 0.0)]


def twice(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """A graph of twice the displacement."""
    return [(2 * x, y) for x, y in points]


@pytest.mark.parametrize("mode", ["opening", "slip"])
def test_two_equal_bodies_are_one_by_symmetry(mode: str) -> None:
    """Opening, and contact: the law is stated in half of it. Slip: what is normal to the plane of symmetry is free."""
    half, both = halves()
    steel = hvi.Isotropic(youngs_modulus=E, poisson_ratio=NU)
    if mode == "opening":
        moved, mirrored = [0.0, "1.2e-5*(x - 0.4)"], [0.0, "-1.2e-5*(x - 0.4)"]
        own = [hvi.Contact("foot"), hvi.Adhesion("foot", hvi.laws.Graph(points=BOND, one_sided=True))]
        seam = [hvi.Contact("seam"), hvi.Adhesion("seam", hvi.laws.Graph(points=twice(BOND), one_sided=True))]
    else:
        moved, mirrored = ["9e-6*(0.3 + x)", 0.0], ["-9e-6*(0.3 + x)", 0.0]
        own = [hvi.Friction("foot", hvi.laws.Graph(points=BOND))]
        seam = [hvi.Friction("seam", hvi.laws.Graph(points=twice(BOND)))]
    shift = [hvi.Displacement("top", moved), hvi.Displacement("top_", mirrored)]
    one = hvi.solve(hvi.Model(half, [steel, shift[0], *own]), tolerance=1e-10)
    two = hvi.solve(hvi.Model(both, [steel, *shift, *seam]), tolerance=1e-10)
    assert one.converged
    assert two.converged
    assert two.energy == pytest.approx(2 * one.energy, rel=1e-9)
    mine, theirs = one.contact["foot"], two.contact["seam"]
    assert theirs.pressure == pytest.approx(mine.pressure, rel=1e-7, abs=1.0)
    if mode == "slip":
        assert theirs.friction == pytest.approx(mine.friction, rel=1e-7, abs=1.0)
    assert {0, 1} <= set((theirs.branch if mode == "slip" else theirs.normal_branch).tolist())
