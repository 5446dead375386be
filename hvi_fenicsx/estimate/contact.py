"""The estimated errors of the slip and of -σ_t on Γc: the defect's influence on the vertices, by the system's inverse.

The bubbles e of the defect say what a finer mesh would add between the vertices. Tested with P1 functions, they and the
laws between the vertices leave a force on u_h, and what moves under it is the error at the vertices.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import ufl
from dolfinx import fem

from ..boundary import State
from ..certificate import Examined
from ..effects.base import Direction
from ..parallel import total
from ..problem import Problem
from ..system import System
from . import bubbles, defect
from .bubbles import assembled
from .dual import Dual
from .traces import Along, Change, law, pointwise

Array = npt.NDArray[np.float64]
_TIMES, _ROUNDS = 2, 4
_SETTLED = 0.05
"""Of the correction's energy norm, what a further round may change."""


@dataclass(frozen=True)
class OnContact:
    """Estimated errors on Γc, relative: of the slip in L2, of -σ_t in L1 (0 without a law along Γc).

    ``moved`` is u_h with its estimated error at the vertices, nondimensional.
    """

    slip: float
    friction: float
    moved: fem.Function


def on_contact(system: System, u: fem.Function, examined: Examined) -> OnContact:
    """Estimate the errors of slip and -σ_t, what smoothing changes included. Collective.

    Args:
        system, u, examined: as in :func:`.estimate`.

    Nearly incompressible regions are not for this: their averaged pressure is not in the bubbles' force.
    """
    change = _change(system, u, examined)
    slips = [_slip(system.problem, state, u, change) for state in examined.states]
    tractions = [
        _traction(system.problem, state, number, u, change)
        for state in examined.states
        for number, term in enumerate(state.terms)
        if term.direction is Direction.SLIP
    ]
    comm = system.comm
    apart, whole = (total(comm, sum(pair[i] for pair in slips)) for i in (0, 1))
    away, carried = (total(comm, sum(pair[i] for pair in tractions)) for i in (0, 1))
    change.vertices.x.array[:] += u.x.array
    return OnContact(float(np.sqrt(_over(apart, whole))), _over(away, carried), change.vertices)


def _over(part: float, whole: float) -> float:
    return part / whole if whole > 0 else (np.inf if part > 0 else 0.0)


def _change(system: System, u: fem.Function, examined: Examined) -> Change:
    """The defect with its influence on the vertices and, from the second time on, theirs on it. Collective."""
    problem, inverse = system.problem, Dual(system, u)
    space, moved = bubbles.space(problem.domain.mesh), fem.Function(problem.space)
    change = None
    for _ in range(_TIMES):
        edges, _ = pointwise(problem, space, u, examined.states, change)
        load = defect.residual(problem, u, space) - edges - _internal(problem, space, moved)
        change = Change(moved, defect.least(problem, u, space, load))
        _answer(problem, u, examined, inverse, change)
    inverse.destroy()
    assert change is not None
    return change


def _answer(problem: Problem, u: fem.Function, examined: Examined, inverse: Dual, change: Change) -> None:
    """Move the vertices as the bubbles ask; the laws answer that, so it takes a few rounds. Collective."""
    size = 0.0
    for _ in range(_ROUNDS):
        _, laws = pointwise(problem, change.edges.function_space, u, examined.states, change)
        felt = [_internal(problem, problem.space, part) for part in (change.vertices, change.edges)]
        step, length = inverse.solve(laws - felt[0] - felt[1])
        change.vertices.x.array[:] += step.x.array
        size = max(size, length)
        if length <= _SETTLED * size:
            break


def _internal(problem: Problem, space: fem.FunctionSpace, u: fem.Function) -> Array:
    """a(u, v) for the test functions of a space, owned blocks (n, d). Collective."""
    test, trial = problem.bilinear.arguments()
    form = ufl.replace(problem.bilinear, {test: ufl.TestFunction(space), trial: u})
    return assembled(form)


def _slip(problem: Problem, state: State, u: fem.Function, change: Change) -> tuple[float, float]:
    """∫ of the squares of the slip's change and of the slip over this rank's share of a part. Collective."""
    along = Along(problem, change.edges.function_space, state.surface, state.surface.tangents)
    added, slip = along.linear(change.vertices) + along.quadratic(change.edges), along.linear(u)
    squares = [float(np.sum(along.weights * np.sum(values**2, axis=2))) for values in (added, slip)]
    return squares[0], squares[1]


def _traction(problem: Problem, state: State, number: int, u: fem.Function, change: Change) -> tuple[float, float]:
    """∫ of the law's change against the interpolated nodal tractions, and of those, likewise. Collective."""
    along, nodal, tau = law(problem, change.edges.function_space, u, state, number, change)
    sizes = [float(np.sum(along.weights * np.linalg.norm(values, axis=2))) for values in (tau - nodal, nodal)]
    return sizes[0], sizes[1]
