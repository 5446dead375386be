"""Laws in the normal direction: adhesion that resists opening, a support that resists penetration."""

from __future__ import annotations

from typing import ClassVar

from .contribution import Direction
from .law_effect import LawEffect


class Adhesion(LawEffect):
    """A law of the opening -u·n: σ_n in ∂j(-u·n), pulling the body back; beside unilateral contact, or without it."""

    key: ClassVar[str] = "adhesion"
    term: ClassVar[str] = "∫ j⁰(-u_n; -(v_n - u_n)) ds on Γc, vertex quadrature"
    direction: ClassVar[Direction] = Direction.OPENING


class Support(LawEffect):
    """A law of the penetration u·n (normal compliance): -σ_n in ∂j(u·n), pushing the body back."""

    key: ClassVar[str] = "support"
    term: ClassVar[str] = "∫ j⁰(u_n; v_n - u_n) ds on Γc, vertex quadrature"
    direction: ClassVar[Direction] = Direction.PENETRATION
