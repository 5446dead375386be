"""Cohesion: opening and slip in one law, mixed mode by the effective displacement."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, ClassVar, Self

import numpy as np
from pydantic import Field, model_validator
from typing_extensions import override

from ..errors import InputError
from ..laws import Mixity, mixities
from ..schema import OneOf, Positive, refusal
from .base import FormContext
from .contribution import Contribution, Direction
from .law_effect import LawEffect


class Cohesion(LawEffect):
    """A law j = g(δ) of both modes, δ = sqrt(⟨opening⟩₊² + beta² |slip|²). Compression is contact's matter."""

    key: ClassVar[str] = "cohesion"
    term: ClassVar[str] = "∫ j⁰(u; v - u) ds on Γc, j = g(δ), δ² = ⟨-u_n⟩₊² + β² |u_t|², vertex quadrature"
    direction: ClassVar[Direction] = Direction.SEPARATION

    beta: Positive = 1.0
    """what a slip is multiplied by beside an opening: the strength in shear is beta times that in tension, and both
    modes take the same energy"""
    mixity: Annotated[str | None, OneOf(mixities)] = None
    """the criterion by which the energy of separation depends on the mode; by default it does not"""
    energy_ratio: Positive | None = None
    """with mixity: the energy of slip alone over that of opening alone; the strength in shear is beta energy_ratio
    times that in tension"""
    exponent: Annotated[float | None, Field(ge=1.0, allow_inf_nan=False)] = None
    """with mixity: the exponent of the criterion"""

    @model_validator(mode="after")
    def _whole(self) -> Self:
        given = [self.mixity, self.energy_ratio, self.exponent]
        if any(g is None for g in given) and any(g is not None for g in given):
            raise refusal("mixity, energy_ratio and exponent belong together: state all three of them, or none")
        return self

    @property
    def _criterion(self) -> Mixity | None:
        if self.mixity is None or self.energy_ratio is None or self.exponent is None:
            return None
        return mixities()[self.mixity](energy_ratio=self.energy_ratio, exponent=self.exponent)

    @override
    def contribute(self, context: FormContext, where: str | None) -> Contribution:
        """The law, acting on the effective displacement."""
        return Contribution(laws=(replace(self._brought(self.beta), mixity=self._criterion),))

    @override
    def check(self, dimension: int) -> None:
        """The law is known for δ ≥ 0 alone, and bonds do not push apart."""
        if not self.law.even:
            reason = "is one-sided; cohesion acts on δ, which is never negative: leave one_sided out"
            raise InputError(f'law = "{self.law.name}" {reason}')
        if self.mixity is not None and float(self.law.right(np.zeros(1))[0]) > 0.0:
            reason = "has a traction at rest, where there is no mode yet; with mixity let it rise from 0 on a short way"
            raise InputError(f'law = "{self.law.name}" {reason}')
        if self.law.c4 > 0.0:
            reason = "has negative tractions, which would push the sides apart; use adhesion and friction instead"
            raise InputError(f'law = "{self.law.name}" {reason}')
