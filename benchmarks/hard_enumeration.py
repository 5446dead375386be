"""Whether a small case has an equilibrium at all: all states of its floor's vertices, by branch and bound.

The assembled stiffness is condensed to the unknowns of the floor (:mod:`tests.enumeration` has the same idea on its own
assembly). Each of them is on one piece or one kink of its law or on its bound; each combination is one small linear
system and a check of signs. A state is given up when no point has it and all other unknowns in the hulls of the states
they have left, a small linear programme; what is left is branched on, the unknown with the fewest first. For tractions
that are piecewise linear: those of unsmoothed laws, and of laws smoothed by the quadratic plus function.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import hard_scenes
import numpy as np
import numpy.typing as npt
from covering import Case
from mpi4py import MPI
from scipy.optimize import linprog
from scipy.sparse import csr_matrix

from hvi_fenicsx.laws import Superpotential
from hvi_fenicsx.laws.polyline import PolylineLaw
from hvi_fenicsx.laws.smoothing import PlusSmoothedLaw
from hvi_fenicsx.problem.contact_surface import component_dofs
from hvi_fenicsx.system.system import System

Array = npt.NDArray[np.float64]
MOST = 4_000
"""Linear programmes of one case that are worth it: half a minute."""
LARGEST = 8
"""Cells along the floor."""
_OTHERS = ("exponential", "cohesion", "mixed")
"""Laws that are not piecewise linear on one unknown."""
_LP_ERROR = 1e-7
"""What a linear programme may be wrong by, of the largest load or displacement unit: for less it gives up nothing."""
_INFEASIBLE = 2
"""Status of ``scipy.optimize.linprog``."""
_SLACK, _SINGULAR = 1e-9, 1e-12
"""Rounding: relative to the largest load or displacement unit; to the largest eigenvalue of a body with supports."""


@dataclass(frozen=True)
class State:
    """An x held at ``low == high`` by a force from ``least`` to ``most``, or free, with ``at`` + ``slope`` x."""

    low: float
    high: float
    at: float = 0.0
    slope: float = 0.0
    least: float = 0.0
    most: float = 0.0

    @property
    def held(self) -> bool:
        return self.low == self.high

    @property
    def corners(self) -> list[tuple[float, float]]:
        """Finite ends of the graph (x, f); a point of it where there are none."""
        if self.held:
            ends = [f for f in (self.least, self.most) if np.isfinite(f)]
            return [(self.low, f) for f in ends]
        places = [x for x in (self.low, self.high) if np.isfinite(x)] or [0.0]
        return [(x, self.at + self.slope * x) for x in places]

    @property
    def rays(self) -> list[tuple[float, float]]:
        """Directions in which the graph has no end."""
        if self.held:
            return [(0.0, sign) for sign, f in ((-1.0, self.least), (1.0, self.most)) if not np.isfinite(f)]
        ends = ((-1.0, self.low), (1.0, self.high))
        return [(sign, sign * self.slope) for sign, x in ends if not np.isfinite(x)]

    def distance(self, x: float, f: float) -> float:
        """About how far (x, f) is from the graph."""
        nearest = float(np.clip(x, self.low, self.high))
        borne = float(np.clip(f, self.least, self.most)) if self.held else self.at + self.slope * nearest
        return abs(x - nearest) + abs(f - borne)


def fits(case: Case) -> bool:
    """Whether the laws' tractions are piecewise linear, one on each unknown, and the floor is short."""
    straight = case["smoothing"] in ("exact", "quadratic") and case["law"] not in _OTHERS
    plain = (case["body"], case["degree"], case["question"]) == ("plate", 1, "solve")
    return straight and plain and case["cells"] <= LARGEST


def equilibria(case: Case, data: Mapping[str, Any]) -> int | None:
    """Number of stationary points (those on an edge between states counted more than once); None if too many to try."""
    system = hard_scenes.prepare(case, data, "auto", MPI.COMM_SELF).system
    stiffness, load, dofs = _condensed(system)
    search = _Search(stiffness, load, [_states(system, int(dof)) for dof in dofs])
    try:
        return search.count()
    except _TooMany:
        return None


States = list[list[State]]


