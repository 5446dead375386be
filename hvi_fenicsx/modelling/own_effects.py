"""Effects of any class with their places, such as those that a user has written."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from dolfinx import mesh as dmesh

from ..effects import Effect, Place
from ..errors import InputError
from .placed_effects import InRegion, OnSide


@dataclass(frozen=True)
class On(OnSide):
    """Any effect on a side, such as one of your own class.

    Attributes:
        side: the side's name, or a list of sides.
        placed: the effect.
    """

    side: str | Sequence[str]
    placed: Effect

    def effect(self, mesh: dmesh.Mesh) -> Effect:
        """The effect as it is."""
        effect = _known(self.placed)
        if effect.place is not Place.BOUNDARY:
            raise InputError(f"{effect.key} acts in a {effect.place.value}: write hvi.In(effect, region)")
        return effect


@dataclass(frozen=True)
class In(InRegion):
    """Any effect in the volume, or any material, such as one of your own class.

    Attributes:
        placed: the effect.
        region: where, a name or a list; None: in the whole body.
    """

    placed: Effect
    region: str | Sequence[str] | None = None

    def effect(self, mesh: dmesh.Mesh) -> Effect:
        """The effect as it is."""
        effect = _known(self.placed)
        if effect.place is Place.BOUNDARY:
            raise InputError(f"{effect.key} acts on a side: write hvi.On(side, effect)")
        return effect


def _known(given: Any) -> Effect:
    if not isinstance(given, Effect):
        raise InputError(f"{given!r} is no effect; give an object of a subclass of hvi_fenicsx.effects.Effect")
    return given
