"""``contact.png`` in the plane: slip, -σ_t and contact pressure along a part."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import FixedLocator, MaxNLocator

from ....typing import Array, Mask
from ...contact_part import ContactPart
from ...reader import Result
from ...units import Unit, quantity, unit_for
from ..along_curve import along_curve
from ..registry import picture
from ..style import BLUE, GREEN, GREY, HEADING, INK, ORANGE, VERMILION, WIDTH, area, figure, heading

LEFT, ACROSS = 0.95, 6.75
"""Inches: left of the panels, and their width."""
PANEL, GAP, FOOT = 1.75, 0.62, 0.72
"""Inches: a panel, the room for its title, the axis below the last."""
VEIL = 0.16
"""How much of its colour a lifted stretch has."""
MARKED = 80
"""Vertices up to which each is marked."""
SHORT = 0.2
"""Part of a part's length; a closed stretch shorter than this is shown alone."""
IN_RANGE = 1.6
"""A kink of the law is drawn if it lies within this many times the largest slip."""


@picture("contact", dimension=2, of_part=True, caption="Along {part}: displacement, friction and pressure.")
def draw(result: Result, part: ContactPart) -> Figure:
    """Draw the curves of a part, with what the laws say of them; a law that it does not have has no curve.

    Args:
        result: the result.
        part: the part of Γc, in the plane.
    """
    whole, part = part, along_curve(result, part)
    way = "" if part is whole else " along s"
    part = _worth_seeing(part)
    length = unit_for(float(np.max(part["s"])), "m")
    panels = list(_panels(result, part, length, way))
    fig = figure(HEADING + len(panels) * (PANEL + GAP) + FOOT)
    heading(fig, result, f"on “{part.name}”")
    lifted = _lifted_spans(part)
    for above, panel in enumerate(reversed(panels)):
        axes = area(fig, LEFT, FOOT + above * (PANEL + GAP), ACROSS, PANEL)
        panel(axes)
        for start, end in lifted:
            axes.axvspan(start / length.size, end / length.size, color=ORANGE, alpha=VEIL, lw=0)
        _finish(axes, part, length)
        axes.tick_params(labelbottom=above == 0)
    if lifted:
        _say_lifted(fig, whole.largest_gap)
    fig.axes[0].set_xlabel(f"s along “{part.name}” in {length.name}")
    return fig


def _worth_seeing(part: ContactPart) -> ContactPart:
    """The part; if it is closed on a short stretch only, that stretch and its neighbourhood."""
    s, closed = part["s"], part["s"][part["contact"] == 1.0]
    if len(closed) < 2 or np.ptp(closed) > SHORT * np.ptp(s):
        return part
    room = np.ptp(closed)
    near = (s >= closed.min() - room) & (s <= closed.max() + room)
    columns = {name: values[near] for name, values in part.columns.items()}
    return replace(part, columns=columns, vertices=part.vertices[near], drops=part.drops[near])


def _panels(result: Result, part: ContactPart, length: Unit, way: str) -> Iterator[Callable[[Axes], None]]:
    """From the top: slip and friction, what a normal law acts on, the pressure."""

    def displacement(values: Array, words: str, direction: str) -> Callable[[Axes], None]:
        drops = _drops(result, part, direction)
        return partial(_displacement, part=part, values=values, drops=drops, words=words, length=length)

    yield displacement(part.slip, f"slip $u_t${way}", "slip")
    if result.resists(part.name, "slip", "separation"):
        yield partial(_friction, part=part, result=result, length=length, way=way)
    if result.resists(part.name, "opening", "separation"):
        yield displacement(-part["u_n"], "opening $-u_n$", "opening")
    if result.resists(part.name, "penetration"):
        yield displacement(part["u_n"], "penetration $u_n$", "penetration")
    yield partial(_pressure, part=part, length=length)


