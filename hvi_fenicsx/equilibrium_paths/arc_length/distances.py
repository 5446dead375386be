"""How far a state is from the graphs of its laws and bounds: what certifies it on Γc, apart from how it was found."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from ...system.condensed_problem import CondensedProblem
from ...typing import Array
from ..state import PathState
from .felt import factors, felt
from .vertex_laws import VertexLaw, vertex_laws

_ROUNDING = 1e-10
"""A displacement this near to a break of a law, or to a bound, may be there, relative to itself and to lengths."""


class CurvedDistances:
    """The distances of the states of one path.

    Args:
        problem: the problem.
        remember: numbers of the problem's bonds that remember.
    """

    def __init__(self, problem: CondensedProblem, remember: Collection[int]) -> None:
        self._factors = factors(problem)
        self._problem = felt(problem, self._factors)
        self._laws = vertex_laws(self._problem, remember)

    def __call__(self, state: PathState, carried: Array | None = None) -> float:
        """The largest distance, relative to the forces.

        Args:
            state: the state.
            carried: forces of laws and bounds, (n,); by default what the condensed body leaves them.
        """
        if state.memory is not None:
            for row, law in enumerate(self._laws):
                law.restore(state.memory[row, :])
        problem, x = self._problem, state.x * self._factors
        elastic, load = problem.stiffness @ x, problem.load(state.factor)
        size = max(float(np.max(np.abs(f), initial=0.0)) for f in (elastic, load, problem.force_rate)) or 1.0
        return self._largest(x, load - elastic if carried is None else carried / self._factors) / size

    def _largest(self, x: Array, force: Array) -> float:
        """The largest distance of a force that laws and bounds should give."""
        low, high, worst = np.zeros(len(x)), np.zeros(len(x)), 0.0
        rest = force.copy()
        for law in self._laws:
            if law.radial:
                group = list(law.unknowns)
                lower = self._problem.lower[group[0]] if law.opens else -np.inf
                worst = max(worst, _off(law, x[group], force[group], float(lower)))
                rest[group] = 0.0
            else:
                least, most = _interval(law, float(x[law.unknowns[0]]))
                low[law.unknowns[0]] += least
                high[law.unknowns[0]] += most
        problem = self._problem
        allowed = _ROUNDING * float(np.max(np.abs(x), initial=0.0))
        low[x <= problem.lower + allowed], high[x >= problem.upper - allowed] = -np.inf, np.inf
        beyond = np.maximum(np.maximum(problem.lower - x, x - problem.upper), 0.0) * np.diag(problem.stiffness)
        away = np.maximum(np.maximum(low - rest, rest - high), 0.0) + beyond
        return max(worst, float(np.max(away, initial=0.0)))


def _interval(law: VertexLaw, x: float) -> tuple[float, float]:
    """The least and the greatest force at a coordinate, but for its rounding."""
    near = _ROUNDING * (abs(x) + law.law.length_scale)
    ends = [float(law.traction(np.array([x + s * near]), side)[0]) for s, side in ((-1.0, "left"), (1.0, "right"))]
    return law.weight * min(ends), law.weight * max(ends)


def _off(law: VertexLaw, u: Array, force: Array, lower: float) -> float:
    """How far a force is from those that a law on a length gives: along u, of a size of its graph.

    An opening that is not positive has none, but for what its bound pushes.
    """
    near = _ROUNDING * (float(np.max(np.abs(u))) + law.law.length_scale)
    force, pushed = force.copy(), 0.0
    if law.opens and u[0] <= near:
        if u[0] <= lower + near:
            force[0] = max(force[0], 0.0)
        pushed, force[0] = max(-float(force[0]), 0.0), max(float(force[0]), 0.0)
        u = np.array([0.0, *u[1:]])
    length = float(np.linalg.norm(u))
    least, most = (_energy(law, u) * end for end in _interval(law, length))
    if length <= _ROUNDING * law.law.length_scale:
        return max(float(np.linalg.norm(force)) - max(abs(least), abs(most)), 0.0) + pushed
    along = float(force @ u) / length
    across = float(np.linalg.norm(force - along * u / length))
    return max(least - along, along - most, 0.0) + across + pushed


def _energy(law: VertexLaw, u: Array) -> float:
    """By what the mode mixity of a vector multiplies a law."""
    whole = float(u @ u)
    if law.mixity is None or not whole:
        return 1.0
    slips = u[1:] if law.opens else u
    return float(law.mixity.energy(np.array([float(slips @ slips) / whole]))[0])
