"""What the pictures of a study share: pages of panels, colours and markers of the points, the legend."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..report.pictures.style import (
    BLUE,
    GREEN,
    GREY,
    HEADING,
    INK,
    ORANGE,
    PURPLE,
    VERMILION,
    area,
    figure,
    titled,
)
from .sentences import degrees, headlines, main_quantity
from .study import Study
from .table import Row

PANEL, GAP, FOOT = 2.6, 0.6, 0.85
"""Inches: a panel, the room for its title, the axis below the last."""
_SMOOTHINGS = {None: GREEN, "quadratic": BLUE, "chks": "#56B4E9", "log_exp": ORANGE, "paper": VERMILION}
_OTHER_SMOOTHING = PURPLE
_IN_LINE = 6
"""Kinds of points that one line of the legend holds."""


def page(study: Study, subject: str, panels: int, tall: float = PANEL, wide: float = 6.5) -> tuple[Figure, list[Axes]]:
    """Panels below each other, the first at the top.

    Args:
        study: whose title stands above them.
        subject: what is shown.
        panels: how many.
        tall: height of each, inches.
        wide: width of each, inches.
    """
    fig = figure(HEADING + panels * (tall + GAP) + FOOT)
    titled(fig, study.scene.title or "untitled", subject)
    places = reversed(range(panels))
    return fig, [area(fig, 1.15, FOOT + above * (tall + GAP), wide, tall) for above in places]


def quantities(study: Study) -> list[str]:
    """The quantities that are drawn, the traction first: it is what accuracy costs most in."""
    found = headlines(study.rows)
    return sorted(found, key=lambda q: q != main_quantity(found))


def colour(smoothing: str | None) -> str:
    """A smoothing's colour; those of the user's own share one."""
    return _SMOOTHINGS.get(smoothing, _OTHER_SMOOTHING)


def marker(found: Row) -> str:
    """The marker of a point: round at degree 1, square at degree 2, a diamond by another method."""
    if found.method != "auto":
        return "D"
    return "o" if found.degree == 1 else "s"


Kind = tuple[str, str, str]
"""Marker, colour and name of a kind of points."""


def kinds(study: Study) -> list[Kind]:
    """The kinds of points that there are."""
    there = {r.smoothing for r in study.rows if r.converged}
    ordered = [*(s for s in _SMOOTHINGS if s in there), *sorted(s for s in there if s and s not in _SMOOTHINGS)]
    found = [("o", colour(s), "exact law" if s is None else s) for s in ordered]
    if len(degrees(study.rows)) > 1:
        found.append(("s", GREY, "degree 2"))
    if any(r.method != "auto" for r in study.rows if r.converged):
        found.append(("D", GREY, "another method"))
    return [*found, ("*", INK, "the scene's own")]


def legend(axes: Axes, found: Sequence[Kind]) -> None:
    """Write the kinds of points above a panel, in two lines where one would not hold them.

    Args:
        axes: the panel.
        found: the kinds.
    """
    for marker, shade, name in found:
        hollow: dict[str, Any] = {"mfc": "none", "mec": INK} if marker == "*" else {"mec": "white"}
        axes.plot([], [], marker, color=shade, label=name, ms=13 if marker == "*" else 7, **hollow)
    columns = len(found) if len(found) <= _IN_LINE else -(-len(found) // 2)
    axes.legend(
        loc="lower right", bbox_to_anchor=(1.015, 1.085), ncols=columns, frameon=False, fontsize=10,
        handletextpad=0.0, columnspacing=0.6, borderaxespad=0.0,
    )  # fmt: skip
