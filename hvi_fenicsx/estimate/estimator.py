"""A posteriori error estimation: how far u_h is from the solution of the inequality, by cause and by cell.

Errors are of the energy norm |||v||| = a(v, v)^½, which no rigid motion changes. Discretisation: the defect in the
bubbles that complete the space to twice its degree, under the inequality's own constraints (docs/estimator.md).
Smoothing, algebraic: dual norms of what the smoothed law and the solver leave in the discrete equations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from dolfinx import fem

from ..certify.certificate import Examination
from ..certify.contact_state import ContactState, LawState
from ..laws import Superpotential
from ..problem.problem import Problem
from ..runtime.log import percent
from ..runtime.mpi import agree, total
from ..system.multigrid import Levels
from ..system.system import System
from ..typing import Array
from . import data_errors, defect, dual_norm, part_ends
from .bubbles import DEFAULT, BubbleStiffness, collected
from .dual_norm import DualNorm
from .law_traces import ErrorField, LawSprings, LawTraces
from .traces import Trace


@dataclass(frozen=True, repr=False)
class Estimate:
    """Estimated errors in the energy norm, nondimensional (energies in units of :attr:`.Scales.energy`).

    Attributes:
        cells: η_K of the cells that this rank owns, Σ η_K² = discretisation² over all ranks.
        discretisation: the mesh's error.
        smoothing: the smoothed laws' error, 0 for exact ones.
        algebraic: the solver's error.
        energy_norm: |||u_h|||.
        field: the whole estimated error, where nodes and bubbles were found together and no law is smoothed.
    """

    cells: Array
    discretisation: float
    smoothing: float
    algebraic: float
    energy_norm: float
    field: ErrorField | None = None

    def __getstate__(self) -> dict[str, object]:
        """What is pickled: the numbers, not the field, which belongs to a mesh."""
        return {**self.__dict__, "field": None}

    @property
    def total(self) -> float:
        """All three; the last two are errors within the space, to which the first is orthogonal."""
        return float(np.sqrt(self.discretisation**2 + self.smoothing**2 + self.algebraic**2))

    @property
    def relative(self) -> float:
        """The total over |||u_h|||; infinite where u_h is a rigid motion and the error is not 0."""
        return ratio(self.total, self.energy_norm)

    @property
    def coarse(self) -> bool:
        """Whether the mesh's error is so large that the numbers are rough."""
        return ratio(self.discretisation, self.energy_norm) > DEFAULT.coarse

    def as_dict(self) -> dict[str, float]:
        """The numbers by name, nondimensional."""
        names = ("relative", "total", "discretisation", "smoothing", "algebraic", "energy_norm")
        return {name: float(getattr(self, name)) for name in names}

    def __repr__(self) -> str:
        return f"Estimate({', '.join(f'{name}={value:.3g}' for name, value in self.as_dict().items())})"


def estimate(system: System, levels: Levels, u: fem.Function, examination: Examination) -> Estimate:
    """Estimate the error of a displacement. Collective.

    Args:
        system: what was solved.
        levels: its coarser levels; none where there is no mesh hierarchy.
        u: its solution, nondimensional, ghosts updated.
        examination: of the same u.
    """
    problem = system.problem
    traces = LawTraces(problem, u, examination.states, exact=False)
    inverse = DualNorm(system, levels, u)
    energy = _energy(problem, u, examination)
    field, cells = _discretisation(traces, inverse, energy)
    cells += data_errors.squares(problem, traces.bubbles, examination.states)
    cells += part_ends.squares(problem, traces.bubbles, u, examination, inverse)
    smoothed = any(term.law != term.exact for term in problem.terms)
    smoothing = inverse.solve(dual_norm.law_forces(problem, examination.states, exact=True))[1] if smoothed else 0.0
    _, algebraic = inverse.solve(dual_norm.algebraic(problem, examination), DEFAULT.rough_tolerance[0])
    inverse.destroy()
    comm = problem.comm
    beyond = dual_norm.penetration_energy(problem, examination.states)
    squares = {
        "discretisation": total(comm, float(cells.sum())),
        "smoothing": smoothing**2,
        "algebraic": algebraic**2 + beyond,
        "energy_norm": energy,
    }
    norms = {k: float(np.sqrt(s)) if s > DEFAULT.rounding**2 else 0.0 for k, s in squares.items()}
    return Estimate(cells=np.sqrt(cells), field=None if smoothed else field, **norms)


