"""Is it a solution of the inequality? Decided from (u, problem) alone, whatever the solver says.

Each entry is relative to a scale that is stated with it, of the body where it is found (:mod:`.references`), and is the
largest of all bodies; ``passed`` means that all of them are within the tolerance.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from dolfinx import fem
from mpi4py import MPI

from ..problem import references
from ..problem.problem import Problem
from ..problem.references import References
from ..runtime.mpi import largest, total
from ..typing import Array, Entities
from . import balance, contact_state
from . import second_order as stability
from .contact_state import ContactState, Forces
from .thresholds import DEFAULT


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Certificate:
    """How far u is from a solution.

    Attributes:
        equilibrium: residual force that nothing carries, over the loads (where something else moves the body, over
            what supports, contact and laws take up, if more), Euclidean norms.
        net_force: largest net force or moment along a rigid motion that nothing carries, over the loads' or what
            contact and laws carry or could carry along it.
        penetration: largest violation of a bound, over the largest displacement.
        tension: largest contact traction of the wrong sign, over the load's stress.
        complementarity: largest min(gap over the largest displacement, contact traction over the load's stress).
        inclusion: largest distance of -σ_t (σ_n of a normal law) from ∂j, over the law's traction scale (not less than
            a thousandth of the load's stress), for the law that was solved.
        inclusion_true: the same for the unsmoothed law.
        second_order: ``local minimiser``, ``not a minimiser`` (on a concave kink that nothing covers: the energy falls
            to first order) or ``undecided`` (a law softens, unless the inertia of the Hessian was asked for).
        tolerance: what was asked for.
        passed: whether all entries but ``inclusion_true`` are within the tolerance.
        mixity: largest relative change of an energy of separation if it was frozen anew at the mode mixity of u; None
            where no law's energy depends on the mode.
        rounding: None where all are; else by how much rounding alone moves the entries at this u: what is no larger
            passes, since no displacement in double precision can do better; ``net_force`` has no such excuse.
    """

    equilibrium: float
    net_force: float
    penetration: float
    tension: float
    complementarity: float
    inclusion: float
    inclusion_true: float
    second_order: str
    tolerance: float
    passed: bool
    mixity: float | None = None
    rounding: float | None = None

    @property
    def is_near(self) -> bool:
        """Whether it is missed by no more than rounding may be."""
        names = ("equilibrium", "net_force", "penetration", "tension", "complementarity", "inclusion")
        return not self.passed and max(getattr(self, name) for name in names) <= DEFAULT.largest_rounding

    def __str__(self) -> str:
        mixity = "" if self.mixity is None else f", mixity {self.mixity:.1e}"
        return (
            f"equilibrium {self.equilibrium:.1e}, net force {self.net_force:.1e}, penetration {self.penetration:.1e}, "
            f"tension {self.tension:.1e}, complementarity {self.complementarity:.1e}, inclusion {self.inclusion:.1e}"
            f"{mixity}; {self.second_order}"
        )

    def __repr__(self) -> str:
        return f"Certificate({'passed' if self.passed else 'not passed'} at {self.tolerance:g}: {self})"


@dataclass(frozen=True)
class Examination:
    """The certificate and what it was read off, nondimensional.

    Attributes:
        certificate: the verdict.
        energy: ½a(u, u) - <g, u> + Σ laws.
        forces: reactions and loads.
        states: of the parts of Γc.
        smoothing_error: largest distance of a law's traction from the unsmoothed law's, in units of p0.
        between_nodes: largest penetration anywhere on Γc; None at degree 1, where there is none between the nodes.
    """

    certificate: Certificate
    energy: float
    forces: Forces
    states: tuple[ContactState, ...]
    smoothing_error: float
    between_nodes: float | None = None


def examine(
    problem: Problem,
    u: fem.Function,
    tolerance: float,
    *,
    inertia: bool = False,
) -> Examination:
    """Certify u. Collective.

    Args:
        problem: what was solved.
        u: nondimensional, ghosts updated.
        tolerance: relative.
        inertia: whether to factorise the Hessian where the states leave the second order undecided (it costs a
            direct solve or two).
    """
    comm = problem.comm
    forces = contact_state.forces(problem, u)
    known = references.of(problem, forces.load)
    states = contact_state.states(known, u, forces.reaction)
    net = {"net_force": balance.net_forces(known, forces, states, u)}
    entries = measured(known, u, forces, states)
    passed, rounding = _within(entries, tolerance), None
    if not passed and _within(entries, DEFAULT.largest_rounding):
        shuffled = rounding_errors(known, u, forces, states)
        floors = {name: DEFAULT.rounding_safety * moved for name, moved in shuffled.items()}
        beyond = {name: np.where(values <= floors[name], 0.0, values) for name, values in entries.items()}
        passed, rounding = _within(beyond, tolerance), float(np.max(list(floors.values())))
    mixity = _mixity(comm, states)
    passed = passed and _within(net, tolerance) and (mixity or 0.0) <= tolerance
    true, error = (largest(comm, value) for value in _inclusion_true(states))
    limit = max(tolerance, rounding or 0.0)
    certificate = Certificate(
        **{name: float(np.max(values)) for name, values in (entries | net).items()},
        inclusion_true=true,
        second_order=stability.status(known, u, forces.reaction, limit, inertia=inertia and passed),
        tolerance=tolerance,
        passed=passed,
        mixity=mixity,
        rounding=rounding,
    )
    dip = balance.largest_penetration(problem, states)
    return Examination(certificate, _energy(problem, u, forces, states), forces, states, error, dip)


def _within(entries: Mapping[str, Array], limit: float) -> bool:
    return all(bool(np.all(np.isfinite(v) & (v <= limit))) for v in entries.values())


def _energy(problem: Problem, u: fem.Function, forces: Forces, states: Sequence[ContactState]) -> float:
    """½u·(Au) - b·u = ½u·(reaction - load), plus the laws. Collective."""
    values = problem.relative(u.x.array)[: forces.load.size]
    elastic = 0.5 * float(values @ (forces.reaction - forces.load).ravel())
    laws = sum(
        float(np.sum(law.term.energy_weights * law.term.law.value(law.argument)))
        for state in states
        for law in state.laws
    )
    return total(problem.comm, elastic + laws)


def _mixity(comm: MPI.Comm, states: Sequence[ContactState]) -> float | None:
    """By how much the mode mixity does not stand yet. Collective."""
    laws = [law for state in states for law in state.laws if law.term.mixity is not None]
    return largest(comm, max(law.unsettled for law in laws)) if laws else None


def _inclusion_true(states: Sequence[ContactState]) -> tuple[float, float]:
    """Largest distance from the unsmoothed laws, relative to the law's scale, and in units of p0."""
    worst = absolute = 0.0
    for law in (law for state in states for law in state.laws):
        sizes = np.where(law.hidden, 0.0, law.true_distance())
        worst = max(worst, float(np.max(sizes / law.scale, initial=0.0)))
        absolute = max(absolute, float(np.max(sizes * law.term.multiplier, initial=0.0)))
    return worst, absolute


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
    sizes, problem = references.displacements(_owned(u, forces)), references.problem
    unbalanced = references.norms(balance.unbalanced(problem, forces.reaction, states))
    names = ("penetration", "tension", "complementarity", "inclusion")
    found = {name: np.zeros(references.count) for name in names}

    def enter(name: str, blocks: Entities, values: Array) -> None:
        np.maximum(found[name], references.largest(blocks, values), out=found[name])

    for state in states:
        blocks = state.surface.blocks
        if state.bounds is not None:
            beyond, pressure = state.bounds.beyond(state.normal), state.contact_pressure
            size, scale = sizes[problem.bodies.labels[blocks]], references.at(blocks)
            wrong = np.where(state.contact, np.abs(pressure - balance.allowed_pressure(state)), 0.0)
            enter("penetration", blocks, beyond / size)
            enter("tension", blocks, wrong / scale)
            enter("complementarity", blocks, np.minimum(np.abs(pressure) / scale, np.maximum(-beyond, 0.0) / size))
        for law in state.laws:
            enter("inclusion", blocks, law.distance / law.scale)
    return {"equilibrium": unbalanced / _force_scales(references, u, forces), **found}


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
    vectors = np.abs(u.x.array.reshape(-1, references.problem.dimension)) * np.finfo(float).eps
    for law in (law for state in states for law in state.laws):
        blocks = law.term.surface.blocks
        digits = np.einsum("mkd,md->mk", np.abs(law.term.directions), vectors[blocks])
        worst = np.maximum(worst, references.largest(blocks, law.moved_by(digits) / law.scale))
    return worst


def _owned(u: fem.Function, forces: Forces) -> Array:
    return u.x.array[: forces.load.size]


def _force_scales(references: References, u: fem.Function, forces: Forces) -> Array:
    return references.forces(_owned(u, forces), forces.reaction + forces.load)
