"""A number at each point of space, in SI: what loads, gaps and prescribed displacements are given by."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any

import numpy as np

from .typing import Array


class SpatialValue(ABC):
    """A number at each point of space.

    Attributes:
        source: what stands for it in files: a number, a formula, or a few words.
    """

    __slots__ = ()
    source: float | str

    @property
    def is_number(self) -> bool:
        """Whether it is a plain number."""
        return isinstance(self.source, float)

    @property
    def everywhere(self) -> bool:
        """Whether it is known at all points; else it belongs to a mesh, and on others is known at its vertices only."""
        return True

    @abstractmethod
    def at(self, points: Array) -> Array:
        """Values at points of shape (n, 3), m; shape (n,). Not checked for finiteness."""

    @abstractmethod
    def in_ufl(self, mesh: Any, number: Callable[[float], Any]) -> Any:
        """The value in UFL.

        Args:
            mesh: the dolfinx mesh on which a form is made, m.
            number: wraps a number, so that its value is not compiled into the form.
        """

    def negative(self) -> SpatialValue:
        """The value with the other sign."""
        return _Mapped(self, f"-({self.source})", np.negative)

    def positive_part(self) -> SpatialValue:
        """The value where it is positive, else 0."""
        return _Mapped(self, f"max(0, {self.source})", lambda values: np.maximum(values, 0.0))


class _Mapped(SpatialValue):
    """A value that is computed from another one at each point; no form is made of it."""

    __slots__ = ("_change", "_value", "source")

    def __init__(self, value: SpatialValue, source: str, change: Callable[[Array], Array]) -> None:
        self._value, self.source, self._change = value, source, change

    @property
    def everywhere(self) -> bool:
        return self._value.everywhere

    def at(self, points: Array) -> Array:
        return self._change(self._value.at(points))

    def in_ufl(self, mesh: Any, number: Callable[[float], Any]) -> Any:
        raise NotImplementedError("bounds are evaluated at vertices")
