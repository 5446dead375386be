"""Is a stationary point a local minimiser? One-sided derivatives first, then the curvature where they vanish."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from referee.coordinates import Coordinate, Floor
from referee.laws import Law
from referee.meshes import Array
from referee.solution import EPS, Check

SOLVED = 3.0
"""A vanishing force is one below so many times the scene's tolerance; nothing is concluded from larger ones."""


@dataclass(frozen=True)
class Finding:
    """What is known: ``minimiser`` is True, False or None (not decided), with the reason."""

    minimiser: bool | None
    why: str


def examine(check: Check, floor: Floor) -> Finding:
    """A solution's second order. Only for laws of one displacement, unsmoothed."""
    p = check.problem
    if not floor.ok or any(q.law.smoothing for q in p.laws) or len(floor.coordinates) > 200 or p.matrix.shape[0] > 900:
        return Finding(None, "not looked at")
    if not floor.regular:
        return Finding(None, "the inside is not held")
    free, weak, curvatures = [], [], []
    for i, c in enumerate(floor.coordinates):
        sides = [_side(check, c, s) for s in (-1.0, 1.0)]
        slopes = [d for d, _ in sides]
        if min(slopes) < -1.0:
            return Finding(False, f"descent at {tuple(p.mesh.points[c.vertex])} along {tuple(c.direction)}")
        if all(d > 1.0 for d in slopes):
            continue
        open_sides = [k for d, k in sides if d <= 1.0]
        (free if max(slopes) <= _level(check, c) else weak).append(i)
        curvatures.append((i, min(open_sides), max(open_sides)))
    if not floor.coordinates:
        return Finding(True, "linear")
    s, *_ = floor.condensed
    low, high = (s + np.diag(_diagonal(len(s), curvatures, k)) for k in (1, 2))
    size = float(np.abs(s).max()) or 1.0
    if _least(high, free) < -1e-7 * size:
        return Finding(False, f"curvature {_least(high, free) / size:.1e} on the free coordinates")
    if _least(low, sorted(free + weak)) > 1e-7 * size:
        return Finding(True, "positive curvature wherever nothing blocks")
    return Finding(None, "a tie")


def _level(check: Check, c: Coordinate) -> float:
    """What a slope that vanishes may be, in the unit of ``_side``: rounding, and what the scene's tolerance leaves."""
    left = SOLVED * check.problem.tolerance * weight_of(check, c) + float(check.rounding[c.vertex].max())
    return left / (check.wrong * weight_of(check, c))


def _diagonal(n: int, curvatures: list[tuple[int, float, float]], which: int) -> Array:
    found = np.zeros(n)
    for entry in curvatures:
        found[int(entry[0])] = entry[which]
    return found


def _least(matrix: Array, where: list[int]) -> float:
    return float(np.linalg.eigvalsh(matrix[np.ix_(where, where)])[0]) if where else np.inf


def _side(check: Check, c: Coordinate, sign: float) -> tuple[float, float]:
    """The derivative of the energy to one side, in units of what rounding may be, and the law's curvature there."""
    slope, tolerance, curvature = _derivatives(check, c, sign)
    return slope / tolerance, curvature


def _derivatives(check: Check, c: Coordinate, sign: float) -> tuple[float, float, float]:
    """The derivative of the energy to one side, what rounding may be, and the law's curvature there."""
    near, x = check.near(c.vertex), float(c.direction @ check.u[c.vertex])
    touching = check.touching(c.vertex)
    if (sign > 0 and x >= c.upper - touching) or (sign < 0 and x <= c.lower + touching):
        return np.inf, 1.0, 0.0
    slope = -sign * float(c.direction @ check.missing[c.vertex])
    curvature, tolerance = 0.0, weight_of(check, c) * check.wrong
    for law, turn, weight in c.laws:
        place, to = turn * x, sign * turn
        kinks = law.breaks[np.abs(law.breaks - place) <= near]
        at = float(kinks[0]) if len(kinks) else place
        traction = float(law.side(np.array([at]), "right" if to > 0 else "left")[0])
        slope += weight * to * traction
        curvature += weight * _slope(law, at, to)
        steepest = max(abs(_slope(law, at, side)) for side in (-1.0, 1.0))
        tolerance += weight * steepest * abs(at - place)  # a kink nearby is not the place itself
    return slope, tolerance, curvature


