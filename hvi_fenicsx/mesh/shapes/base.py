"""What a domain shape is: all that is known about a shape of a body stands on its class.

A new shape is a new subclass of :class:`DomainShape`, best of :class:`.built_in.PlaneShape` or
:class:`.given.FixedMesh`. It registers itself under the default of its field ``shape``, which is then a value of
``[domain]`` in scene files. Nothing else is edited. Light: what builds meshes is loaded when a mesh is built.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self

from pydantic import Field, model_validator

from ...class_registry import enter
from ...errors import InputError
from ...schema import LONGEST, Mistake, Table, validation_error

if TYPE_CHECKING:
    from mpi4py import MPI

    from ..domain import Domain
    from ..joined import PlacedBody


FEWEST_ADAPTIVE = 3
"""Cells each way that the coarsest block of an adaptive solve has at least."""
FEWEST_STUDY = 2
"""Cells each way that a block of a study has at least."""
LARGEST_PART = 1 / 6
"""The largest share of the extent of a shape that the cells of its coarsest mesh have."""
UNKNOWNS_OF_FILE = 5_000
"""What a mesh file is taken to have, unrefined; it is not opened for that."""
LARGEST_BODY = 200.0
"""A longer body (m) may be one in mm."""


class DomainShape(Table):
    """The shape of a body with its mesh, of one of several bodies also its place; its keys are those of its `shape`.

    Class attributes:
        dimension: 2 or 3; None where only the mesh knows it.
        normals: the axis normal to each named side, None where that is slanted or curved; None as a whole where only
            the mesh knows its sides.
        regions: names of the regions; None where only the mesh knows them.
    """

    dimension: ClassVar[int | None]
    normals: ClassVar[Mapping[str, int | None] | None]
    regions: ClassVar[tuple[str, ...] | None] = ()
    registry: ClassVar[dict[str, type[DomainShape]]] = {}

    shape: str
    """the name of the shape; a subclass gives it as ``Literal["name"] = "name"``"""

    origin: Annotated[list[Annotated[float, Field(ge=-LONGEST, le=LONGEST)]], Field(max_length=3)] | None = None
    """where the origin of the shape's own coordinates is, m, a list of 2 or 3; by default it stays"""
    angle: Annotated[float, Field(allow_inf_nan=False)] | None = None
    """by which the body is turned about its `origin`, counterclockwise, degrees; in 2D only; by default it is not"""

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        super().__pydantic_init_subclass__(**kwargs)
        if "shape" not in cls.__annotations__:
            return
        enter(DomainShape.registry, cls, cls.model_fields["shape"].default, "domain shape")

    @model_validator(mode="after")
    def _place_of_one_dimension(self) -> Self:
        dimension = self.space_dimension()
        if self.origin is not None and dimension is not None and len(self.origin) != dimension:
            text = f"has {len(self.origin)} components; a {self.shape} wants {dimension}"
            raise validation_error([Mistake(("origin",), text)])
        if self.angle and dimension == 3:
            text = "turns plane bodies only; turn a body in space in its mesh file, or leave angle out"
            raise validation_error([Mistake(("angle",), text)])
        return self

    def space_dimension(self) -> int | None:
        """2 or 3; None where only the opened mesh knows it."""
        return self.dimension

    @abstractmethod
    def build(self, comm: MPI.Comm, dimension: int) -> Domain:
        """The meshed body. Collective.

        Args:
            comm: the ranks that share the mesh.
            dimension: of the scene, 2 or 3; the shape's own where it has one.

        Raises:
            InputError: on all ranks alike, when the mesh cannot be made, or memory cannot suffice.
        """

    def build_hierarchy(self, comm: MPI.Comm, dimension: int) -> Domain:
        """The meshed body with coarser meshes below it, where it is large enough for that to pay. Collective.

        Args:
            comm: the ranks that share the mesh.
            dimension: of the scene, 2 or 3.

        Raises:
            InputError: on all ranks alike, when the mesh cannot be made, or memory cannot suffice.
        """
        from ..hierarchy import with_hierarchy

        return with_hierarchy(self.build(comm, dimension))

    @abstractmethod
    def coarsest(self) -> Self:
        """The shape with the mesh that an adaptive solve begins with."""

    @abstractmethod
    def refined(self, factor: Fraction) -> Self | None:
        """The shape with cells ``factor`` times finer each way; None where there is no such mesh.

        Args:
            factor: above 1 finer, below 1 coarser.

        Raises:
            ValidationError: the mesh would be finer than the shape allows.
        """

    @abstractmethod
    def with_mesh(self, text: str) -> Self:
        """The shape with the mesh that a value of ``--axis mesh=`` names.

        Args:
            text: what the user wrote.

        Raises:
            InputError: the text names no mesh of this shape; the message says what would.
            ValidationError: the mesh would be finer than the shape allows.
        """

    @abstractmethod
    def mesh_text(self, length: Callable[[float], str]) -> str:
        """The mesh as people name it, like "64 × 64 cells".

        Args:
            length: writes a length (m) with a unit that suits it.
        """

    def width(self) -> float | None:
        """The mesh width h, m; None where only the mesh knows it."""
        return None

    @abstractmethod
    def unknowns(self, dimension: int) -> float:
        """About how many unknowns the mesh has; it is not made for that.

        Args:
            dimension: of the scene, 2 or 3.
        """

    def placed(self, name: str, domain: Domain) -> PlacedBody:
        """The meshed body in its place, one of several.

        Args:
            name: of the body.
            domain: the body on its mesh, in its own coordinates.

        Raises:
            InputError: origin or angle do not suit the dimension of a mesh file.
        """
        import numpy as np

        from ..joined import PlacedBody

        d = domain.dimension
        origin = np.array(self.origin or [0.0] * d)
        if len(origin) != d or (self.angle and d == 3):
            raise InputError(
                f"domain.{name}: its mesh has {d} dimensions; origin wants {d} numbers, angle only suits 2"
            )
        rotation = np.eye(d)
        if self.angle:
            c, s = math.cos(math.radians(self.angle)), math.sin(math.radians(self.angle))
            rotation = np.array([[c, -s], [s, c]])
        return PlacedBody(name=name, domain=domain, origin=origin, rotation=rotation)

    def implausible(self, length: float) -> tuple[str, ...]:
        """What may be mistakes in its numbers, in sentences. Advice: nothing is refused.

        Args:
            length: of the body, m.
        """
        return (f"the body is {length:.4g} m long; is it in m?",) if length > LARGEST_BODY else ()
