"""What a smoothing is: from a law with kinks to one without, at a stated price; and what smoothed laws share."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from numbers import Real
from typing import Any, ClassVar

from typing_extensions import override

from ...class_registry import enter, hint
from ...errors import InputError
from ...typing import Array, Integers
from ..base import Superpotential
from ..convex_parts import Directional

_REGISTRY: dict[str, type] = {}


class Smoothing(ABC):
    """A way to smooth laws. A subclass with a `name` can be named in a scene: `smoothing = "name"`.

    It is made without arguments. To add a plus function, subclass
    :class:`~hvi_fenicsx.laws.smoothing.PlusFunction` instead.

    Class attributes:
        name: the scene's name for it.
        laws: names of the laws that it can smooth; None: all.
    """

    name: ClassVar[str]
    laws: ClassVar[tuple[str, ...] | None] = None

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        if "name" in cls.__dict__:
            enter(_REGISTRY, cls, cls.name, "smoothing")

    @abstractmethod
    def smooth(self, law: Superpotential, epsilon_absolute: float) -> SmoothedLaw:
        """The law, smoothed.

        Args:
            law: with kinks or without.
            epsilon_absolute: the width ε > 0, N/m.

        Raises:
            InputError: the law is none of `laws`, or ε is no finite number > 0.
        """

    def relative(self, law: Superpotential, epsilon: float) -> SmoothedLaw:
        """The law, smoothed with a width relative to its energy scale.

        Args:
            law: as for :meth:`smooth`.
            epsilon: the width > 0 over the law's energy scale.

        Raises:
            InputError: as for :meth:`smooth`.
        """
        require_epsilon("epsilon", epsilon)
        return self.smooth(law, float(epsilon) * law.energy_scale)


def registered() -> dict[str, type[Smoothing]]:
    """All smoothings by their names, sorted; the user's own among them."""
    return dict(sorted(_REGISTRY.items()))


@dataclass(frozen=True)
class SmoothedLaw(Superpotential, register=False):
    """A law smoothed with a width ε (N/m): what all smoothings leave as the law has it."""

    law: Superpotential
    epsilon_absolute: float

    def __post_init__(self) -> None:
        require_epsilon("epsilon_absolute", self.epsilon_absolute)

    @property
    @abstractmethod
    def bound(self) -> float:
        """Bound of |S - j|, N/m."""

    @property
    def epsilon(self) -> float:
        """ε relative to the law's energy scale."""
        return self.epsilon_absolute / self.law.energy_scale

    @property
    @override
    def growth(self) -> Directional:
        return self.law.growth

    @property
    @override
    def energy_scale(self) -> float:
        return self.law.energy_scale

    @property
    @override
    def length_scale(self) -> float:
        return self.law.length_scale

    @property
    @override
    def even(self) -> bool:
        return self.law.even

    @override
    def piece(self, x: Array) -> Integers:
        return self.law.piece(x)


def require_epsilon(key: str, epsilon: object) -> None:
    """Refuse anything but a finite number > 0.

    Args:
        key: the name of the width in the message.
        epsilon: what was given for it.

    Raises:
        InputError: it is no finite number > 0.
    """
    number = isinstance(epsilon, Real) and not isinstance(epsilon, bool)
    if not number or not math.isfinite(epsilon) or not epsilon > 0.0:  # type: ignore[arg-type, operator]
        raise InputError(
            f"smoothing: {key} = {epsilon!r} must be a finite number > 0; "
            f"for the unsmoothed law leave smoothing and {key} away"
        )


def available() -> tuple[str, ...]:
    """Names of all smoothings, the user's own among them."""
    return tuple(registered())


def create(
    name: str, law: Superpotential, *, epsilon: float | None = None, epsilon_absolute: float | None = None
) -> SmoothedLaw:
    """The law, smoothed as a scene says it.

    Args:
        name: of the smoothing.
        law: with kinks or without.
        epsilon: the width ε relative to the law's energy scale.
        epsilon_absolute: instead, the width ε in N/m.

    Raises:
        InputError: the name is unknown, not exactly one ε is given, it is no finite number > 0, or the smoothing cannot
            smooth this law.
    """
    kind = registered().get(name)
    if kind is None:
        names = available()
        raise InputError(f"unknown smoothing {name!r}{hint(name, names)}; available: {', '.join(names)}")
    if epsilon is not None and epsilon_absolute is None:
        return kind().relative(law, epsilon)
    if epsilon_absolute is not None and epsilon is None:
        require_epsilon("epsilon_absolute", epsilon_absolute)
        return kind().smooth(law, float(epsilon_absolute))
    raise InputError(
        "smoothing: give either epsilon (relative to the law's energy scale, for example 0.01) "
        "or epsilon_absolute (in N/m)"
    )
