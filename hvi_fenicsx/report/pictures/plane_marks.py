"""What is drawn around a plane body: loads, supports, obstacles and contact pressure. Each mark knows its extent."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon
from matplotlib.patheffects import withStroke

from ...geometry import chains
from ...typing import Array, Mask
from ..units import quantity
from .deformed import DeformedBody, PartGeometry
from .loads_supports import HeldSide, LoadedSide
from .outline import normals
from .reach import Label, Reach
from .style import GREY, INK, ORANGE, PURPLE, VERMILION

LOAD, PRESSURE, ROLLER = 0.13, 0.15, 0.011
"""Parts of the body's size: the longest arrow, the highest pressure, a roller's radius."""
OBSTACLE, NOTHING = 0.004, 1e-6
"""How far behind its face an obstacle's line is drawn, of the body's size; what counts as no stress, of the largest."""
ARROWS, APART, LEAST = 9, 0.03, 0.02
"""Along a side of the body's size; the least way between two, of that size; what has no arrow, of the largest."""
HALO = 1.6
"""Points of white around arrows, which may stand on any colour."""
OFF, IN_LINE = 0.03, 1.4
"""How far off their side arrows along it are drawn, of the body's size; the least way between them, of their length."""


SLIDES = "support, free to slide"
"""What the legend says of a wall with rollers."""


@dataclass(frozen=True)
class Mark:
    """Something to draw around the body.

    Attributes:
        reach: the points that it reaches.
        draw: draws it.
        key: its line in the legend.
        words: of that line; empty for none.
    """

    reach: Reach
    draw: Callable[[Axes], None]
    key: Callable[[], Artist]
    words: str


def keys(drawn: Sequence[Mark]) -> list[Artist]:
    """One line of the legend for each kind of mark."""
    return [mark.key() for mark in {mark.words: mark for mark in drawn if mark.words}.values()]


def undeformed() -> Artist:
    """The legend's line for the dashed outline."""
    return Line2D([], [], color=GREY, ls=(0, (3, 2)), lw=1.3, label="undeformed outline")


def loads(shape: DeformedBody, found: list[LoadedSide]) -> Iterator[Mark]:
    """Arrows onto a side where it is pushed, from it where it is pulled, off it where they are along it.

    Each load has its own scale and value.

    Args:
        shape: the deformed body.
        found: the sides with loads.
    """
    size = shape.body.size
    for load in found:
        points, amount = shape.points[load.side.vertices, :2], np.linalg.norm(load.traction, axis=1)
        beside = bool(load.sheared.all())
        at, label = _on_stretches(points, amount, size, ARROWS, along=LOAD if beside else 0.0)
        arrows = _along(points, load.traction[:, :2], at) * float(LOAD * size / load.largest)
        feet, outward = _along(points, points, at), _along(points, load.side.normals[:, :2], at)
        pushed = np.einsum("ki,ki->k", arrows, outward) < -1e-6 * LOAD * size
        tails = feet + OFF * size * outward - arrows / 2 if beside else feet - np.where(pushed[:, None], arrows, 0.0)
        yield _arrows(tails, arrows, INK, "load", size)
        ends = np.concatenate([tails - feet, tails + arrows - feet])
        reach = float(np.einsum("ki,ki->k", ends, np.concatenate([outward, outward])).max(initial=0.0))
        foot, way = _along(points, points, label)[0], _along(points, load.side.normals[:, :2], label)[0]
        yield _label(foot + reach * way, way, load.value)


def _label(at: Array, way: Array, words: str) -> Mark:
    label = Label(words, at, np.asarray(way / (float(np.linalg.norm(way)) or 1.0), dtype=np.float64))
    return Mark(label.reach, label.draw, Artist, "")


