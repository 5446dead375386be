"""How far a state is from the graphs of its laws and bounds: what certifies it on Γc, apart from how it was found."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from ..laws import VertexLaws
from ..reduced.condensed_problem import Bonds, CondensedProblem
from ..reduced.condensed_stiffness import CellColumns
from ..typing import Array, magnitude
from .contact_points import ContactPoints
from .state import PathState
from .thresholds import DEFAULT, ROUNDING
from .vertex_laws import multiplied


class Distances:
    """The distances of the states of one path.

    Args:
        problem: the problem.
        remember: numbers of the problem's bonds that remember.
    """

    def __init__(self, problem: CondensedProblem, remember: Collection[int]) -> None:
        self._problem, self._factors = multiplied(problem)
        bonds = enumerate(self._problem.bonds)
        self._laws = [b.laws.with_memory if number in remember else b.laws for number, b in bonds]

    def __call__(self, state: PathState, carried: Array | None = None) -> float:
        """The largest distance, relative to the forces.

        Args:
            state: the state.
            carried: forces of laws and bounds, (n,); by default what the condensed body leaves them.
        """
        problem, x = self._problem, state.x * self._factors
        elastic, load = problem.elastic @ x, problem.load(state.factor)
        size = max(magnitude(f) for f in (elastic, load, problem.force_rate)) or 1.0
        force = load - elastic if carried is None else carried / self._factors
        return self._largest(x, force, self._present(state)) / size

    def _present(self, state: PathState) -> list[VertexLaws]:
        """The laws of all groups of bonds, with what these remember."""
        ends = np.cumsum([len(laws.weights) for laws in self._laws])[:-1]
        if state.memory is None or not self._laws:
            return self._laws
        parts = zip(self._laws, np.split(state.memory, ends), strict=True)
        return [laws if laws.memory is None else replace(laws, memory=memory) for laws, memory in parts]

    def _near(self, laws: VertexLaws, x: Array) -> float:
        """A difference of displacements that is none: beside a law's length, and as rounding of the largest one."""
        return DEFAULT.reached * laws.law.length_scale + ROUNDING * magnitude(x)

    def _largest(self, x: Array, force: Array, present: Sequence[VertexLaws]) -> float:
        """The largest distance of a force that laws and bounds should give."""
        low, high, worst = np.zeros(len(x)), np.zeros(len(x)), 0.0
        rest, problem = force.copy(), self._problem
        for bonds, laws in zip(problem.bonds, present, strict=True):
            unknowns = bonds.unknowns
            if bonds.radial:
                lower = problem.lower[unknowns[:, 0]] if bonds.opens else np.full(len(unknowns), -np.inf)
                near = DEFAULT.reached * np.max(np.abs(x[unknowns]), axis=1) + self._near(laws, x)
                off = _off(bonds, laws, x[unknowns], force[unknowns], lower, near)
                worst = max(worst, float(np.max(off, initial=0.0)))
                rest[unknowns] = 0.0
            else:
                at = x[unknowns[:, 0]]
                least, most = _interval(laws, at, DEFAULT.reached * np.abs(at) + self._near(laws, x))
                np.add.at(low, unknowns[:, 0], least)
                np.add.at(high, unknowns[:, 0], most)
        allowed = DEFAULT.reached * magnitude(x)
        low[x <= problem.lower + allowed], high[x >= problem.upper - allowed] = -np.inf, np.inf
        beyond = np.maximum(np.maximum(problem.lower - x, x - problem.upper), 0.0) * problem.elastic.diagonal
        away = np.maximum(np.maximum(low - rest, rest - high), 0.0) + beyond
        return max(worst, float(np.max(away, initial=0.0)))


def _interval(laws: VertexLaws, x: Array, near: Array) -> tuple[Array, Array]:
    """The least and the greatest forces at coordinates, but for their rounding, (r,) each."""
    # at a peak the law gives less at both ends
    found = np.concatenate(laws.limits(np.stack([x - near, x, x + near])))
    return laws.weights * np.min(found, axis=0), laws.weights * np.max(found, axis=0)


def _off(bonds: Bonds, laws: VertexLaws, u: Array, force: Array, lower: Array, near: Array) -> Array:
    """How far forces are from those that a law on a length gives: along u, of a size of its graph, (r,).

    An opening that is not positive has none, but for what its bound pushes.
    """
    pushed = np.zeros(len(u))
    if bonds.opens:
        shut, pressed = u[:, 0] <= near, u[:, 0] <= lower + near
        pushed[shut & ~pressed] = np.maximum(-force[shut & ~pressed, 0], 0.0)
        force[shut, 0], u[shut, 0] = np.maximum(force[shut, 0], 0.0), 0.0
    length = np.linalg.norm(u, axis=1)
    least, most = (_energies(bonds, u) * end for end in _interval(laws, length, near))
    at_rest = np.maximum(np.linalg.norm(force, axis=1) - np.maximum(np.abs(least), np.abs(most)), 0.0)
    directions = np.divide(u, length[:, None], out=np.zeros_like(u), where=length[:, None] > 0.0)
    along = np.sum(force * directions, axis=1)
    across = np.linalg.norm(force - along[:, None] * directions, axis=1)
    moved = np.maximum(np.maximum(least - along, along - most), 0.0) + across
    return np.where(length <= near, at_rest, moved) + pushed


def _energies(bonds: Bonds, u: Array) -> Array:
    """By what the mode mixity of vectors multiplies a law, (r,)."""
    mixity, whole = bonds.mixity, np.sum(u * u, axis=1)
    if mixity is None:
        return np.ones(len(u))
    slips = u[:, 1:] if bonds.opens else u
    shares = np.divide(np.sum(slips * slips, axis=1), whole, out=np.zeros(len(u)), where=whole > 0.0)
    return np.where(whole > 0.0, mixity.energy(shares), 1.0)


class StateOnGraphs:
    """A state along the graphs on which its laws and bounds are.

    Args:
        problem: the problem.
        remember: numbers of the problem's bonds that remember.
        state: the state.

    Attributes:
        x: displacements, (n,).
        force: of laws and bounds, with what bonds remember, (n,).
    """

    def __init__(self, problem: CondensedProblem, remember: Collection[int], state: PathState) -> None:
        known, self._factors = multiplied(problem)
        self._points = ContactPoints(known, remember)
        self._z = self._points.take(state)
        self._read()

    def _read(self) -> None:
        values = self._points.values(self._z)
        self.x, self.force = values.x / self._factors, values.force * self._factors

    def take(self, load: Array) -> None:
        """Move along the graphs until a small load more is carried, at the same factor, or an end is reached.

        Args:
            load: (n,).

        Raises:
            numpy.linalg.LinAlgError: the equations are singular.
        """
        self._z = self._z + self._change(load / self._factors)
        s, _ = self._points.polar(self._z)
        for k in np.flatnonzero((s < self._points.low) | (s > self._points.high)):
            self._points.leave(self._z, int(k), forward=bool(s[k] > self._points.high[k]))
        self._read()

    def _change(self, load: Array) -> Array:
        if self._points.straight:
            columns = CellColumns(slope=self._points.slope, rise=self._points.rise, driver=None, factor=load)
            return self._points.elastic.inverse(columns).solve(load)
        matrix = self._points.jacobian(self._points.values(self._z))
        return np.linalg.lstsq(matrix, load, rcond=ROUNDING)[0]