class _TooMany(Exception):
    """The search has taken more than MOST linear programmes."""


@dataclass
class _Search:
    """All combinations of ``states`` of which f - S x is borne; those of a part are counted at a time."""

    stiffness: Array
    load: Array
    states: States
    programmes: int = 0

    def __post_init__(self) -> None:
        self._slack = _LP_ERROR * max(1.0, float(np.abs(self.load).max()))

    def count(self) -> int:
        """Combinations that are equilibria.

        Raises:
            _TooMany: it takes too long.
        """
        return self._below(self.states)

    def _below(self, states: States) -> int:
        """Those of a branch, in which each unknown has these states left."""
        left = self._shaved(states)
        if left is None:
            return 0
        open_ones = [i for i, of in enumerate(left) if len(of) > 1]
        if not open_ones:
            return _admissible(self.stiffness, self.load, [tuple(of[0] for of in left)])
        at = min(open_ones, key=lambda i: len(left[i]))
        return sum(self._below([*left[:at], [state], *left[at + 1 :]]) for state in left[at])

    def _shaved(self, states: States) -> States | None:
        """Without the states that no point has, the others being in their hulls, which shrink; None if one has none."""
        left = [list(of) for of in states]
        for i, of in enumerate(left):
            if len(of) > 1:
                left[i] = [s for s in of if self._possible([*left[:i], [s], *left[i + 1 :]])]
            if not left[i]:
                return None
        return left

    def _possible(self, states: States) -> bool:
        """Whether a point has all unknowns in the hulls of these states."""
        self.programmes += 1
        if self.programmes > MOST:
            raise _TooMany
        of = [_hull(s) for s in states]
        rows = [a * np.eye(len(of))[i] - b * self.stiffness[i] for i, hull in enumerate(of) for a, b, _ in hull]
        ends = [c - b * self.load[i] + self._slack for i, hull in enumerate(of) for _, b, c in hull]
        found = linprog(np.zeros(len(of)), np.array(rows), ends, bounds=(None, None), method="highs")
        return bool(found.status != _INFEASIBLE)


def _hull(states: Sequence[State]) -> list[tuple[float, float, float]]:
    """Half-planes a x + b f <= c whose intersection holds all the (x, f) of these states, and hardly more."""
    corners = [c for s in states for c in s.corners]
    rays = [r for s in states for r in s.rays]
    sides = (
        [(q[0] - p[0], q[1] - p[1]) for p, q in itertools.combinations(corners, 2)] + rays + [(0.0, 1.0), (1.0, 0.0)]
    )
    found = []
    for dx, df in sides:
        size = float(np.hypot(dx, df))
        for a, b in ((-df, dx), (df, -dx)) if size > 0 else ():
            a, b = a / size, b / size
            reaches = [a * x + b * f for x, f in corners]
            if all(a * x + b * f <= _SINGULAR * np.hypot(x, f) for x, f in rays):
                found.append((a, b, max(reaches)))
    return found


def _condensed(system: System) -> tuple[Array, Array, npt.NDArray[np.int64]]:
    """Schur complement and load of the floor's unknowns, and these."""
    system.jacobian.set_rates([np.zeros_like(k) for k in system.jacobian.rates])
    blocks = np.unique(np.concatenate([t.surface.blocks for t in system.terms])).astype(np.int64)
    c = np.setdiff1d((2 * blocks[:, None] + np.arange(2)).ravel(), system.problem.fixed)
    i = np.setdiff1d(np.arange(system.dofs), c)
    f = system.load.array_r
    k = csr_matrix(system.jacobian.matrix.getValuesCSR()[::-1], shape=system.jacobian.matrix.getSize()).toarray()
    inner = np.linalg.solve(k[np.ix_(i, i)], np.column_stack([k[np.ix_(i, c)], f[i]]))
    return k[np.ix_(c, c)] - k[np.ix_(c, i)] @ inner[:, :-1], f[c] - k[np.ix_(c, i)] @ inner[:, -1], c


