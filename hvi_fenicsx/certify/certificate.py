"""Is it a solution of the inequality? Decided from (u, problem) alone, whatever the solver says.

Each entry is relative to a scale that is stated with it; ``passed`` means that all of them are within the tolerance.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass

import numpy as np
from dolfinx import fem

from ..problem.problem import Bounds, Problem
from ..runtime.mpi import largest, total
from ..typing import Array
from . import contact_state
from . import second_order as stability
from .contact_state import ContactState, Forces
from .thresholds import DEFAULT, Thresholds


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Certificate:
    """How far u is from a solution.

    Attributes:
        equilibrium: residual force that nothing carries, over the load's or the supports' (over one unit where there is
            no force at all), Euclidean norms.
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
        rounding: None where all are; else by how much rounding alone moves the entries at this u: what is no larger
            passes, since no displacement in double precision can do better.
    """

    equilibrium: float
    penetration: float
    tension: float
    complementarity: float
    inclusion: float
    inclusion_true: float
    second_order: str
    tolerance: float
    passed: bool
    rounding: float | None = None

    def as_dict(self) -> dict[str, float | str | bool | None]:
        """For ``summary.json``."""
        return asdict(self)

    def __str__(self) -> str:
        return (
            f"equilibrium {self.equilibrium:.1e}, penetration {self.penetration:.1e}, tension {self.tension:.1e}, "
            f"complementarity {self.complementarity:.1e}, inclusion {self.inclusion:.1e}; {self.second_order}"
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
    """

    certificate: Certificate
    energy: float
    forces: Forces
    states: tuple[ContactState, ...]
    smoothing_error: float


def examine(
    problem: Problem,
    u: fem.Function,
    tolerance: float,
    *,
    inertia: bool = False,
    thresholds: Thresholds = DEFAULT,
) -> Examination:
    """Certify u. Collective.

    Args:
        problem: what was solved.
        u: nondimensional, ghosts updated.
        tolerance: relative.
        inertia: whether to factorise the Hessian where the states leave the second order undecided (it costs a
            direct solve or two).
        thresholds: when a vertex is on a kink or a bound, and what is rounding.
    """
    comm = problem.domain.mesh.comm
    forces = contact_state.forces(problem, u)
    states = contact_state.states(problem, u, forces.reaction, thresholds)
    size = largest(comm, float(np.max(np.abs(u.x.array), initial=0.0))) or 1.0
    scale = _force_scale(problem, u, forces, thresholds.rounding_safety)
    entries = {
        "equilibrium": _unbalanced(problem, forces, states) / scale,
        "penetration": largest(comm, _worst(states, _penetration)) / size,
        "tension": largest(comm, _worst(states, _tension)),
        "complementarity": largest(comm, _worst(states, lambda b, s: _complementarity(b, s, size))),
        "inclusion": largest(comm, max((_inclusion(s) for s in states), default=0.0)),
    }
    passed, rounding = _within(entries, tolerance), None
    if not passed and _within(entries, thresholds.largest_rounding):
        rounding = thresholds.rounding_safety * _rounding(problem, u, states, scale)
        passed = _within(entries, max(tolerance, rounding))
    true, error = (largest(comm, value) for value in _inclusion_true(states))
    allowed = max(tolerance, rounding or 0.0)
    second_order = stability.status(problem, u, forces.reaction, allowed, inertia=inertia and passed)
    certificate = Certificate(
        **entries,
        inclusion_true=true,
        second_order=second_order,
        tolerance=tolerance,
        passed=passed,
        rounding=rounding,
    )
    return Examination(certificate, _energy(problem, u, forces, states), forces, states, error)


def _within(entries: Mapping[str, float], limit: float) -> bool:
    return all(np.isfinite(v) and v <= limit for v in entries.values())


def _force_scale(problem: Problem, u: fem.Function, forces: Forces, safety: float) -> float:
    """Norm of the loads, or of the supports' reactions where these are larger; 1 where all forces are rounding.

    Collective.
    """
    load, reaction = (_norm(problem, v) for v in (forces.load, forces.reaction))
    if load > 0.0 or reaction > safety * _norm(problem, _noise(problem, u)):
        return max(load, reaction)
    return 1.0