def weight_of(check: Check, c: Coordinate) -> float:
    """The force that a body's traction exerts at a vertex."""
    return float(check.weights[c.vertex] * check.traction[check.problem.labels[c.vertex]])


def _slope(law: Law, at: float, to: float) -> float:
    """One-sided slope of the traction."""
    breaks, slopes = law.breaks, law.slopes
    i = int(np.searchsorted(breaks, at, side="right" if to > 0 else "left"))
    drop, length = law.decay
    return float(slopes[i] - drop / length * np.exp(-abs(at) / length))


def sampled_descent(check: Check, floor: Floor, rng: np.random.Generator) -> float:
    """The lowest energy found nearby, relative to what tractions could do over the step; negative beyond -1e-5.

    What rounding may do to the change of the energy is added to it.
    """
    s, _, lift, _ = floor.condensed
    p, worst = check.problem, 0.0
    residual, blurred = -(lift.T @ check.missing.ravel()), np.abs(lift.T) @ check.rounding.ravel()
    u0 = float(check.traction.max() * p.mesh.size / p.modulus)
    for _ in range(40):
        d = rng.standard_normal(len(s)) * (rng.random(len(s)) < rng.choice([0.1, 0.5, 1.0]))
        step = _within_pieces(check, floor, d * u0 * 10.0 ** rng.uniform(-6, -2))
        force, laws, lost = 0.0, 0.0, float(np.abs(step) @ blurred)
        for i, c in enumerate(floor.coordinates):
            x = float(c.direction @ check.u[c.vertex])
            step[i] = np.clip(step[i], *_room(check, c, x))
            for law, turn, weight in c.laws:
                values = law.value(np.array([turn * (x + step[i]), turn * x]))
                laws += weight * float(values[0] - values[1])
                lost += 4 * EPS * weight * (float(np.abs(values).max()) + abs(x) * law.scale)
            force += abs(step[i]) * weight_of(check, c)
        change = float(step @ residual + step @ s @ step / 2) + laws + lost
        if np.abs(step).max(initial=0.0) > 1e-8 * u0:  # else it is rounding
            worst = min(worst, change / force)
    return worst


def _room(check: Check, c: Coordinate, x: float) -> tuple[float, float]:
    """How far a coordinate may go to either side; nowhere beyond a bound that it touches."""
    touching = check.touching(c.vertex)
    down, up = min(c.lower - x, 0.0), max(c.upper - x, 0.0)
    return (down if down < -touching else 0.0), (up if up > touching else 0.0)


def _within_pieces(check: Check, floor: Floor, step: Array) -> Array:
    """The step, shortened so that no vertex reaches another piece of its law: beyond it the energy may fall again.

    So it may where a vertex that a jump of its law holds has gone so far that the law's fall outdoes the jump.
    """
    share = 1.0
    for c, change in zip(floor.coordinates, step, strict=True):
        x = float(c.direction @ check.u[c.vertex])
        for law, turn, _ in c.laws:
            far = np.abs(law.breaks - turn * x)
            far = far[far > check.near(c.vertex)]
            if len(far) and abs(change) > 0.5 * far.min():
                share = min(share, 0.5 * float(far.min()) / abs(change))
        slope, tolerance, curvature = _derivatives(check, c, float(np.sign(change)) or 1.0)
        if slope > tolerance and abs(change) * -curvature > 0.5 * slope:
            share = min(share, 0.5 * slope / (abs(change) * -curvature))
    return np.asarray(share * step)
