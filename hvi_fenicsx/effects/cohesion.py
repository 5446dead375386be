"""Cohesion: opening and slip in one law, mixed mode by the effective displacement."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import Field
from typing_extensions import override

from ..errors import InputError
from .base import FormContext
from .contribution import BoundaryLaw, Contribution, Direction
from .law_effect import LawEffect


class Cohesion(LawEffect):
    """A law j = g(δ) of both modes, δ = sqrt(⟨opening⟩₊² + beta² |slip|²). Compression is contact's matter."""

    key: ClassVar[str] = "cohesion"
    term: ClassVar[str] = "∫ j⁰(u; v - u) ds on Γc, j = g(δ), δ² = ⟨-u_n⟩₊² + β² |u_t|², vertex quadrature"
    direction: ClassVar[Direction] = Direction.SEPARATION

    beta: Annotated[float, Field(gt=0.0, allow_inf_nan=False)] = 1.0
    """what a slip is multiplied by beside an opening: the strength in shear is beta times that in tension, and both
    modes take the same energy"""

    @override
    def contribute(self, context: FormContext, where: str | None) -> Contribution:
        """The law, acting on the effective displacement."""
        return Contribution(laws=(BoundaryLaw(self.direction, self.law, self.beta),))

    @override
    def check(self, dimension: int) -> None:
        """The law is known for δ ≥ 0 alone, and bonds do not push apart."""
        if not self.law.even:
            reason = "is one-sided; cohesion acts on δ, which is never negative: leave one_sided out"
            raise InputError(f'law = "{self.law.name}" {reason}')
        if self.law.c4 > 0.0:
            reason = "has negative tractions, which would push the sides apart; use adhesion and friction instead"
            raise InputError(f'law = "{self.law.name}" {reason}')
