"""What a nonlinear solve asks of a law, or of what takes its place."""

from __future__ import annotations

from typing import Protocol

from ..typing import Array


class LawModel(Protocol):
    """What takes the place of a law in one nonlinear solve: a function of its argument (m,) with two derivatives."""

    def value(self, x: Array) -> Array:
        """Energy per area."""

    def derivative(self, x: Array) -> Array:
        """Traction."""

    def second(self, x: Array) -> Array:
        """Tangent stiffness."""
