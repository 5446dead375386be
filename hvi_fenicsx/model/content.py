"""What a model holds: its effects with their places, and how messages and scene files name these."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

from ..effects import Effect, Place
from ..laws import Superpotential
from ..mesh.boundary_part import BoundaryPart
from ..mesh.shapes import DomainShape
from ..schema import Keys
from .body import Body
from .options import PathTable, SolverTable

WHOLE = ""
"""Name of the only table where ``[material]`` or ``[body]`` is not split into named ones."""
TABLES = ("material", "body", "boundary", "interface")
"""The tables of a scene that hold effects, in the order in which these act."""


class Content:
    """What a model holds.

    Attributes:
        body: the body.
        effects: the effects with their places, in the order of a scene's tables.
        title: one line that names the model.
        solver: how to solve.
        path: the load path; None: nothing is said of it.
        parts: the boundary parts by name; of an interface, the first side.
        plugins: files with classes of the user's own.
        from_file: whether it was read from the tables of a scene file.
    """

    body: Body
    effects: tuple[Effect, ...]
    title: str
    parts: Mapping[str, BoundaryPart]
    solver = SolverTable()
    path: PathTable | None = None
    plugins: tuple[str, ...] | None = None
    from_file = False

    @property
    def domain(self) -> DomainShape:
        """The body's shape with its mesh. Not collective."""
        return self.body.shape

    @property
    def dimension(self) -> int:
        """2 or 3: the shape's, or that of the materials where only the mesh knows it. Not collective."""
        if (own := self.domain.space_dimension()) is not None:
            return own
        known = (e.dimension() for e in self.effects if e.place is Place.MATERIAL)
        return next((dimension for dimension in known if dimension), 2)

    def laws(self) -> list[Superpotential]:
        """The laws of its effects. Not collective."""
        return [law for effect in self.effects for law in effect.superpotentials()]

    def files(self) -> tuple[Path, ...]:
        """The files of its domain and of its effects. Not collective."""
        return (*self.domain.files(), *(file for effect in self.effects for file in effect.files()))

    def acting(self) -> Iterator[tuple[str | None, Effect]]:
        """Each effect at a boundary part or a region; one in several regions comes once for each. Not collective."""
        for effect in self.effects:
            places = (effect.name,) if effect.place is Place.BOUNDARY else effect.where or (None,)
            yield from ((place, effect) for place in places)

    def table(self, effect: Effect) -> str:
        """The table of a scene file in which an effect stands. Not collective.

        Args:
            effect: one of the model's.
        """
        on_interface = effect.place is Place.BOUNDARY and effect.name in self.body.interfaces
        return "interface" if on_interface else effect.place.value

    def key(self, effect: Effect) -> Keys:
        """The keys of a scene file down to an effect. Not collective.

        Args:
            effect: one of the model's.
        """
        own = () if effect.place is Place.MATERIAL else (effect.key,)
        return (self.table(effect), effect.name, *own)


def dotted(key: Keys) -> str:
    """A place as messages name it.

    Args:
        key: the keys of a scene file down to it.
    """
    return ".".join(str(step) for step in key if step != WHOLE)
