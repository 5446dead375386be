"""By how much a displacement violates each condition of the inequality, body by body, and what rounding makes of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from dolfinx import fem

from ..problem.problem import Bounds
from ..problem.references import References
from ..typing import Array
from . import balance
from .contact_state import ContactState, Forces


def measured(
    references: References, u: fem.Function, forces: Forces, states: Sequence[ContactState]
) -> dict[str, Array]:
    """The entries of the certificate but ``net_force``, relative, by body. Collective.

    Args:
        references: of the problem that was solved.
        u: nondimensional, ghosts updated.
        forces: at u.
        states: of the parts of Γc at u.
    """
    sizes = references.displacements(_owned(u, forces))
    unbalanced = references.norms(balance.unbalanced(references.problem, forces.reaction, states))
    scales = _force_scales(references, u, forces)
    return {
        "equilibrium": unbalanced / scales,
        "penetration": _worst(references, states, _penetration) / sizes,
        "tension": _worst(references, states, _tension) / references.scale,
        "complementarity": _worst(references, states, _Complementarity(references, sizes)),
        "inclusion": _inclusion(references, states),
    }


def rounding_errors(
    references: References, u: fem.Function, forces: Forces, states: Sequence[ContactState]
) -> dict[str, Array]:
    """By how much the entries of :func:`measured` change when the last digits of u are shuffled, by body. Collective.

    Where a law is steep, as one with a narrow smoothing, they move the traction that it gives too.

    Args:
        references: of the problem that was solved.
        u: nondimensional, ghosts updated.
        forces: at u.
        states: of the parts of Γc at u.
    """
    force = balance.rounding_sample(references.problem, u.x.array)
    worst: Array = references.norms(force) / _force_scales(references, u, forces)
    for state in states:
        scale = np.min(
            [references.at(state.surface.blocks), *(law.scale * law.term.multiplier for law in state.laws)], axis=0
        )
        traction = np.max(np.abs(force[state.surface.blocks]), axis=1) / state.surface.weights
        worst = np.maximum(worst, references.largest(state.surface.blocks, traction / scale))
    names = ("equilibrium", "penetration", "tension", "complementarity")
    return {**dict.fromkeys(names, worst), "inclusion": worst + _rounding_of_laws(references, u, states)}


def _rounding_of_laws(references: References, u: fem.Function, states: Sequence[ContactState]) -> Array:
    """By how much the last digits of u move what the laws give, relative to their scales, by body. Collective."""
    worst: Array = np.zeros(references.count)
    vectors = np.abs(u.x.array.reshape(-1, references.problem.scales.dimension)) * np.finfo(float).eps
    for law in (law for state in states for law in state.laws):
        blocks = law.term.surface.blocks
        digits = np.einsum("mkd,md->mk", np.abs(law.term.directions), vectors[blocks])
        worst = np.maximum(worst, references.largest(blocks, law.moved_by(digits) / law.scale))
    return worst


def _owned(u: fem.Function, forces: Forces) -> Array:
    return np.asarray(u.x.array[: forces.load.size])


def _force_scales(references: References, u: fem.Function, forces: Forces) -> Array:
    return references.forces(_owned(u, forces), forces.reaction + forces.load)


def _worst(
    references: References, states: Sequence[ContactState], measure: Callable[[Bounds, ContactState], Array]
) -> Array:
    """The largest of a measure of contact, by body. Collective."""
    worst: Array = np.zeros(references.count)
    for state in states:
        if state.bounds is not None:
            worst = np.maximum(worst, references.largest(state.surface.blocks, measure(state.bounds, state)))
    return worst


def _penetration(bounds: Bounds, state: ContactState) -> Array:
    return bounds.beyond(state.normal)


def _tension(bounds: Bounds, state: ContactState) -> Array:
    """Pulling at the upper bound of u·n, pushing at the lower one."""
    on_bounds = np.where(state.contact, state.contact_pressure, 0.0)
    return np.abs(on_bounds - np.where(state.contact, balance.allowed_pressure(state), 0.0))


class _Complementarity:
    """The smaller one of gap and contact traction, relative to the displacements and the stress of the body."""

    def __init__(self, references: References, sizes: Array) -> None:
        self._references, self._sizes = references, sizes

    def __call__(self, bounds: Bounds, state: ContactState) -> Array:
        blocks = state.surface.blocks
        gap = np.maximum(-bounds.beyond(state.normal), 0.0)
        size = self._sizes[self._references.problem.bodies.labels[blocks]]
        return np.minimum(np.abs(state.contact_pressure) / self._references.at(blocks), gap / size)


def _inclusion(references: References, states: Sequence[ContactState]) -> Array:
    worst: Array = np.zeros(references.count)
    for law in (law for state in states for law in state.laws):
        worst = np.maximum(worst, references.largest(law.term.surface.blocks, law.distance / law.scale))
    return worst
