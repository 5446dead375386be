"""Nonmonotone friction on Γc (paper: j)."""

from __future__ import annotations

from typing import ClassVar

from typing_extensions import override

from ..errors import InputError
from .contribution import Direction
from .law_effect import LawEffect


class Friction(LawEffect):
    """A law of the tangential displacement: -σ_t ∈ ∂j(u_t). It also acts on lifted vertices, as in the paper."""

    key: ClassVar[str] = "friction"
    term: ClassVar[str] = "∫ j⁰(u_t; v_t - u_t) ds on Γc, vertex quadrature"
    direction: ClassVar[Direction] = Direction.SLIP

    @override
    def check(self, dimension: int) -> None:
        """In 3D the law acts on |u_t| and must be even."""
        if dimension == 3 and not self.law.even:
            reason = "is one-sided; in 3D friction acts on |u_t| and must be even"
            raise InputError(f'law = "{self.law.name}" {reason}')
