"""Several bodies: a shape, a mesh and a place for each of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Self

from pydantic import (
    BeforeValidator,
    ModelWrapValidatorHandler,
    SerializeAsAny,
    SerializerFunctionWrapHandler,
    ValidationError,
    ValidationInfo,
    model_serializer,
    model_validator,
)

from ...errors import InputError
from ...schema import Mistake, choose, mistakes_of, shown, validation_error
from .base import DomainShape

if TYPE_CHECKING:
    from mpi4py import MPI

    from ..domain import Domain

_SEVERAL = "set of bodies"


def _body(data: Any, info: ValidationInfo) -> Any:
    return choose(data, "shape", DomainShape.registry, info.context)


class SeveralBodies(DomainShape):
    """Several bodies, ``[domain.NAME]`` each. It is not registered: ``shape`` is "set of bodies"."""

    dimension = None
    bodies: dict[str, Annotated[SerializeAsAny[DomainShape], BeforeValidator(_body)]]
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
        known = {name: body.space_dimension() for name, body in self.bodies.items()}
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
            if body.normals is None:
                return None
            found |= {f"{name}.{side}": None if body.angle else axis for side, axis in body.normals.items()}
        return found

    @property
    def regions(self) -> tuple[str, ...] | None:  # type: ignore[override]
        """The bodies' names, and BODY.REGION; None where only a mesh knows."""
        found: list[str] = []
        for name, body in self.bodies.items():
            if body.regions is None:
                return None
            found += [name, *(f"{name}.{region}" for region in body.regions)]
        return tuple(found)

    def space_dimension(self) -> int | None:
        """2 or 3; None where only the opened meshes know it."""
        known = (body.space_dimension() for body in self.bodies.values())
        return next((d for d in known if d is not None), None)

    def build(self, comm: MPI.Comm, dimension: int) -> Domain:
        """The meshed bodies in their places, with the coarser meshes of each. Collective."""
        from ..hierarchy import with_hierarchies
        from ..joined import check_places, joined

        domains = with_hierarchies([body.build_hierarchy(comm, dimension) for body in self.bodies.values()])
        found = zip(self.bodies.items(), domains, strict=True)
        placed = [body.placed(name, domain) for (name, body), domain in found]
        check_places(comm, placed)
        return joined(comm, placed)

    def coarsest(self) -> Self:
        """Each body with the mesh that an adaptive solve begins with."""
        return self.changed(bodies={name: body.coarsest() for name, body in self.bodies.items()})

    def refined(self, factor: Fraction) -> Self | None:
        """Each body with cells ``factor`` times finer; None where one of them has no such mesh."""
        found = {name: body.refined(factor) for name, body in self.bodies.items()}
        return None if None in found.values() else self.changed(bodies=found)

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
        return "; ".join(f"{name}: {body.mesh_text(length)}" for name, body in self.bodies.items())

    def width(self) -> float | None:
        """The largest mesh width, m; None where only a mesh knows it."""
        found = [body.width() for body in self.bodies.values()]
        known = [width for width in found if width is not None]
        return max(known) if len(known) == len(found) else None

    def unknowns(self, dimension: int) -> float:
        """About how many unknowns all meshes have."""
        return sum(body.unknowns(dimension) for body in self.bodies.values())

    def files(self) -> tuple[Path, ...]:
        """The files of all bodies."""
        return tuple(file for body in self.bodies.values() for file in body.files())