def _discretisation(traces: LawTraces, inverse: DualNorm, energy: float) -> tuple[ErrorField | None, Array]:
    """The error, where it is known as a field, and η_K² of the owned cells; a(u_h, u_h) is the energy. Collective."""
    if traces.problem.bulk.averaged:
        return None, defect.squares(traces, inverse)
    stiffness, limit = BubbleStiffness(traces.problem, traces.bubbles), DEFAULT.coupled[traces.degree - 1]
    if limit and not within_facets(traces):
        cells = _between_nodes(traces, inverse, stiffness)
        if total(traces.problem.comm, float(cells.sum())) <= limit**2 * energy:
            return None, cells
    return of_solution(traces, inverse, stiffness)


def _between_nodes(traces: LawTraces, inverse: DualNorm, stiffness: BubbleStiffness) -> Array:
    """η_K² of the owned cells: of the bubbles, and of the nodal forces that the laws are taken for. Collective."""
    problem, bubbles = traces.problem, fem.Function(traces.bubbles)
    least = defect.LeastEnergy(traces, bubbles, stiffness)
    least.find()
    cells = problem.bulk.energy_by_cell(bubbles)
    if problem.terms:
        cells += problem.bulk.energy_by_cell(inverse.solve(least.unmet)[0])
    return cells


def _energy(problem: Problem, u: fem.Function, examination: Examination) -> float:
    """a(u, u). Collective."""
    internal = examination.forces.reaction + examination.forces.load
    return total(problem.comm, float(problem.relative(u.x.array)[: internal.size] @ internal.ravel()))


def warnings(errors: Estimate) -> tuple[str, ...]:
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


def within_facets(traces: LawTraces) -> bool:
    """Whether a law, as it is solved, drops between the nodes of a facet. Collective."""
    found = [
        bool(np.any(heights(traces.part(state.surface, law.term.directions), law, law.term.law)))
        for state in traces.states
        for law in state.laws
    ]
    return any(agree(traces.problem.comm, any(found)))


def heights(points: Trace, law: LawState, of: Superpotential) -> Array:
    """By how much the law drops within each facet, (f,). Collective.

    Args:
        points: of the law's part.
        law: its state.
        of: the law, as it is or as it is solved.
    """
    ends = points.interpolated(law.argument[:, None], "at_ends", along=not law.term.radial)[:, :, 0]
    low, high = ends.min(axis=1, initial=np.inf), ends.max(axis=1, initial=-np.inf)
    height = np.zeros(len(ends))
    for kink, jump in zip(of.concave.kinks, of.concave.jumps, strict=True):
        height += jump * ((low < kink) & (kink < high))
    return height