def _lengths(points: Array) -> Array:
    """The way along a line to each of its points."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


def _spread(length: float, size: float, count: int = ARROWS, fewest: int = 2, apart: float = APART) -> Array:
    """Where to put arrows on a stretch of a line, as lengths along it: so many on one of the body's size.

    On a short one there are as many as stand apart; one alone stands in the middle.
    """
    number = min(max(fewest, round(count * length / size)), 1 + int(length / (apart * size)))
    return np.linspace(0.0, length, number, dtype=np.float64) if number > 1 else np.array([length / 2])


def _on_stretches(
    points: Array, amount: Array, size: float, count: int, *, fewest: int = 2, along: float = 0.0
) -> tuple[Array, Array]:
    """Where to put arrows on a line, and the middle of the longest stretch on which there is something to show.

    Args:
        points: of the line, m, (m, 2).
        amount: how much there is at them, (m,).
        size: of the body, m.
        count: arrows on a line of that size.
        fewest: on a stretch.
        along: how long arrows are that lie along the line, of the body's size; they end where the stretch ends.

    Returns:
        Lengths along the line, (k,) and (1,).
    """
    s, loaded = _lengths(points), np.concatenate([[0], amount > LEAST * amount.max(), [0]]).astype(int)
    runs = np.flatnonzero(np.diff(loaded)).reshape(-1, 2) - [0, 1]
    stretches = [(float(s[a]), float(s[b])) for a, b in runs]
    start, end = max(stretches, key=lambda stretch: stretch[1] - stretch[0])
    apart, at = max(APART, IN_LINE * along), list[Array]()
    for a, b in stretches:
        length = max(b - a - along * size, 0.0)
        at.append((a + b - length) / 2 + _spread(length, size, count, fewest, apart))
    return np.concatenate(at), np.array([(start + end) / 2])


def _along(points: Array, values: Array, at: Array) -> Array:
    """Values (m, k) at points on a line, interpolated at lengths along it."""
    s = _lengths(points)
    return np.column_stack([np.interp(at, s, column) for column in values.T])


def _arrows(tails: Array, arrows: Array, colour: str, words: str, size: float) -> Mark:
    long = np.linalg.norm(arrows, axis=1) > 0.012 * size

    def draw(axes: Axes) -> None:
        look = {**_ARROW, "color": colour, "path_effects": [withStroke(linewidth=HALO, foreground="white")]}
        axes.quiver(*tails[long].T, *arrows[long].T, zorder=6, clip_on=False, width=0.0042, **look)

    key = Line2D([], [], color=colour, marker=">", ms=7, markevery=(1, 1), lw=1.6, label=words)
    key.set_data([0, 1], [0, 0])
    return Mark(Reach(np.concatenate([tails, tails + arrows])), draw, lambda: key, words)


_ARROW: dict[str, Any] = {
    "angles": "xy",
    "scale_units": "xy",
    "scale": 1.0,
    "headwidth": 4.2,
    "headlength": 4.6,
    "headaxislength": 4.4,
    "minlength": 0.1,
}


def supports(shape: DeformedBody, found: list[HeldSide]) -> Iterator[Mark]:
    """A wall along each side, with rollers where the side may move along it.

    Args:
        shape: the deformed body.
        found: the sides that are held.
    """
    for support in found:
        points, outward = shape.points[support.side.vertices, :2], support.side.normals[:, :2]
        radius = ROLLER * shape.body.size if support.rolling else 0.0
        places = _spread(float(_lengths(points)[-1]), shape.body.size)
        rollers = _along(points, points + radius * outward, places)
        shown = rollers if support.rolling else rollers[:0]
        yield _support(points + 2 * radius * outward, shown, outward, shape.body.size)


def _support(wall: Array, rollers: Array, outward: Array, size: float) -> Mark:
    words = SLIDES if len(rollers) else "support"

    def draw(axes: Axes) -> None:
        _hatched(axes, wall, outward, size)
        per_metre = axes.get_window_extent().width / float(np.ptp(axes.get_xlim())) * 72 / axes.figure.dpi
        style: dict[str, Any] = {"mfc": "white", "mec": INK, "mew": 1.2, "clip_on": False, "zorder": 5}
        axes.plot(*rollers.T, "o", ms=2 * ROLLER * size * per_metre, **style)

    return Mark(Reach(np.concatenate([wall, wall + 0.03 * size * outward])), draw, lambda: _support_key(words), words)


def _support_key(words: str) -> Artist:
    """The legend's line for a wall, with a roller where the side may slide."""
    if words == SLIDES:
        return Line2D([], [], color=INK, lw=2.2, marker="o", mfc="white", ms=7, label=words)
    return Patch(fc="white", ec=GREY, hatch="/////", lw=0.0, label=words)


def _hatched(axes: Axes, line: Array, outward: Array, size: float) -> None:
    """A line with the short strokes behind it by which drawings tell a wall."""
    axes.plot(*line.T, color=INK, lw=2.2, solid_capstyle="butt", clip_on=False, zorder=3)
    places = np.arange(0.0, float(_lengths(line)[-1]), 0.02 * size, dtype=np.float64)
    at, normal = _along(line, line, places), _along(line, outward, places)
    tips = at + 0.02 * size * (normal + np.column_stack([-normal[:, 1], normal[:, 0]]))
    strokes = np.stack([at, tips, np.full_like(at, np.nan)], axis=1).reshape(-1, 2)
    axes.plot(*strokes.T, color=GREY, lw=0.9, clip_on=False, zorder=2)