def _drops(result: Result, part: ContactPart, direction: str) -> Array:
    """Where the law of a part drops at each vertex, m, (m, j); of friction the result has it."""
    if direction == "slip":
        return part.drops
    law, multipliers = result.law(part.name, direction), result.multipliers(part, direction)
    if law is None or multipliers is None:
        return np.empty((len(part["s"]), 0))
    return multipliers[1][:, None] * law.concave.kinks


def _displacement(axes: Axes, part: ContactPart, values: Array, drops: Array, words: str, length: Unit) -> None:
    """What a law acts on, and the values at which the law drops."""
    unit = unit_for(_largest(values), "m")
    _line(axes, part, values, length, unit, BLUE)
    if np.any(np.ptp(drops, axis=0) > 0.0):
        _title(axes, f"{words} in {unit.name}", _changing_drops(axes, part, values, drops, length, unit))
        return
    shown, beyond = _within(drops[0], values)
    for kink in shown:
        axes.axhline(kink / unit.size, color=INK, ls=(0, (4, 3)), lw=1.4)
    note = ""
    if len(shown):
        note = f"dashed: the law drops at {_listed(shown)}"
    elif len(beyond):
        note = f"the law drops at {_listed(beyond)}, not reached"
    _title(axes, f"{words} in {unit.name}", note)


def _changing_drops(axes: Axes, part: ContactPart, values: Array, drops: Array, length: Unit, unit: Unit) -> str:
    """Draw where the law drops, which changes from vertex to vertex; says what the lines mean."""
    low, high = min(float(np.nanmin(values)), 0.0), max(float(np.nanmax(values)), 0.0)
    shown = [d for d in drops.T if np.any((d <= IN_RANGE * high) & (d >= IN_RANGE * low))]
    for drop in shown:
        inside = np.where((drop <= IN_RANGE * high) & (drop >= IN_RANGE * low), drop, np.nan)
        axes.plot(part["s"] / length.size, inside / unit.size, color=INK, ls=(0, (4, 3)), lw=1.4)
    return "dashed: the law drops there" if shown else "the law drops beyond, not reached"


def _within(kinks: Array, values: Array) -> tuple[Array, Array]:
    """The kinks worth drawing, and those too far away; on the side of the slips, of an even law's two."""
    low, high = min(float(np.nanmin(values)), 0.0), max(float(np.nanmax(values)), 0.0)
    near = (kinks <= IN_RANGE * high) & (kinks >= IN_RANGE * low)
    near &= ((kinks > 0.0) & (high > -0.1 * low)) | ((kinks < 0.0) & (low < -0.1 * high)) | (kinks == 0.0)
    return kinks[near], kinks[~near]


def _listed(kinks: Array) -> str:
    """An even law's two kinks are said as one."""
    return " and ".join(
        ("±" if -k in kinks and k else "") + quantity(k, "m") for k in kinks if k >= 0 or -k not in kinks
    )


def _friction(axes: Axes, *, part: ContactPart, result: Result, length: Unit, way: str) -> None:
    values = part.friction
    unit = unit_for(_largest(values), "Pa")
    law, note = result.law(part.name) if result.summary.get("smoothing") else None, ""
    if law is not None and (multipliers := result.multipliers(part)) is not None:
        multiplier, stretch = multipliers
        low, high = (multiplier * end for end in law.interval(part.slip.astype(np.float64) / stretch))
        note = "dashed: the law itself, unsmoothed"
        for bound in (low, high) if np.any(high > low) else (low,):
            axes.plot(part["s"] / length.size, bound / unit.size, color=INK, ls=(0, (4, 3)), lw=1.4, zorder=4)
    _line(axes, part, values, length, unit, GREEN)
    _title(axes, f"friction $-\\sigma_t${way} in {unit.name}", note or _pieces(axes, part, length, unit))


def _pieces(axes: Axes, part: ContactPart, length: Unit, unit: Unit) -> str:
    """Mark the vertices that have left the law's first piece; says what the mark means."""
    fallen = part["branch_t"] > 0
    if not fallen.any():
        return ""
    axes.plot(part["s"][fallen] / length.size, part.friction[fallen] / unit.size, "o", mfc="white", mec=GREEN, ms=6)
    return f"hollow: past the drop ({np.count_nonzero(fallen)} of {len(fallen)} vertices)"


