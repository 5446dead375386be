"""What looks odd in a scene or its solution, and what may be meant: units, mostly. Advice only; nothing is refused.

A number that is off by a factor of 1e3 or 1e6 gives a well-posed scene and a certified answer to another question. The
limits below are therefore wide: a scene that means what it says stays within them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations

import numpy as np
from dolfinx import fem
from petsc4py import PETSc

from ..effects import Direction
from ..problem.law_term import LawTerm
from ..problem.problem import Problem
from ..rigid import kernel, rigid_fields
from ..runtime.mpi import largest, total
from ..system import existence
from .certificate import Examination
from .contact_state import State
from .force_attribution import NEAR

LARGEST_STRAIN = 0.1
"""Small strains are assumed everywhere."""
MODULI = 1e3, 2e12
"""Young's moduli, N/m²: softer than a gel, stiffer than diamond."""
LARGEST_BODY = 200.0
"""m."""
WEAK = 0.01
"""A law's largest force over the load, below which it cannot matter."""
FAR = 100.0
"""Ratio of two lengths that have nothing to do with each other."""
BLURRED, SHARE = 0.1, 0.25
"""Change of a traction by smoothing over the law's peak, and the share of the part that has it."""
NEARLY_ALL = 0.9
"""Share of a part that counts as all of it: a vertex on a support does not slip."""
_KEYS = {Direction.SLIP: "friction", Direction.OPENING: "adhesion", Direction.PENETRATION: "support"}


def foreseen(problem: Problem, forces: Mapping[str, PETSc.Vec]) -> tuple[str, ...]:
    """What is odd before anything is solved, in sentences. Collective; the same on all ranks.

    Args:
        problem: as composed. forces: its load vectors by name, nondimensional.
    """
    return (*_of_scales(problem), *_weak_laws(problem, forces))


def found(problem: Problem, examination: Examination, u: fem.Function) -> tuple[str, ...]:
    """What is odd about what was found, in sentences. Collective; the same on all ranks.

    Args:
        problem: as composed. examination: its state at u. u: the displacement, nondimensional.
    """
    odd = [*_strain(problem, u)]
    if examination.certificate.passed:
        size = largest(problem.domain.mesh.comm, float(np.max(np.abs(u.x.array), initial=0.0)))
        for state in examination.states:
            odd += [*_distant(problem, state, size)]
            for index in range(len(state.terms)):
                odd += [*_slip_and_kink(problem, state, index), *_blurred(problem, state, index)]
    return tuple(odd)


def _of_scales(problem: Problem) -> Iterator[str]:
    scales, (soft, stiff) = problem.scales, MODULI
    strain = scales.stress / scales.modulus
    if not soft <= scales.modulus <= stiff:
        yield f"the largest Young's modulus is {scales.modulus:.3g} N/m²; is it in N/m²? (steel has 2.1e11)"
    if strain > LARGEST_STRAIN:
        yield (
            f"the load (or prescribed displacement, or thermal strain) is {strain:.3g} of Young's modulus, where small "
            "strains are assumed; are loads and modulus in N/m², displacements in m?"
        )
    if scales.length > LARGEST_BODY:
        yield f"the body is {scales.length:.4g} m long; is it in m? (for a mesh file in mm: scale = 1e-3)"


def _weak_laws(problem: Problem, forces: Mapping[str, PETSc.Vec]) -> Iterator[str]:
    comm = problem.domain.mesh.comm
    load = total(comm, sum(float(np.abs(force.array_r).sum()) for force in forces.values()))
    for term in problem.terms:
        peak = max(term.exact.peak.minus, term.exact.peak.plus)
        most = peak * total(comm, float(term.surface.weights.sum()))
        if most < WEAK * load and not _holds(problem, forces, term):
            unit = "N" if problem.scales.dimension == 3 else "N/m"
            yield (
                f"{_place(term)}: the law can carry {most * problem.scales.force:.3g} {unit} at most, "
                f"{most / load:.1e} of the load, and no rigid motion needs it: it cannot matter; are its tractions in "
                "N/m²?"
            )


