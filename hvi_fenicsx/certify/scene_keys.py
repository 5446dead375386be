"""The keys in the scene of the effects that brought bounds and laws, for sentences about them."""

from __future__ import annotations

from ..problem.law_term import LawTerm
from ..problem.problem import Problem


def of_bounds(problem: Problem, part: str) -> str:
    """The key of the effect that brought a part's bounds.

    Args:
        problem: as composed.
        part: with contact.
    """
    keys = (
        effect.key for where, effect, contribution in problem.contributions if where == part and contribution.bounds
    )
    return f"boundary.{part}.{next(keys)}"


def of_law(problem: Problem, term: LawTerm) -> str:
    """The key of the effect that brought a law.

    Args:
        problem: as composed.
        term: the law.
    """
    part = term.surface.part
    keys = (
        effect.key
        for where, effect, contribution in problem.contributions
        if where == part and any(law.direction is term.direction for law in contribution.laws)
    )
    return f"boundary.{part}.{next(keys)}"
