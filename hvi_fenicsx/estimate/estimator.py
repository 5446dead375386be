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
from ..problem.problem import Problem
from ..runtime.log import percent
from ..runtime.mpi import total
from ..system.multigrid import Levels
from ..system.system import System
from ..typing import Array
from . import coupled_errors, data_errors, defect, dual_norm
from .bubbles import DEFAULT, BubbleStiffness
from .law_traces import ErrorField, LawTraces


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
        return coupled_errors.ratio(self.total, self.energy_norm)

    @property
    def coarse(self) -> bool:
        """Whether the mesh's error is so large that the numbers are rough."""
        return coupled_errors.ratio(self.discretisation, self.energy_norm) > DEFAULT.coarse

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
    inverse = dual_norm.DualNorm(system, levels, u)
    energy = _energy(problem, u, examination)
    field, cells = _discretisation(traces, inverse, energy)
    cells += data_errors.squares(problem, traces.bubbles, examination.states)
    cells += data_errors.squares_at_ends(problem, traces.bubbles, u, examination, inverse)
    smoothed = any(term.law != term.exact for term in problem.terms)
    smoothing = inverse.solve(dual_norm.smoothing(problem, examination.states))[1] if smoothed else 0.0
    _, algebraic = inverse.solve(dual_norm.algebraic(problem, examination), DEFAULT.rough_tolerance[0])
    inverse.destroy()
    comm = problem.domain.mesh.comm
    beyond = dual_norm.penetration_energy(problem, examination.states)
    squares = {
        "discretisation": total(comm, float(cells.sum())),
        "smoothing": smoothing**2,
        "algebraic": algebraic**2 + beyond,
        "energy_norm": energy,
    }
    norms = {name: _norm(square, DEFAULT.rounding) for name, square in squares.items()}
    return Estimate(cells=np.sqrt(cells), field=None if smoothed else field, **norms)


def _norm(square: float, rounding: float) -> float:
    """The root of what is more than rounding, else 0."""
    return float(np.sqrt(square)) if square > rounding**2 else 0.0


def _discretisation(traces: LawTraces, inverse: dual_norm.DualNorm, energy: float) -> tuple[ErrorField | None, Array]:
    """The error, where it is known as a field, and η_K² of the owned cells; a(u_h, u_h) is the energy. Collective."""
    if traces.problem.bulk.averages_dilatation:
        return None, defect.squares(traces, inverse)
    stiffness, limit = BubbleStiffness(traces.problem, traces.bubbles), DEFAULT.coupled[traces.degree - 1]
    if limit and not coupled_errors.within_facets(traces):
        cells = _between_nodes(traces, inverse, stiffness)
        if total(traces.problem.domain.mesh.comm, float(cells.sum())) <= limit**2 * energy:
            return None, cells
    return coupled_errors.of_solution(traces, inverse, stiffness)


def _between_nodes(traces: LawTraces, inverse: dual_norm.DualNorm, stiffness: BubbleStiffness) -> Array:
    """η_K² of the owned cells: of the bubbles, and of the nodal forces that the laws are taken for. Collective."""
    problem, u = traces.problem, traces.u
    load = problem.bulk.residual_in(traces.bubbles, u, problem.linear.values())
    between, unmet = traces.tested()
    load[between.blocks] -= between.values
    bubbles, under = fem.Function(traces.bubbles), defect.constraints(problem, u, traces.bubbles)
    defect.LeastEnergy(bubbles, stiffness, under, load).find()
    cells = problem.bulk.energy_by_cell(bubbles)
    if problem.terms:
        owned = problem.space.dofmap.index_map.size_local
        cells += problem.bulk.energy_by_cell(inverse.solve(unmet.everywhere(owned))[0])
    return cells


def _energy(problem: Problem, u: fem.Function, examination: Examination) -> float:
    """a(u, u). Collective."""
    internal = examination.forces.reaction + examination.forces.load
    return total(problem.domain.mesh.comm, float(problem.relative(u.x.array)[: internal.size] @ internal.ravel()))


def warnings(errors: Estimate) -> tuple[str, ...]:
    """What there is to warn of in an estimated error, in sentences. Local; the same on all ranks.

    Args:
        errors: of the solution.
    """
    if not errors.coarse:
        return ()
    share = coupled_errors.ratio(errors.discretisation, errors.energy_norm)
    size = f"{percent(share)} of the solution" if np.isfinite(share) else "as large as the solution"
    return (
        f"the mesh is coarse: its estimated error is {size} in the energy norm, although the equations on this mesh "
        "are solved and certified; refine the mesh",
    )