def _holds(problem: Problem, forces: Mapping[str, PETSc.Vec], term: LawTerm) -> bool:
    """Whether a rigid motion that the supports leave works against the law. Collective."""
    comm, surface, work = problem.domain.mesh.comm, term.surface, 0.0
    for rigid in existence.rigid_problems(problem, forces):
        basis = kernel(comm, rigid.body, rigid.fixed)
        mine = existence.inside(problem, rigid.body, surface.blocks)
        fields = rigid_fields(np.asarray(surface.points[mine] / problem.scales.length), rigid.body)
        along = np.einsum("mkd,mnd,nj->mkj", term.directions[mine], fields, basis)
        work = max(work, float(np.max(np.abs(along), initial=0.0)))
    return largest(comm, work) > NEAR


def _strain(problem: Problem, u: fem.Function) -> Iterator[str]:
    """By the edges: of P1, the strain along an edge is its change of length over its length."""
    scales, d = problem.scales, problem.scales.dimension
    x, values = problem.points[:, :d], u.x.array.reshape(-1, d)
    most = 0.0
    for a, b in combinations(range(d + 1), 2):
        ends = problem.space.dofmap.list[:, [a, b]]
        edge, change = (v[ends[:, 1]] - v[ends[:, 0]] for v in (x, values))
        along = np.abs(np.sum(edge * change, axis=1)) / np.sum(edge**2, axis=1)
        most = max(most, float(np.max(along, initial=0.0)))
    strain = largest(problem.domain.mesh.comm, most) * scales.displacement
    if strain > LARGEST_STRAIN:
        yield f"the largest strain is {strain:.3g}, where small strains are assumed; is the modulus in N/m²?"


def _distant(problem: Problem, state: State, size: float) -> Iterator[str]:
    """An obstacle that nothing comes near."""
    comm = problem.domain.mesh.comm
    if state.bounds is None:
        return
    gap = -largest(comm, -float(np.min(state.bounds.upper, initial=np.inf)))
    if np.isfinite(gap) and gap > FAR * size > 0:
        metres, moved = (value * problem.scales.displacement for value in (gap, size))
        yield (
            f"boundary.{state.surface.part}.contact: the gap is {metres:.3g} m at least and the largest displacement "
            f"{moved:.3g} m: it is never closed; is it in m?"
        )


def _slip_and_kink(problem: Problem, state: State, index: int) -> Iterator[str]:
    """A law whose kinks are of another order than what the solution does to it."""
    comm, term = problem.domain.mesh.comm, state.terms[index]
    kink, reached, weights = term.exact.length_scale, np.abs(state.arguments[index]), state.surface.weights
    if term.exact.is_linear or np.any(term.exact.kinks == 0.0):
        return
    if term.direction is not Direction.SLIP:
        reached = np.where(state.arguments[index] > 0, reached, 0.0)
    most = largest(comm, float(np.max(reached, initial=0.0)))
    beyond = total(comm, float(weights[reached > FAR * kink].sum())) / total(comm, float(weights.sum()))
    u0, what = problem.scales.displacement, "slip" if term.direction is Direction.SLIP else term.direction.value
    if NEAR < most < kink / FAR:
        yield (
            f"{_place(term)}: the largest {what} is {most * u0:.3g} m, the law's first kink {kink * u0:.3g} m: the law "
            "is on its first piece everywhere; are the law's displacements in m?"
        )
    elif beyond > NEARLY_ALL:
        yield (
            f"{_place(term)}: the {what} is up to {most * u0:.3g} m, the law's first kink {kink * u0:.3g} m: the law "
            "is far beyond it nearly everywhere; are the law's displacements in m?"
        )


def _blurred(problem: Problem, state: State, index: int) -> Iterator[str]:
    """A smoothing so wide that the law which is solved is another one."""
    comm, term = problem.domain.mesh.comm, state.terms[index]
    if term.law is term.exact:
        return
    peak = max(term.exact.peak.minus, term.exact.peak.plus)
    away = term.exact.distance(state.arguments[index], state.tractions[index], NEAR)
    weights = state.surface.weights
    share = total(comm, float(weights[away > BLURRED * peak].sum())) / total(comm, float(weights.sum()))
    if share > SHARE:
        most = largest(comm, float(np.max(away, initial=0.0)))
        yield (
            f"{_place(term)}: smoothing changes the traction by up to {most * problem.scales.stress:.3g} N/m² "
            f"({100 * most / peak:.2g} % of the law's peak), and by more than {100 * BLURRED:.0f} % on "
            f"{100 * share:.2g} % of the part; is a smaller ε meant? (epsilon_absolute is in N/m)"
        )


def _place(term: LawTerm) -> str:
    return f"boundary.{term.surface.part}.{_KEYS[term.direction]}"
