"""Laws in the normal direction: adhesion that resists opening, a support that resists penetration."""

from __future__ import annotations

from typing import ClassVar

from .contribution import Direction
from .law_effect import LawEffect


class Adhesion(LawEffect):
    """A law of the opening: σ_n ∈ ∂j(-u·n). It pulls the body back; it may act with or without unilateral contact."""

    key: ClassVar[str] = "adhesion"
    term: ClassVar[str] = "∫ j⁰(-u_n; -(v_n - u_n)) ds on Γc, vertex quadrature"
    direction: ClassVar[Direction] = Direction.OPENING


class Support(LawEffect):
    """A law of the penetration (normal compliance): -σ_n ∈ ∂j(u·n). It pushes the body back."""

    key: ClassVar[str] = "support"
    term: ClassVar[str] = "∫ j⁰(u_n; v_n - u_n) ds on Γc, vertex quadrature"
    direction: ClassVar[Direction] = Direction.PENETRATION
