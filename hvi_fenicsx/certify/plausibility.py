"""Warnings of a solution: numbers that are not plausible; :mod:`.plausible_problem` has those before it is solved."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np
from dolfinx import fem

from ..effects import Direction
from ..problem.problem import Problem
from ..runtime.mpi import largest, total
from ..runtime.terminal import percent
from ..typing import Array
from . import scene_keys
from .certificate import Examination
from .contact_state import ContactState
from .estimate.contact_errors import ratio
from .estimate.estimator import Estimate
from .law_state import LawState
from .thresholds import DEFAULT, PLAUSIBILITY, PlausibilityThresholds


def of_solution(
    problem: Problem, examination: Examination, u: fem.Function, thresholds: PlausibilityThresholds = PLAUSIBILITY
) -> tuple[str, ...]:
    """What there is to warn of in a solution, in sentences. Collective; the same on all ranks.

    Args:
        problem: as composed.
        examination: its state at u.
        u: the displacement, nondimensional.
        thresholds: what is plausible.
    """
    warnings = [*_strain(problem, u, thresholds)]
    if examination.certificate.passed:
        size = largest(problem.domain.mesh.comm, float(np.max(np.abs(u.x.array), initial=0.0)))
        warnings += _dips(problem, examination, size, thresholds)
        for state in examination.states:
            warnings += _distant_obstacle(problem, state, size, thresholds)
            for law in state.laws:
                warnings += _slip_and_kink(problem, law, thresholds)
                warnings += _wide_smoothing(problem, law, thresholds)
    return tuple(warnings)


def of_estimate(errors: Estimate) -> tuple[str, ...]:
    """What there is to warn of in an estimated error, in sentences. Local; the same on all ranks.

    Args:
        errors: of the solution.
    """
    if not errors.coarse:
        return ()
    share = ratio(errors.discretisation, errors.energy_norm)
    size = f"{percent(share)} of the solution" if np.isfinite(share) else "as large as the solution"
    return (
        f"the mesh is coarse: its estimated error is {size} in the energy norm, although the equations on this mesh "
        "are solved and certified; refine the mesh",
    )


def _strain(problem: Problem, u: fem.Function, thresholds: PlausibilityThresholds) -> Iterator[str]:
    """By the edges: of P1, the strain along an edge is its change of length over its length."""
    comm, scales, d = problem.domain.mesh.comm, problem.scales, problem.scales.dimension
    values = u.x.array.reshape(-1, d)
    size = np.sqrt(d) * largest(comm, float(np.max(np.abs(values), initial=0.0))) * scales.displacement
    shortest = problem.once("shortest edge", None, lambda: _shortest_edge(problem))
    if 2.0 * size <= thresholds.largest_strain * shortest:
        return
    most = 0.0
    for edge, change in zip(_along_edges(problem, problem.points[:, :d]), _along_edges(problem, values), strict=True):
        along = np.abs(np.einsum("nd,nd->n", edge, change)) / np.einsum("nd,nd->n", edge, edge)
        most = max(most, float(np.max(along, initial=0.0)))
    strain = largest(comm, most) * scales.displacement
    if strain > thresholds.largest_strain:
        yield f"the largest strain is {strain:.3g}, where small strains are assumed; is the modulus in N/m²?"


def _shortest_edge(problem: Problem) -> float:
    """The shortest edge of all cells, m. Collective."""
    edges = _along_edges(problem, problem.points[:, : problem.scales.dimension])
    shortest = min(float(np.min(np.einsum("nd,nd->n", edge, edge), initial=np.inf)) for edge in edges)
    return float(np.sqrt(-largest(problem.domain.mesh.comm, -shortest)))


def _along_edges(problem: Problem, values: Array) -> Iterator[Array]:
    """The difference of vectors (nodes, d) between the ends of each edge of the cells, (cells, d)."""
    d = problem.scales.dimension
    corners = np.take(values, problem.space.dofmap.list[:, : d + 1], axis=0)
    for a, b in combinations(range(d + 1), 2):
        yield corners[:, b] - corners[:, a]


def _dips(problem: Problem, examination: Examination, size: float, thresholds: PlausibilityThresholds) -> Iterator[str]:
    """A penetration between the nodes that is not small."""
    dip = examination.between_nodes
    if dip is not None and dip > thresholds.negligible * size > 0:
        yield (
            f"between the nodes of Γc, where nothing bounds it, a body goes {dip * problem.scales.displacement:.3g} m "
            f"beyond its bound, {dip / size:.1e} of the largest displacement; a finer mesh there makes it smaller"
        )


def _distant_obstacle(
    problem: Problem, state: ContactState, size: float, thresholds: PlausibilityThresholds
) -> Iterator[str]:
    """An obstacle that nothing comes near."""
    comm = problem.domain.mesh.comm
    if state.bounds is None:
        return
    gap = -largest(comm, -float(np.min(state.bounds.upper, initial=np.inf)))
    if np.isfinite(gap) and thresholds.negligible * gap > size > 0:
        metres, displacement = (value * problem.scales.displacement for value in (gap, size))
        yield (
            f"{scene_keys.of_bounds(problem, state.surface.part)}: the gap is {metres:.3g} m at least and the largest "
            f"displacement {displacement:.3g} m: it is never closed; is it in m?"
        )


def _slip_and_kink(problem: Problem, law: LawState, thresholds: PlausibilityThresholds) -> Iterator[str]:
    """A law whose kinks are of another order than what the solution does to it."""
    comm, term, far = problem.domain.mesh.comm, law.term, 1.0 / thresholds.negligible
    kink, reached, weights = term.exact.length_scale, np.abs(law.argument), term.weights
    if term.exact.is_linear or np.any(term.exact.kinks == 0.0):
        return
    if term.direction in (Direction.OPENING, Direction.PENETRATION):
        reached = np.where(law.argument > 0, reached, 0.0)
    most = largest(comm, float(np.max(reached, initial=0.0)))
    beyond = total(comm, float(weights[reached > far * kink].sum())) / total(comm, float(weights.sum()))
    metres = problem.scales.displacement * largest(comm, float(np.max(term.stretch, initial=0.0)))
    what = "slip" if term.direction is Direction.SLIP else term.direction.value
    sizes = f"{most * metres:.3g} m, the law's first kink {kink * metres:.3g} m"
    if DEFAULT.near < most < kink / far:
        yield (
            f"{scene_keys.of_law(problem, term)}: the largest {what} is {sizes}: "
            "the law is on its first piece everywhere; are the law's displacements in m?"
        )
    elif beyond > thresholds.nearly_all:
        yield (
            f"{scene_keys.of_law(problem, term)}: the {what} is up to {sizes}: "
            "the law is far beyond it nearly everywhere; are the law's displacements in m?"
        )


def _wide_smoothing(problem: Problem, law: LawState, thresholds: PlausibilityThresholds) -> Iterator[str]:
    """A smoothing so wide that the law which is solved is another one."""
    comm, term = problem.domain.mesh.comm, law.term
    if term.law is term.exact:
        return
    peak = max(term.exact.peak.minus, term.exact.peak.plus)
    away, weights, limit = law.true_distance(), term.weights, thresholds.smoothing_change
    share = total(comm, float(weights[away > limit * peak].sum())) / total(comm, float(weights.sum()))
    if share > thresholds.smoothing_share:
        most, of_peak = (largest(comm, float(np.max(v, initial=0.0))) for v in (away * term.multiplier, away / peak))
        yield (
            f"{scene_keys.of_law(problem, term)}: smoothing changes the traction by up to "
            f"{most * problem.scales.stress:.3g} N/m² ({percent(of_peak)} of the law's peak), "
            f"and by more than {100 * limit:.0f} % on "
            f"{percent(share)} of the part; is a smaller ε meant? (epsilon_absolute is in N/m)"
        )