def _pressure(axes: Axes, *, part: ContactPart, length: Unit) -> None:
    values = part.pressure
    unit = unit_for(_largest(values), "Pa")
    _line(axes, part, values, length, unit, VERMILION)
    axes.fill_between(part["s"] / length.size, values / unit.size, color=VERMILION, alpha=0.15, lw=0)
    off = part.lifted
    axes.plot(part["s"][off] / length.size, values[off] / unit.size, "o", mfc="white", mec=VERMILION, ms=6, zorder=5)
    extreme = float(values[np.nanargmax(np.abs(values))]) if np.isfinite(values).any() else 0.0
    note = f"largest {'tension ' if extreme < 0.0 else ''}{unit.text(abs(extreme))}"
    _title(axes, f"contact pressure $-\\sigma_n$ in {unit.name}", note)


def _line(axes: Axes, part: ContactPart, values: Array, length: Unit, unit: Unit, colour: str) -> None:
    marker = "o" if len(values) <= MARKED else ""
    size = 4.5 if len(values) <= MARKED // 2 else 3.0
    axes.plot(part["s"] / length.size, values / unit.size, color=colour, marker=marker, ms=size)


def _title(axes: Axes, words: str, note: str) -> None:
    axes.set_title(words, loc="left", size=14, parse_math=True)
    axes.set_title(note, loc="right", size=11.5, color=GREY)


def _finish(axes: Axes, part: ContactPart, length: Unit) -> None:
    """Zero is always in sight: a pressure that is uniform to a thousandth should look so."""
    bottom, top = axes.get_ylim()
    low, high = min(0.0, *axes.dataLim.intervaly), max(0.0, *axes.dataLim.intervaly)
    low, high = min(low, *(bottom,) if bottom < 0 and low < 0 else (low,)), max(high, top if high > 0 else high)
    room = 0.06 * (high - low or 1.0)
    axes.set_ylim(low - room, high + room)
    axes.axhline(0.0, color=GREY, lw=0.8, zorder=1)
    start, end = float(np.min(part["s"])) / length.size, float(np.max(part["s"])) / length.size
    axes.set_xlim(start - 0.015 * (end - start), end + 0.015 * (end - start))
    ticks = MaxNLocator(nbins=4, min_n_ticks=3, steps=[1, 2, 2.5, 5, 10])
    axes.yaxis.set_major_locator(ticks if high > low else FixedLocator([0.0]))
    axes.grid(axis="y", color="#e6e6e6", lw=0.8)
    axes.set_axisbelow(True)


def _lifted_spans(part: ContactPart) -> list[tuple[float, float]]:
    """Stretches of s whose vertices are lifted; each vertex stands for half the way to its neighbours."""
    s = part["s"]
    middles = np.concatenate([s[:1], (s[1:] + s[:-1]) / 2, s[-1:]])
    return [(float(middles[a]), float(middles[b])) for a, b in _runs(part.lifted)]


def _runs(flags: Mask) -> Iterator[tuple[int, int]]:
    """Where flags are set, as half-open ranges."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(int), [0]])))
    yield from zip(map(int, edges[::2]), map(int, edges[1::2]), strict=True)


def _say_lifted(fig: Figure, gap: float) -> None:
    """What the veil means, above the panels, where no curve is."""
    key = Patch(fc=ORANGE, alpha=2 * VEIL, label=f"lifted, up to {quantity(gap, 'm')}")
    place = ((LEFT + ACROSS) / WIDTH, 1 - (HEADING + 0.08) / fig.get_figheight())
    fig.legend(handles=[key], loc="center right", bbox_to_anchor=place, frameon=False, fontsize=12, borderpad=0.0,
               borderaxespad=0.0)  # fmt: skip


def _largest(values: Array) -> float:
    return float(np.nanmax(np.abs(values), initial=0.0))
