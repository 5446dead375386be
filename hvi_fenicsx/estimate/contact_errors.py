"""The estimated errors of the slip and of -σ_t on Γc: the defect's influence on the nodes, by the system's inverse.

The bubbles e of the defect say what a finer mesh would add between the nodes. Tested with the functions of u_h's space,
they and the laws between the nodes leave a force on u_h; the displacement that it causes is the error at the nodes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from dolfinx import fem, la

from ..certify.certificate import Examination
from ..certify.contact_state import ContactState
from ..certify.law_state import LawState
from ..runtime.mpi import total
from ..system.multigrid import Levels
from ..system.system import System
from ..typing import Array
from . import coupled_errors
from .bubbles import BubbleStiffness
from .dual_norm import DualNorm
from .law_traces import ErrorField, LawTraces
from .traces import Trace

_PLACE = 1 / (2 * np.sqrt(12))
"""Standard deviation, over the distance of two nodes, of the place of a drop that may be anywhere in half of it."""


@dataclass(frozen=True)
class ContactErrors:
    """Estimated errors on Γc, relative.

    Attributes:
        slip: of the slip in L2.
        friction: of -σ_t in L1; 0 without a law along Γc.
        corrected: u_h with its estimated error at the nodes, nondimensional.
    """

    slip: float
    friction: float
    corrected: fem.Function


def estimate_contact_errors(
    system: System,
    levels: Levels,
    u: fem.Function,
    examination: Examination,
    known: ErrorField | None = None,
) -> ContactErrors:
    """Estimate the errors of slip and -σ_t, what smoothing changes included. Collective.

    Nearly incompressible regions are not for this: their averaged pressure is not in the bubbles' force.

    Args:
        system: what was solved.
        levels: its coarser levels; none where there is no mesh hierarchy.
        u: its solution, nondimensional, ghosts updated.
        examination: of the same u.
        known: the estimated error, where it is known as a field (:attr:`.Estimate.field`).
    """
    traces = LawTraces(system.problem, u, examination.states, exact=True)
    inverse = DualNorm(system, levels, u)
    error = known or coupled_errors.of_solution(traces, inverse, BubbleStiffness(system.problem, traces.bubbles))[0]
    uncertain = _uncertainty(traces, inverse)
    inverse.destroy()
    slips = [_slip(traces, state, error, uncertain) for state in examination.states]
    frictions = [
        _friction(traces, state, law, error, uncertain)
        for state in examination.states
        for law in state.laws
        if law.term.direction.tangential
    ]
    comm = system.comm
    apart, whole = (total(comm, sum(pair[i] for pair in slips)) for i in (0, 1))
    seen, unseen, carried = (total(comm, sum(sizes[i] for sizes in frictions)) for i in (0, 1, 2))
    away = float(np.hypot(seen, unseen))
    corrected = fem.Function(system.problem.space)
    corrected.x.array[:] = error.nodes.x.array + u.x.array
    return ContactErrors(float(np.sqrt(ratio(apart, whole))), ratio(away, carried), corrected)


def ratio(part: float, whole: float) -> float:
    """Part over whole; infinite where only the whole is 0, and 0 where both are.

    Args:
        part: not negative.
        whole: not negative.
    """
    return part / whole if whole > 0 else (np.inf if part > 0 else 0.0)


def _uncertainty(traces: LawTraces, inverse: DualNorm) -> fem.Function:
    """What the nodes may move because bubbles do not see where between two nodes a drop lies. Collective.

    The facets' places are independent of each other, so n of them add up to a root of n times the effect of one.
    """
    problem, count = traces.problem, 0
    d, comm, force = problem.scales.dimension, problem.domain.mesh.comm, fem.Function(problem.space)
    for state in traces.states:
        for law in state.laws:
            points, tau = _drops(traces, state, law)
            dropped = points.tested(tau)[1]
            force.x.array.reshape(-1, d)[dropped.blocks] += dropped.values
            count += int(np.count_nonzero(np.any(tau, axis=(1, 2))))
    force.x.scatter_reverse(la.InsertMode.add)
    owned = problem.space.dofmap.index_map.size_local
    field, _ = inverse.solve(force.x.array.reshape(-1, d)[:owned])
    field.x.array[:] /= np.sqrt(max(comm.allreduce(count), 1))
    return field


def _drops(traces: LawTraces, state: ContactState, law: LawState) -> tuple[Trace, Array]:
    """A law's drops on the facets within which they lie, spread over their uncertain share of them, (f, q, k)."""
    points = traces.part(state.surface, law.term.directions)
    height = coupled_errors.heights(points, law, law.term.exact)
    slip = points.of_field(traces.u)
    along = law.term.gradient(slip.reshape(-1, slip.shape[2])).reshape(slip.shape) if law.term.radial else np.sign(slip)
    multiplier = points.interpolated(law.term.multiplier[:, None])
    return points, _PLACE / traces.degree * height[:, None, None] * multiplier * along


def _slip(traces: LawTraces, state: ContactState, error: ErrorField, uncertain: fem.Function) -> tuple[float, float]:
    """∫ of the squares of the slip's error and of the slip over this rank's share of a part. Collective."""
    points = traces.part(state.surface, state.surface.tangents)
    added, slip = points.of_field(error.nodes) + points.of_bubbles(error.bubbles), points.of_field(traces.u)
    fields = added, points.of_field(uncertain), slip
    squares = [float(np.sum(points.weights * np.sum(values**2, axis=2))) for values in fields]
    return squares[0] + squares[1], squares[2]


def _friction(
    traces: LawTraces, state: ContactState, law: LawState, error: ErrorField, uncertain: fem.Function
) -> tuple[float, float, float]:
    """∫ of the law's change against the interpolated nodal tractions, of its uncertainty, of those. Collective."""
    further = fem.Function(traces.problem.space)
    further.x.array[:] = error.nodes.x.array + uncertain.x.array
    found = traces.of_law(state, law, error)
    other = traces.of_law(state, law, ErrorField(further, error.bubbles))
    fields = found.traction - found.nodal, other.traction - found.traction, found.nodal
    tangents = state.slip.shape[1]
    known, unknown, carried = (
        float(np.sum(found.points.weights * np.linalg.norm(values[:, :, -tangents:], axis=2))) for values in fields
    )
    return known, unknown, carried
