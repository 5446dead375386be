"""Domain shapes: one class each, also from outside; and what a study or an adaptive solve makes of their meshes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
import pytest
from dolfinx import mesh as dmesh
from mpi4py import MPI
from scenes import STEEL, solved

from hvi_fenicsx import InputError, read_tables
from hvi_fenicsx.geometry import Outline
from hvi_fenicsx.mesh.domain import Domain
from hvi_fenicsx.mesh.shapes import (
    Disk,
    DomainShape,
    FixedMesh,
    HalfDisk,
    MeshFile,
    PlaneShape,
    Rectangle,
    Refinements,
)
from hvi_fenicsx.schema import Length

WEIGHT = 2.0e4


@pytest.fixture
def wedge() -> Iterator[type[DomainShape]]:
    """A shape of a user's own, its mesh made by moving the vertices of dolfinx's square; with two regions."""

    class Wedge(FixedMesh):
        """A unit square whose top rises to the right."""

        dimension = 2
        normals: ClassVar[Mapping[str, int | None]] = {"bottom": 1, "left": 0, "right": 0, "top": None}
        regions = ("west", "east")

        shape: Literal["wedge"] = "wedge"
        rise: Length
        refinements: Refinements = 0

        def build(self, comm: MPI.Comm, dimension: int) -> Domain:
            mesh = dmesh.create_unit_square(comm, 4, 4)
            near: dict[str, Any] = {"bottom": (1, 0.0), "left": (0, 0.0), "right": (0, 1.0), "top": (1, 1.0)}
            sides = {
                name: dmesh.locate_entities_boundary(mesh, 1, lambda x, i=i, at=at: np.isclose(x[i], at))
                for name, (i, at) in near.items()
            }
            west = dmesh.locate_entities(mesh, 2, lambda x: x[0] < 0.5 + 1e-9)
            east = dmesh.locate_entities(mesh, 2, lambda x: x[0] > 0.5 - 1e-9)
            mesh.geometry.x[:, 1] *= 1.0 + self.rise * mesh.geometry.x[:, 0]
            return Domain.from_mesh(mesh, sides, {"west": west, "east": east}, one_piece=True)

    yield Wedge
    del DomainShape.registry["wedge"]


def on_wedge(**domain: Any) -> dict[str, Any]:
    return {
        "domain": {"shape": "wedge", "rise": 1.0, **domain},
        "material": {"a": STEEL | {"region": "west"}, "b": STEEL | {"region": "east"}},
        "body": {"force": [0.0, -WEIGHT]},
        "boundary": {"floor": {"on": "bottom", "displacement": [0.0, "free"], "contact": {"gap": 0.0}}},
    }


@pytest.mark.parametrize("refinements", [0, 2])
def test_a_shape_with_a_mesh_of_its_own_is_solved_on_and_refined(wedge: type[DomainShape], refinements: int) -> None:
    found = solved(on_wedge(refinements=refinements))
    assert found.examination is not None
    state = found.examination.states[0]
    assert float(state.surface.weights @ state.pressure) * found.problem.scales.force == pytest.approx(-1.5 * WEIGHT)
    assert found.dofs == 2 * (4 * 2**refinements + 1) ** 2


def test_sides_and_regions_of_a_users_shape_are_checked(wedge: type[DomainShape]) -> None:
    table = on_wedge()
    table["material"]["b"]["region"] = "easst"
    with pytest.raises(InputError, match='unknown region "easst"; did you mean "east"') as caught:
        read_tables(table)
    assert "(a wedge)" in str(caught.value)
    table = on_wedge()
    table["boundary"]["floor"]["on"] = "floor"
    with pytest.raises(InputError, match='unknown side "floor"; allowed: bottom, left, right, top'):
        read_tables(table)


def test_a_shape_needs_a_name_that_is_free() -> None:
    with pytest.raises(TypeError, match="domain shape class Again: the name 'disk' is taken by"):

        class Again(Disk):
            shape: Literal["disk"] = "disk"

    with pytest.raises(TypeError, match="domain shape class Nameless: its name must be a text"):

        class Nameless(PlaneShape):
            shape: Literal["nameless"]

            def outline(self) -> Outline:
                raise NotImplementedError

    assert DomainShape.registry["disk"] is Disk
    assert "nameless" not in DomainShape.registry


SQUARE = Rectangle(size=(3.0, 1.0), cells=(48, 16))
ROUND = HalfDisk(radius=1.0, mesh_size=0.05, mesh_size_below=0.01)


@pytest.fixture
def file(tmp_path: Path) -> MeshFile:
    (tmp_path / "m.msh").touch()
    return MeshFile(file=str(tmp_path / "m.msh"), refinements=2)  # type: ignore[arg-type]


def test_a_mesh_by_the_text_of_an_axis(file: MeshFile) -> None:
    assert SQUARE.with_mesh("24").cells == (24, 8)
    assert ROUND.with_mesh("0.1").mesh_size == 0.1
    assert file.with_mesh("0").refinements == 0
    wrong: dict[str, DomainShape] = {
        "'1' is no number of cells along x": SQUARE,
        "96, say, would do": SQUARE,
        "is no mesh size in m, like 0.05": ROUND,
        "is no number of refinements": file,
    }
    for (reason, shape), text in zip(wrong.items(), ("1", "25", "-1", "11"), strict=True):
        with pytest.raises(InputError, match=reason):
            shape.with_mesh(text)


SCALED: dict[str, dict[str, Any]] = {
    "disk": {"radius": 0.3, "mesh_size": 0.04, "mesh_size_below": 0.01},
    "half_disk": {"radius": 0.7, "mesh_size": 0.1, "mesh_size_below": 0.02},
    "l_shape": {"size": [1.0, 0.9], "cut": [0.37, 0.4], "mesh_size": 0.07},
    "notched_strip": {"size": [0.3, 0.1], "notch": [0.04, 0.03], "mesh_size": 0.01},
}


@pytest.mark.parametrize("factor", [2.0**-10, 1e3])
@pytest.mark.parametrize("name", SCALED)
def test_a_shape_has_the_same_mesh_in_any_units(name: str, factor: float) -> None:
    def times(value: Any) -> Any:
        return [factor * v for v in value] if isinstance(value, list) else factor * value

    kind, lengths = DomainShape.registry[name], SCALED[name]
    one = kind(**lengths).build(MPI.COMM_SELF, 2)
    other = kind(**{key: times(value) for key, value in lengths.items()}).build(MPI.COMM_SELF, 2)
    np.testing.assert_array_equal(other.mesh.geometry.dofmap, one.mesh.geometry.dofmap)
    rounding = 0.0 if factor == 2.0**-10 else 1e-14 * factor * one.length
    np.testing.assert_allclose(other.mesh.geometry.x, factor * one.mesh.geometry.x, rtol=0.0, atol=rounding)
    assert one.sides.keys() == other.sides.keys()
    assert all(np.array_equal(facets, other.sides[side]) for side, facets in one.sides.items())
