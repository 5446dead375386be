"""Several bodies: a shape, a mesh and a place for each of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Self

from pydantic import (
    Field,
    ModelWrapValidatorHandler,
    SerializeAsAny,
    SerializerFunctionWrapHandler,
    ValidationError,
    ValidationInfo,
    model_serializer,
    model_validator,
)

from ...errors import InputError
from ...schema import LONGEST, Mistake, Table, choose, mistakes_of, shown, unknown, validation_error
from .base import DomainShape

if TYPE_CHECKING:
    from mpi4py import MPI

    from ..domain import Domain
    from ..joined import PlacedBody

Coordinate = Annotated[float, Field(ge=-LONGEST, le=LONGEST)]
_SEVERAL = "set of bodies"
_PLACE = ("origin", "angle")


def _refuse_unknown_keys(table: Mapping[str, Any]) -> None:
    """Refuse what neither the shape nor its place knows: the shape itself would not name the keys of the place."""
    kind = DomainShape.registry.get(str(table.get("shape")))
    keys = [*kind.model_fields, *_PLACE] if kind else list(table)
    if mistakes := [Mistake((key,), unknown("key", key, keys)) for key in table if key not in keys]:
        raise validation_error(mistakes)


class PlacedShape(Table):
    """One of several bodies: its shape with its mesh, and where it is. The further keys are those of `shape`."""

    form: SerializeAsAny[DomainShape]
    origin: Annotated[list[Coordinate], Field(max_length=3)] | None = None
    """where the origin of the shape's own coordinates is, m, a list of 2 or 3; by default it stays"""
    angle: Annotated[float, Field(allow_inf_nan=False)] = 0.0
    """by which the body is turned about its `origin`, counterclockwise, degrees; in 2D only"""

    @model_validator(mode="before")
    @classmethod
    def _from_table(cls, data: Any, info: ValidationInfo) -> Any:
        if not isinstance(data, dict) or "form" in data:
            return data
        own = {key: value for key, value in data.items() if key in _PLACE}
        rest = {key: value for key, value in data.items() if key not in own}
        _refuse_unknown_keys(rest)
        return {**own, "form": choose(rest, "shape", DomainShape.registry, info.context)}

    @model_validator(mode="after")
    def _of_one_dimension(self) -> PlacedShape:
        dimension = self.form.space_dimension()
        if self.origin is not None and dimension is not None and len(self.origin) != dimension:
            text = f"has {len(self.origin)} components; a {self.form.shape} wants {dimension}"
            raise validation_error([Mistake(("origin",), text)])
        if self.angle and dimension == 3:
            text = "turns plane bodies only; turn a body in space in its mesh file, or leave angle out"
            raise validation_error([Mistake(("angle",), text)])
        return self

    @model_serializer(mode="wrap")
    def _flat(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        table = handler(self)
        return {**table.pop("form"), **{key: value for key, value in table.items() if value is not None}}

    def placed(self, name: str, domain: Domain) -> PlacedBody:
        """The meshed body in its place.

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
        c, s = math.cos(math.radians(self.angle)), math.sin(math.radians(self.angle))
        rotation = np.array([[c, -s], [s, c]]) if self.angle else np.eye(d)
        return PlacedBody(name=name, domain=domain, origin=origin, rotation=rotation)


class SeveralBodies(DomainShape):
    """Several bodies, ``[domain.NAME]`` each. It is not registered: ``shape`` is "set of bodies"."""

    dimension = None
    bodies: dict[str, PlacedShape]
    """by name"""

    @model_validator(mode="wrap")
    @classmethod
    def _placed_as_written(cls, data: Any, handler: ModelWrapValidatorHandler[Any]) -> Any:
        """What is wrong with a body is told at [domain.NAME], where the user wrote it."""
        try:
            return handler(data)
        except ValidationError as error:
            mistakes = mistakes_of(error, cls)
        own = ("bodies",)
        raise validation_error([m._replace(where=m.where[m.where[:1] == own :]) for m in mistakes])

    @model_validator(mode="before")
    @classmethod
    def _from_tables(cls, data: Any) -> Any:
        if not isinstance(data, dict) or data.get("shape") == _SEVERAL:
            return data
        return {"shape": _SEVERAL, "bodies": data}

    @model_validator(mode="after")
    def _of_one_dimension(self) -> SeveralBodies:
        known = {name: body.form.space_dimension() for name, body in self.bodies.items()}
        found = {d for d in known.values() if d is not None}
        if len(found) > 1:
            text = f"the bodies have different dimensions: {', '.join(f'{n} {d}' for n, d in known.items() if d)}"
            raise validation_error([Mistake((), text)])
        for name in self.bodies:
            if not name.isidentifier():
                text = "cannot be the name of a body; use letters, digits and _, a letter first"
                raise validation_error([Mistake((name,), text)])
        return self

    @model_serializer(mode="wrap")
    def _by_name(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        found: dict[str, Any] = handler(self)["bodies"]
        return found

    @staticmethod
    def named(data: Any) -> bool:
        """Whether ``[domain]`` holds tables by name."""
        return isinstance(data, dict) and bool(data) and all(isinstance(table, dict) for table in data.values())

    @property
    def normals(self) -> Mapping[str, int | None] | None:  # type: ignore[override]
        """The axis normal to each BODY.SIDE; None where that is slanted; as a whole where only a mesh knows."""
        found: dict[str, int | None] = {}
        for name, body in self.bodies.items():
            if body.form.normals is None:
                return None
            straight = body.angle == 0.0
            found |= {f"{name}.{side}": axis if straight else None for side, axis in body.form.normals.items()}
        return found

    @property
    def regions(self) -> tuple[str, ...] | None:  # type: ignore[override]
        """The bodies' names, and BODY.REGION; None where only a mesh knows."""
        found: list[str] = []
        for name, body in self.bodies.items():
            if body.form.regions is None:
                return None
            found += [name, *(f"{name}.{region}" for region in body.form.regions)]
        return tuple(found)

    def space_dimension(self) -> int | None:
        """2 or 3; None where only the opened meshes know it."""
        known = (body.form.space_dimension() for body in self.bodies.values())
        return next((d for d in known if d is not None), None)

    def build(self, comm: MPI.Comm, dimension: int) -> Domain:
        """The meshed bodies. Collective."""
        return self._joined(comm, [body.form.build(comm, dimension) for body in self.bodies.values()])

    def build_hierarchy(self, comm: MPI.Comm, dimension: int) -> Domain:
        """The meshed bodies, with the coarser meshes of each. Collective."""
        from ..hierarchy import with_hierarchies

        domains = [body.form.build_hierarchy(comm, dimension) for body in self.bodies.values()]
        return self._joined(comm, with_hierarchies(domains))

    def _joined(self, comm: MPI.Comm, domains: Sequence[Domain]) -> Domain:
        from ..joined import check_places, joined

        found = zip(self.bodies.items(), domains, strict=True)
        placed = [body.placed(name, domain) for (name, body), domain in found]
        check_places(comm, placed)
        return joined(comm, placed)

    def _with_forms(self, forms: Mapping[str, DomainShape]) -> Self:
        return self.changed(bodies={name: body.changed(form=forms[name]) for name, body in self.bodies.items()})

    def coarsest(self) -> Self:
        """Each body with the mesh that an adaptive solve begins with."""
        return self._with_forms({name: body.form.coarsest() for name, body in self.bodies.items()})

    def refined(self, factor: Fraction) -> Self | None:
        """Each body with cells ``factor`` times finer; None where one of them has no such mesh."""
        found = {name: body.form.refined(factor) for name, body in self.bodies.items()}
        forms = {name: form for name, form in found.items() if form is not None}
        return self._with_forms(forms) if len(forms) == len(found) else None

    def with_mesh(self, text: str) -> Self:
        """Each body with a mesh so many times finer."""
        try:
            factor = Fraction(text)
        except (ValueError, ZeroDivisionError):
            factor = Fraction(0)
        found = self.refined(factor) if factor > 0 else None
        if found is None:
            raise InputError(
                f"{shown(text)} is no factor by which the meshes of all bodies can be made finer, like 1, 2 or 1/2"
            )
        return found

    def mesh_text(self, length: Callable[[float], str]) -> str:
        """The mesh of each body."""
        return "; ".join(f"{name}: {body.form.mesh_text(length)}" for name, body in self.bodies.items())

    def width(self) -> float | None:
        """The largest mesh width, m; None where only a mesh knows it."""
        found = [body.form.width() for body in self.bodies.values()]
        known = [width for width in found if width is not None]
        return max(known) if len(known) == len(found) else None

    def unknowns(self, dimension: int) -> float:
        """About how many unknowns all meshes have."""
        return sum(body.form.unknowns(dimension) for body in self.bodies.values())

    def files(self) -> tuple[Path, ...]:
        """The files of all bodies."""
        return tuple(file for body in self.bodies.values() for file in body.form.files())
