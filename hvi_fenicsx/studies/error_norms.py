"""How far one solution is from another: relative errors of the quantities that people ask for.

To add one, write a function here under :func:`error_norm`: table, sentences and pages know it by its key.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..typing import Array
from .reference_solution import ReferenceSolution, TransferredSolution

Errors = dict[str, float | None]
"""Relative errors by the keys of :data:`ERROR_NORMS`; None where there is nothing to measure."""
Measure = Callable[[ReferenceSolution, TransferredSolution, TransferredSolution], float | None]
"""How far a solution is from another, relative to the reference's own size in the same norm."""


@dataclass(frozen=True)
class ErrorNorm:
    """A quantity whose error is measured.

    Attributes:
        description: what it is.
        name: in a sentence, after "in".
        power: of the errors that is additive over the levels of a mesh hierarchy.
        measure: the error.
    """

    description: str
    name: str
    power: int
    measure: Measure


ERROR_NORMS: dict[str, ErrorNorm] = {}
"""All by their keys, in the order of the tables."""


def error_norm(key: str, *, description: str, name: str, power: int = 1) -> Callable[[Measure], Measure]:
    """Register the function below as an error norm.

    Args:
        key: in tables.
        description: what it is.
        name: in a sentence, after "in".
        power: of the errors that is additive over the levels of a mesh hierarchy.
    """

    def register(measure: Measure) -> Measure:
        ERROR_NORMS[key] = ErrorNorm(description, name, power, measure)
        return measure

    return register


def errors(
    reference: ReferenceSolution, found: TransferredSolution, other: TransferredSolution | None = None
) -> Errors:
    """How far a solution is from another, by quantity.

    Args:
        reference: whose size the errors are relative to.
        found: the solution.
        other: from which it is measured; the reference where it is None.
    """
    against = other or reference.own
    return {key: norm.measure(reference, found, against) for key, norm in ERROR_NORMS.items()}


@error_norm("energy_norm", description="displacement, energy norm", name="the energy norm", power=2)
def _energy(reference: ReferenceSolution, found: TransferredSolution, other: TransferredSolution) -> float | None:
    return _ratio(reference.energy(found.u - other.u), reference.energy(reference.own.u))


@error_norm("u_t_l2", description="u_t on Γc, L2", name="u_t (L2)")
def _slip_l2(reference: ReferenceSolution, found: TransferredSolution, other: TransferredSolution) -> float | None:
    return _on_surface(reference, found, other, "slip", "l2")


@error_norm("u_t_max", description="u_t on Γc, largest", name="u_t (largest)")
def _slip_max(reference: ReferenceSolution, found: TransferredSolution, other: TransferredSolution) -> float | None:
    return _on_surface(reference, found, other, "slip", "max")


@error_norm("friction_l1", description="-σ_t on Γc, L1", name="-σ_t (L1)")
def _friction_l1(reference: ReferenceSolution, found: TransferredSolution, other: TransferredSolution) -> float | None:
    return _on_surface(reference, found, other, "friction", "l1")


@error_norm("friction_l2", description="-σ_t on Γc, L2", name="-σ_t (L2)")
def _friction_l2(reference: ReferenceSolution, found: TransferredSolution, other: TransferredSolution) -> float | None:
    return _on_surface(reference, found, other, "friction", "l2")


@error_norm(
    "friction_max",
    description="-σ_t on Γc, largest away from the law's jumps",
    name="-σ_t (largest, away from jumps)",
)
def _friction_max(reference: ReferenceSolution, found: TransferredSolution, other: TransferredSolution) -> float | None:
    error = size = 0.0
    for name in reference.fields.parts:
        away = ~reference.near_jump(name, found)
        difference = _length(found.parts[name]["friction"] - other.parts[name]["friction"])[away]
        if not len(difference):
            return None
        error = max(error, float(difference.max()))
        size = max(size, float(_length(reference.own.parts[name]["friction"]).max(initial=0.0)))
    return _ratio(error, size)


@error_norm("pressure_l1", description="-σ_n on Γc, L1", name="-σ_n (L1)")
def _pressure_l1(reference: ReferenceSolution, found: TransferredSolution, other: TransferredSolution) -> float | None:
    return _on_surface(reference, found, other, "pressure", "l1")


@error_norm("pressure_l2", description="-σ_n on Γc, L2", name="-σ_n (L2)")
def _pressure_l2(reference: ReferenceSolution, found: TransferredSolution, other: TransferredSolution) -> float | None:
    return _on_surface(reference, found, other, "pressure", "l2")


@error_norm(
    "contact_set",
    description="area where one is closed and the other open, over the closed area",
    name="the contact set",
)
def _contact_set(reference: ReferenceSolution, found: TransferredSolution, other: TransferredSolution) -> float | None:
    wrong = closed = 0.0
    for name, part in reference.fields.parts.items():
        one, two, true = (s.parts[name]["contact"] > 0.5 for s in (found, other, reference.own))
        wrong += float(part.weights[one != two].sum())
        closed += float(part.weights[true].sum())
    return _ratio(wrong, closed) if any(p.bounded for p in reference.fields.parts.values()) else None


@error_norm("resultant", description="resultant of -σ_n, over the integral of its size", name="the contact resultant")
def _contact_force(
    reference: ReferenceSolution, found: TransferredSolution, other: TransferredSolution
) -> float | None:
    return _resultant(reference, found, other, "pressure")


@error_norm("friction_force", description="resultant of -σ_t, over the integral of its size", name="the friction force")
def _friction_force(
    reference: ReferenceSolution, found: TransferredSolution, other: TransferredSolution
) -> float | None:
    return _resultant(reference, found, other, "friction")


def _on_surface(
    reference: ReferenceSolution,
    found: TransferredSolution,
    other: TransferredSolution,
    column: str,
    norm: Literal["l1", "l2", "max"],
) -> float | None:
    error = size = 0.0
    for name, part in reference.fields.parts.items():
        difference = _length(found.parts[name][column] - other.parts[name][column])
        error = _sum(error, difference, part.weights, norm)
        size = _sum(size, _length(reference.own.parts[name][column]), part.weights, norm)
    return _ratio(math.sqrt(error), math.sqrt(size)) if norm == "l2" else _ratio(error, size)


def _resultant(
    reference: ReferenceSolution, found: TransferredSolution, other: TransferredSolution, column: str
) -> float | None:
    """Relative to the sum of the tractions' sizes: a resultant itself may be zero."""
    difference: Array = np.zeros(reference.fields.points.shape[1])
    size = 0.0
    for name, part in reference.fields.parts.items():
        values, others, true = (s.parts[name][column] for s in (found, other, reference.own))
        away = values - others
        difference = difference + part.weights @ (away[:, None] * part.normals if away.ndim == 1 else away)
        size += float(part.weights @ _length(true))
    return _ratio(float(np.linalg.norm(difference)), size)


def _length(values: Array) -> Array:
    return np.abs(values) if values.ndim == 1 else np.asarray(np.linalg.norm(values, axis=1))


def _sum(so_far: float, values: Array, weights: Array, norm: str) -> float:
    if norm == "max":
        return max(so_far, float(np.max(values, initial=0.0)))
    return so_far + float(weights @ values ** {"l1": 1, "l2": 2}[norm])


def _ratio(error: float, size: float) -> float | None:
    return error / size if size > 0.0 else None