def _states(system: System, dof: int) -> list[State]:
    """All states of one unknown: its law's pieces and kinks within its bounds, and its bound."""
    bound = float(system.lower.array_r[dof])  # the floor is under the body: there are no upper ones
    pieces = _law_states(system, dof) or [State(-np.inf, np.inf)]
    found = [replace(s, low=max(s.low, bound)) for s in pieces if s.high > bound]
    # on its bound the floor adds a force of one sign to what the law bears for slightly larger x
    return [*found, State(bound, bound, most=_force(found, bound), least=-np.inf)] if np.isfinite(bound) else found


def _law_states(system: System, dof: int) -> list[State]:
    for term in system.terms:
        dofs, sign = component_dofs(term.surface.blocks, term.directions[:, 0, :])
        if dof in dofs:
            vertex = int(np.flatnonzero(dofs == dof)[0])
            return list(_pieces(term.law, float(term.surface.weights[vertex]), float(sign[vertex])))
    return []


def _breaks(law: Superpotential) -> Array:
    """Where the traction's slope changes or it jumps, ascending."""
    if isinstance(law, PolylineLaw):
        return np.asarray(law.graph.breaks)
    assert isinstance(law, PlusSmoothedLaw)
    parts = (law.law.convex, law.law.concave)
    kinks, jumps = (np.concatenate([getattr(p, name) for p in parts]) for name in ("kinks", "jumps"))
    half = law.epsilon_absolute / jumps / 2
    centre = [0.0] if law.even else []
    return np.unique(np.concatenate([_breaks(law.law), kinks - half, kinks + half, centre]))


def _between(a: float, b: float) -> float:
    """A point inside an interval, which may have no ends."""
    if np.isfinite(a) and np.isfinite(b):
        return (a + b) / 2
    return a + 1.0 if np.isfinite(a) else b - 1.0 if np.isfinite(b) else 0.0


def _pieces(law: Superpotential, weight: float, sign: float) -> Iterator[State]:
    """Pieces of the force on the body's own unknown x, the law's argument being sign times x."""
    breaks = _breaks(law)
    for a, b in itertools.pairwise([-np.inf, *breaks, np.inf]):
        inside = _between(a, b)
        middle = np.array([inside])
        slope = float(law.convex.second(middle)[0] - law.concave.second(middle)[0])
        traction = float(law.right(middle)[0])
        low, high = sorted((sign * a, sign * b))
        yield State(low, high, weight * sign * (traction - slope * inside), weight * slope)
    for x in law.kinks:
        near, far = (float(side(np.array([x]))[0]) for side in (law.left, law.right))
        least, most = sorted((weight * sign * near, weight * sign * far))
        yield State(sign * x, sign * x, least=least, most=most)


def _force(pieces: Sequence[State], x: float) -> float:
    """The law's force for slightly larger x."""
    inside = [s for s in pieces if not s.held and s.low <= x < s.high]
    return inside[0].at + inside[0].slope * x


def _admissible(stiffness: Array, load: Array, part: Sequence[tuple[State, ...]]) -> int:
    """How many combinations are equilibria: f - S x is what the law or the bound bears, x lies where it should."""
    fields = ("low", "high", "at", "slope", "least", "most", "held")
    low, high, at, slope, least, most, held = (np.array([[getattr(s, f) for s in row] for row in part]) for f in fields)
    held = held.astype(bool)
    fixed = np.where(held, np.where(np.isfinite(low), low, 0.0), 0.0)
    matrix = stiffness + np.einsum("bi,ij->bij", slope, np.eye(len(load)))
    matrix = np.where(held[:, :, None] | held[:, None, :], np.eye(len(load)), matrix)
    values = np.abs(np.linalg.eigvalsh(matrix))
    regular = values.min(axis=1) > _SINGULAR * values.max(axis=1)
    known = np.where(held, fixed, load - at - fixed @ stiffness.T)
    x = np.linalg.solve(matrix[regular], known[regular][:, :, None])[:, :, 0]
    force = load - x @ stiffness.T
    low, high, least, most, held = (v[regular] for v in (low, high, least, most, held))
    slack = _SLACK * max(1.0, float(np.abs(load).max()))
    between = (x >= low - _SLACK) & (x <= high + _SLACK)
    borne = (force >= least - slack) & (force <= most + slack)
    return int(np.count_nonzero(np.all(np.where(held, borne, between), axis=1)))
