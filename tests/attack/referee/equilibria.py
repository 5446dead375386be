"""A search for an equilibrium where the program found none: pieces of the laws from many starts, then a proof.

What is found is put before the same check as the program's own solutions, at a finer tolerance.
"""

from __future__ import annotations

import numpy as np

from referee.assembly import Problem
from referee.coordinates import Coordinate, Floor
from referee.meshes import Array
from referee.solution import Check

STARTS, STEPS = 120, 60


def find(problem: Problem, rng: np.random.Generator) -> str | None:
    """A solution in words, or None."""
    floor = Floor(problem)
    if not floor.ok or problem.matrix.shape[0] > 900 or not floor.coordinates or not floor.regular:
        return None
    s, f, lift, base = floor.condensed
    sizes = [np.abs(law.breaks).max() for c in floor.coordinates for law, *_ in c.laws]
    length = max([*sizes, float(problem.stress.max()) * problem.mesh.size / problem.modulus])
    for k in range(STARTS):
        scale = 0.0 if k == 0 else length * 10.0 ** rng.uniform(-2, 0.5)
        common = rng.standard_normal() if k % 2 else 0.0
        x = scale * (rng.standard_normal(len(s)) * (k % 3 > 0) + common)
        found = _pieces(floor, s, f, x)
        if found is None:
            continue
        u = (base + lift @ found).reshape(problem.mesh.points.shape)
        if not Check(problem, u, 1e-7).wrongs():
            return f"start {k}, energy {problem.energy(u):.6g}"
    return None


def _pieces(floor: Floor, s: Array, f: Array, x: Array) -> Array | None:
    """Solve with the present pieces and bounds, look which ones hold, and again until they stand."""
    state = [_state(c, float(v), 0.0) for c, v in zip(floor.coordinates, x, strict=True)]
    seen: set[tuple[object, ...]] = set()
    for _ in range(STEPS):
        key = tuple(state)
        if key in seen:
            return None
        seen.add(key)
        found = _solve(floor, s, f, state)
        if found is None:
            return None
        x, force = found
        new = [
            _next(c, old, float(v), float(p)) for c, old, v, p in zip(floor.coordinates, state, x, force, strict=True)
        ]
        if new == state:
            return x
        state = new
    return None


State = tuple[str, float, float, float]
"""What stands for a coordinate: kind (free, held), place, traction at the place, slope."""


def _traction(c: Coordinate, x: float, side: float) -> tuple[float, float]:
    """Force of the laws and its slope at x, to one side."""
    force = slope = 0.0
    for law, turn, weight in c.laws:
        to = side * turn
        which = "right" if to >= 0 else "left"
        force += weight * turn * float(law.side(np.array([turn * x]), which)[0])
        i = int(np.searchsorted(law.breaks, turn * x, side="right" if to >= 0 else "left"))
        drop, length = law.decay
        slope += weight * (law.slopes[i] - drop / length * np.exp(-abs(x) / length))
    return force, slope


def _state(c: Coordinate, x: float, side: float) -> State:
    if x >= c.upper:
        return ("upper", c.upper, 0.0, 0.0)
    if x <= c.lower:
        return ("lower", c.lower, 0.0, 0.0)
    force, slope = _traction(c, x, side or 1.0)
    if slope and not any(law.decay[0] for law, *_ in c.laws):
        force, x = force - slope * x, 0.0  # one line has one name
    elif not slope:
        x = 0.0
    return ("free", round(x, 18), force, slope)


def _solve(floor: Floor, s: Array, f: Array, state: list[State]) -> tuple[Array, Array] | None:
    x = np.array([p for _, p, *_ in state])
    free = np.array([k == "free" for k, *_ in state])
    a, b = s.copy(), f.copy()
    for i, (kind, place, force, slope) in enumerate(state):
        if kind == "free":
            a[i, i] += slope
            b[i] -= force - slope * place
    try:
        if free.any():
            x = np.where(free, 0.0, x)
            part = a[np.ix_(free, free)]
            if np.linalg.cond(part) > 1e13:
                return None
            x[free] = np.linalg.solve(part, (b - a @ x)[free])
    except np.linalg.LinAlgError:
        return None
    return x, f - s @ x


def _next(c: Coordinate, old: State, x: float, force: float) -> State:
    """The state that agrees with a displacement and with the force that bounds and laws have to carry."""
    kind = old[0]
    if kind == "free":
        kinks = sorted(turn * b for law, turn, _ in c.laws for b, j in zip(law.breaks, law.jumps, strict=True) if j)
        for kink in kinks:
            low, high = (_traction(c, kink, side)[0] for side in (-1.0, 1.0))
            line = old[2] + old[3] * (kink - old[1])
            # an upward jump between the old line's piece and the new point holds the coordinate
            if low < high and c.lower < kink < c.upper and _between(line, low, high, x, kink):
                return ("kink", kink, 0.0, 0.0)
        return _state(c, x, 0.0)
    if kind == "kink":
        low, high = (_traction(c, old[1], side)[0] for side in (-1.0, 1.0))
        if low <= force <= high:
            return old
        return _leave(c, old[1], 1.0 if force > high else -1.0)
    side = -1.0 if kind == "upper" else 1.0
    inward = _traction(c, old[1], side)[0]
    holds = force >= inward if kind == "upper" else force <= inward
    return old if holds or c.lower == c.upper else _leave(c, old[1], side)


def _between(line: float, low: float, high: float, x: float, kink: float) -> bool:
    """The line of the piece below an upward jump has passed it to the right, or the one above to the left."""
    tolerance = 1e-9 * (abs(low) + abs(high))
    return (abs(line - low) <= tolerance and x > kink) or (abs(line - high) <= tolerance and x < kink)


def _leave(c: Coordinate, place: float, side: float) -> State:
    force, slope = _traction(c, place, side)
    if slope and not any(law.decay[0] for law, *_ in c.laws):
        return ("free", 0.0, force - slope * place, slope)
    return ("free", 0.0 if not slope else round(place, 18), force, slope)
