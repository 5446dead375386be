"""The compiled forms of a problem."""

from __future__ import annotations

from dataclasses import dataclass

from dolfinx import fem

from ..problem.problem import Problem
from ..runtime import forms


@dataclass(frozen=True)
class CompiledForms:
    """A problem's compiled forms.

    Attributes:
        bilinear: of the elastic operator.
        linear: of the loads, by name.
    """

    bilinear: fem.Form
    linear: dict[str, fem.Form]


def compile_forms(problem: Problem) -> CompiledForms:
    """Compile (or take from the cache) what the assembly needs. Collective."""
    return CompiledForms(problem.bulk.compiled, {name: forms.compiled(f) for name, f in problem.linear.items()})
