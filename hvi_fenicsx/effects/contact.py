"""Contact: unilateral with a gap (paper: K), or bilateral within a slot."""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic import model_serializer, model_validator

from ..expressions import Formula
from .base import Contribution, Effect, FormulaField, NormalBounds, Place, Stage, refusal


class Contact(Effect):
    """Unilateral, gap - u·n ≥ 0, or bilateral, lower ≤ -u·n ≤ upper, at every vertex of the part; n outward."""

    key: ClassVar[str] = "contact"
    place: ClassVar[Place] = Place.BOUNDARY
    exclusive: ClassVar[bool] = True
    term: ClassVar[str] = "K: gap - u·n ≥ 0 on Γc, or lower ≤ -u·n ≤ upper"

    gap: FormulaField | None = None
    """gap in m, a number or a formula in x, y, z: the body may move outwards by so much"""
    lower: FormulaField | None = None
    """instead of a gap: least opening -u·n in m, a number or a formula"""
    upper: FormulaField | None = None
    """with lower: largest opening in m, a number or a formula"""

    @model_validator(mode="after")
    def _one_way(self) -> Contact:
        if (self.gap is None) == (self.lower is None) or (self.lower is None) != (self.upper is None):
            raise refusal("needs either gap = 0.0, or lower and upper: { lower = -1e-6, upper = 1e-6 }")
        ends = [f.source for f in (self.lower, self.upper) if f is not None and f.is_number]
        if len(ends) == 2 and ends[0] > ends[1]:  # type: ignore[operator]
            raise refusal(f"lower = {ends[0]:g} is above upper = {ends[1]:g}; swap them")
        return self

    @model_serializer(mode="plain")
    def _as_table(self) -> dict[str, Any]:
        return {k: f.source for k in ("gap", "lower", "upper") if (f := getattr(self, k)) is not None}

    def contribute(self, stage: Stage, where: str | None) -> Contribution:
        """The bounds on the normal displacement."""
        lower = self.lower if self.gap is None else _negative(self.gap)
        return Contribution(bounds=(NormalBounds(lower=lower, upper=self.upper),))


def _negative(formula: Formula) -> Formula:
    source = formula.source
    return Formula(f"-({source})") if isinstance(source, str) else Formula(-source)