@dataclass(frozen=True)
class Largest:
    """What the legend says of all contact parts together.

    Attributes:
        pressure: the largest -σ_n, N/m².
        tension: the largest σ_n, N/m².
        gap: the largest distance of a lifted vertex from its obstacle, m.
    """

    pressure: float
    tension: float
    gap: float


def contacts(shape: DeformedBody, parts: Sequence[PartGeometry]) -> Iterator[Mark]:
    """The obstacle of each part, where the part is off it, and the pressure on it as arrows that end there.

    Args:
        shape: the deformed body.
        parts: where the parts lie on the body.
    """
    stress = np.nan_to_num(np.concatenate([[0.0], *(geometry.part.pressure for geometry in parts)]))
    gap = max((geometry.part.largest_gap for geometry in parts), default=0.0)
    largest = Largest(float(stress.max()), -float(stress.min()), gap)
    for geometry in parts:
        yield from _contact(shape, geometry, largest)


def _contact(shape: DeformedBody, geometry: PartGeometry, largest: Largest) -> Iterator[Mark]:
    for chain in chains(geometry.facets):
        outward = normals(shape.body.points, chain)
        if geometry.obstacle is not None:
            outward = np.broadcast_to(geometry.obstacle[:2], outward.shape)
        gap = np.nan_to_num(geometry.values(geometry.part["gap"], chain))
        away = 0.0 if geometry.between_bodies else shape.factor * gap[:, None]
        base = shape.points[chain, :2] + away * outward * shape.stretch[:2]
        pressure = np.nan_to_num(geometry.values(geometry.part.pressure, chain))
        if geometry.part.has("gap") and not geometry.between_bodies:
            yield _obstacle(base + OBSTACLE * shape.body.size * outward)
        off = geometry.part.lifted[geometry.row[chain]]
        if off.any():
            yield _lifted(shape.points[chain, :2], off, largest.gap)
        yield from _profile(base, outward, pressure, largest, shape.body.size)


def _obstacle(base: Array) -> Mark:
    def draw(axes: Axes) -> None:
        axes.plot(*base.T, color=GREY, lw=4, solid_capstyle="butt", clip_on=False, zorder=3.5)

    return Mark(Reach(base), draw, lambda: Line2D([], [], color=GREY, lw=4, label="obstacle"), "obstacle")


def _lifted(points: Array, off: Mask, gap: float) -> Mark:
    """The part's own line where it is off the obstacle; points that are not are left out of it."""
    line, words = np.where(off[:, None], points, np.nan), f"lifted, up to {quantity(gap, 'm')}"
    style: dict[str, Any] = {"color": ORANGE, "lw": 4.5, "marker": "o", "ms": 2.5, "solid_capstyle": "butt"}

    def draw(axes: Axes) -> None:
        axes.plot(*line.T, **style, clip_on=False, zorder=5.5)

    return Mark(Reach(points), draw, lambda: Line2D([], [], **style, label=words), words)


def _profile(base: Array, outward: Array, pressure: Array, largest: Largest, size: float) -> Iterator[Mark]:
    longest = max(largest.pressure, largest.tension)
    for sign, colour, words, most in (
        (1, VERMILION, "contact pressure", largest.pressure),
        (-1, PURPLE, "contact tension", largest.tension),
    ):
        part = np.maximum(sign * pressure, 0.0)
        if part.max() <= NOTHING * longest:
            continue
        tips = base + PRESSURE * size / longest * part[:, None] * outward
        tips[np.convolve(part > NOTHING * longest, [1, 1, 1])[1:-1] == 0] = np.nan  # no line where there is no stress
        yield _filled(base, tips, colour, f"{words}, up to {quantity(most, 'Pa')}")
        tips = np.where(np.isnan(tips), base, tips)
        at = _on_stretches(base, part, size, 2 * ARROWS, fewest=5)[0]
        feet, ends = _along(base, base, at), _along(base, tips, at)
        yield _arrows(ends if sign > 0 else feet, sign * (feet - ends), colour, "", size)


def _filled(base: Array, tips: Array, colour: str, words: str) -> Mark:
    def draw(axes: Axes) -> None:
        ends = np.where(np.isnan(tips), base, tips)
        outline = np.concatenate([base, ends[::-1]])
        axes.add_artist(Polygon(outline, color=colour, alpha=0.16, lw=0, clip_on=False, zorder=2))
        halo = [withStroke(linewidth=1.8 + HALO, foreground="white")]
        axes.plot(*tips.T, color=colour, lw=1.8, clip_on=False, zorder=5, path_effects=halo)

    return Mark(
        Reach(tips[np.isfinite(tips[:, 0])]), draw, lambda: Patch(fc=colour, alpha=0.5, ec=colour, label=words), words
    )