class Coupled:
    """The forms and constraints of bubbles and nodes that are found together. Creation is collective.

    Args:
        traces: the laws between the nodes.
        inverse: of the system.
        stiffness: of the bubbles.

    Attributes:
        error: as it is known so far.
    """

    def __init__(self, traces: LawTraces, inverse: DualNorm, stiffness: BubbleStiffness) -> None:
        problem, space = traces.problem, traces.bubbles
        self._traces, self._inverse = traces, inverse
        self._longest = 0.0
        self.error = ErrorField(fem.Function(problem.space), fem.Function(space))
        self._least = defect.LeastEnergy(traces, self.error.bubbles, stiffness)
        self._moved = fem.Function(problem.space)
        self._of_moved = problem.bulk.force_in(space, self._moved)
        self._of_bubbles = problem.bulk.force_in(problem.space, self.error.bubbles)
        self._shared, self._strongest = 0.0, 0.0
        self._force: Array = np.zeros_like(self._least.unmet)
        self._answer: Array = self._force

    @property
    def size(self) -> float:
        """The energy norm of the error. Collective."""
        problem = self._traces.problem
        relative = problem.relative(self.error.nodes.x.array)[: self._force.size]
        of_nodes = total(problem.comm, float(np.vdot(relative, self._force)))
        return float(np.sqrt(max(self._least.energy + 2 * self._shared + of_nodes, 0.0)))

    def find_bubbles(self) -> None:
        """Find the bubbles that belong to the nodes. Collective."""
        self._least.find_beside(LawSprings(self._traces, self.error))

    def move_nodes(self) -> None:
        """Move the nodes as the bubbles ask; the laws answer that, so it takes a few rounds. Collective."""
        traces, inverse, nodes = self._traces, self._inverse, self.error.nodes
        np.negative(nodes.x.array, out=self._moved.x.array)
        of_bubbles = self._of_bubbles.values()
        asked = traces.problem.combined(of_bubbles)
        for number in range(DEFAULT.rounds):
            _, laws = traces.tested(self.error)
            if self._settled(laws) and number > 0:
                break
            step, length = inverse.solve(laws - asked - self._force, DEFAULT.rough_tolerance[1])
            nodes.x.array[:] += step.x.array
            self._force = inverse.force(nodes)
            self._longest = max(self._longest, length)
            if length <= DEFAULT.answer_change * self._longest:
                break
        if inverse.keep_within_bounds(nodes):
            self._force = inverse.force(nodes)
        self._moved.x.array[:] += nodes.x.array
        work = float(np.vdot(nodes.x.array[: of_bubbles.size], of_bubbles))
        self._shared = total(traces.problem.comm, work)

    def _settled(self, laws: Array) -> bool:
        """Whether the laws' force on the nodes is nearly the one before. Collective."""
        comm = self._traces.problem.comm
        changed = np.sqrt(total(comm, float(np.sum((laws - self._answer) ** 2))))
        self._answer, self._strongest = laws, max(self._strongest, changed)
        return bool(changed <= DEFAULT.coupled_change * self._strongest)

    def tell_bubbles(self) -> None:
        """Let the bubbles feel that nodes and laws have moved. Collective."""
        self._least.residual += self._least.laws
        self._least.laws, _ = self._traces.tested(self.error)
        self._least.residual -= self._least.laws
        self._least.residual -= self._of_moved.values()


def of_solution(traces: LawTraces, inverse: DualNorm, stiffness: BubbleStiffness) -> tuple[ErrorField, Array]:
    """Bubbles and nodes in turns, each under the influence of the other, until their energy settles. Collective.

    Args:
        traces: the laws between the nodes.
        inverse: of the system.
        stiffness: of the bubbles.

    Returns:
        The estimated error, and η_K² of the owned cells.
    """
    coupled, size = Coupled(traces, inverse, stiffness), 0.0
    for _ in range(DEFAULT.coupled_rounds):
        coupled.find_bubbles()
        coupled.move_nodes()
        before, size = size, coupled.size
        if abs(size - before) <= DEFAULT.coupled_change * size:
            break
        coupled.tell_bubbles()
    error = coupled.error
    del coupled  # it is large
    return error, traces.problem.bulk.energy_by_cell(error.nodes + error.bubbles)


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
    error = known or of_solution(traces, inverse, BubbleStiffness(system.problem, traces.bubbles))[0]
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
    dropped = []
    for state in traces.states:
        for law in state.laws:
            points, tau = _drops(traces, state, law)
            dropped.append(points.with_nodes(tau))
            count += int(np.count_nonzero(np.any(tau, axis=(1, 2))))
    field, _ = inverse.solve(collected(problem.space, dropped))
    field.x.array[:] /= np.sqrt(max(problem.comm.allreduce(count), 1))
    return field


def _drops(traces: LawTraces, state: ContactState, law: LawState) -> tuple[Trace, Array]:
    """A law's drops on the facets within which they lie, spread over their uncertain share of them, (f, q, k)."""
    points = traces.part(state.surface, law.term.directions)
    height = heights(points, law, law.term.exact)
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
    solved, found = traces.of_u(state, law), traces.of_law(state, law, error)
    fields = found - solved.nodal, traces.of_law(state, law, ErrorField(further, error.bubbles)) - found, solved.nodal
    tangents = state.slip.shape[1]
    known, unknown, carried = (
        float(np.sum(solved.points.weights * np.linalg.norm(values[:, :, -tangents:], axis=2))) for values in fields
    )
    return known, unknown, carried