def _norm(problem: Problem, values: Array) -> float:
    return float(np.sqrt(total(problem.domain.mesh.comm, float(np.sum(values**2)))))


def _noise(problem: Problem, u: fem.Function) -> Array:
    """Forces of u's last digits, shuffled: a sample of what rounding makes of its forces, (blocks, d). Collective."""
    comm = problem.domain.mesh.comm
    shuffled = fem.Function(problem.space)
    signs = np.random.default_rng(comm.rank).choice([-1.0, 1.0], len(u.x.array))
    shuffled.x.array[:] = u.x.array * signs * np.finfo(float).eps
    shuffled.x.scatter_forward()
    forces = contact_state.forces(problem, shuffled)
    return forces.reaction + forces.load


def _rounding(problem: Problem, u: fem.Function, states: Sequence[ContactState], scale: float) -> float:
    """By how much the entries change when the last digits of u are shuffled. Collective."""
    force = _noise(problem, u)
    tractions = [
        float(np.max(np.abs(force[s.surface.blocks]) / s.surface.weights[:, None] / _finest(s), initial=0.0))
        for s in states
    ]
    worst = largest(problem.domain.mesh.comm, max(tractions, default=0.0))
    return max(_norm(problem, force) / scale, worst)


def _finest(state: ContactState) -> float:
    return min((law.term.traction_scale for law in state.laws), default=1.0)


def _energy(problem: Problem, u: fem.Function, forces: Forces, states: Sequence[ContactState]) -> float:
    """½u·(Au) - b·u = ½u·(reaction - load), plus the laws. Collective."""
    values = u.x.array[: forces.load.size]
    elastic = 0.5 * float(values @ (forces.reaction - forces.load).ravel())
    laws = sum(
        float(np.sum(state.surface.weights * law.term.law.value(law.argument)))
        for state in states
        for law in state.laws
    )
    return total(problem.domain.mesh.comm, elastic + laws)


def _unbalanced(problem: Problem, forces: Forces, states: Sequence[ContactState]) -> float:
    """Norm of the residual force that nothing carries. Collective."""
    return _norm(problem, contact_state.balanced(problem, forces.reaction, states))


def _worst(states: Sequence[ContactState], measure: Callable[[Bounds, ContactState], Array]) -> float:
    values = [measure(s.bounds, s) for s in states if s.bounds is not None]
    return max((float(np.max(v, initial=0.0)) for v in values), default=0.0)


def _penetration(bounds: Bounds, state: ContactState) -> Array:
    return bounds.beyond(state.normal)


def _tension(bounds: Bounds, state: ContactState) -> Array:
    """Pulling at the upper bound of u·n, pushing at the lower one."""
    pressure, lower, upper = state.contact_pressure, state.on_lower, state.on_upper
    wrong = np.where(upper & lower, 0.0, np.where(upper, pressure, np.where(lower, -pressure, 0.0)))
    return np.maximum(wrong, 0.0)


def _complementarity(bounds: Bounds, state: ContactState, size: float) -> Array:
    gap = np.maximum(-bounds.beyond(state.normal), 0.0)
    return np.minimum(np.abs(state.contact_pressure), gap / size)


def _inclusion(state: ContactState) -> float:
    pairs = [law.distance / law.term.traction_scale for law in state.laws]
    return max((float(np.max(p, initial=0.0)) for p in pairs), default=0.0)


def _inclusion_true(states: Sequence[ContactState]) -> tuple[float, float]:
    """Largest distance from the unsmoothed laws, relative to the law's scale, and in units of p0."""
    worst = absolute = 0.0
    for law in (law for state in states for law in state.laws):
        size = float(np.max(np.where(law.hidden, 0.0, law.true_distance()), initial=0.0))
        worst, absolute = max(worst, size / law.term.traction_scale), max(absolute, size)
    return worst, absolute
