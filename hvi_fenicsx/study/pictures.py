"""The pictures of a study: error over time, over the mesh width and over ε, each for a few quantities."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from ..report.pictures.style import BLUE, GREEN, GREY, INK, ORANGE, PURPLE, VERMILION, figure, save, titled
from .errors import NORMS
from .table import Row, Study, duration

LEAST = 1e-6
"""A smaller error is drawn on it."""
_COLOURS = {None: GREEN, "quadratic": BLUE, "chks": PURPLE, "log_exp": ORANGE, "paper": VERMILION}
Draw = Callable[[Axes, Study, str], bool]
"""Draws the errors in one quantity; whether there are any."""


def draw(study: Study, folder: Path) -> None:
    """Draw all that the study has values for.

    Args:
        study: what was found.
        folder: where to.
    """
    for name, (caption, subject, label, make) in _PICTURES.items():
        fig = _page(study, subject, label, make)
        if fig is not None:
            save(fig, folder / f"{name}.png", caption)


def _page(study: Study, subject: str, label: str, make: Draw) -> Figure | None:
    """A panel for each quantity, the traction first: it is what accuracy costs most in."""
    drawn = study.headlines()[::-1]
    fig = figure(1.4 + 2.9 * len(drawn))
    titled(fig, study.title or "untitled", subject)
    panels = fig.subplots(len(drawn), 1, sharex=True, squeeze=False)[:, 0] if drawn else []
    fig.subplots_adjust(left=0.13, right=0.7, top=1 - 1.25 / fig.get_figheight(), bottom=0.75 / fig.get_figheight())
    for axes in panels:
        axes.set(xscale="log", yscale="log")
    shown = [make(axes, study, quantity) for axes, quantity in zip(panels, drawn, strict=True)]
    if not any(shown):
        return None
    for axes, quantity in zip(panels, drawn, strict=True):
        _error_axis(axes, study, quantity)
    handles = {text: line for axes in panels for line, text in zip(*axes.get_legend_handles_labels(), strict=True)}
    panels[0].legend(
        handles.values(), handles.keys(), loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False, fontsize=10
    )
    panels[-1].set_xlabel(label)
    return fig


def _error_axis(axes: Axes, study: Study, quantity: str) -> None:
    """The title and the grid; the reference's own error is a grey band from below."""
    axes.grid(which="major", color="#e6e6e6", lw=0.8)
    axes.set_title(f"error in {NORMS[quantity][1]}".replace("_t", "ₜ").replace("_n", "ₙ").replace("-", "−"), loc="left")
    _label(axes.yaxis, lambda y: f"{_decimal(100 * y)} %")
    low, own = axes.get_ylim()[0], study.certain[quantity].error
    if own is not None and own > low:
        axes.axhspan(low, own, color=GREY, alpha=0.16, lw=0, zorder=0, label="the reference's own error")


def _label(axis: Axis, text: Callable[[float], str]) -> None:
    """Label a logarithmic axis at the powers of ten, between few of them at 2 and 5 too."""
    low, high = axis.get_view_interval()
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < 1e3 * low else (1.0,)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: text(value)))
    axis.set_minor_formatter(NullFormatter())


def _decimal(value: float) -> str:
    """A number without a power of ten, however small, since those of one axis should look alike."""
    return np.format_float_positional(value, precision=3, fractional=False, trim="-")


def _line(axes: Axes, points: Sequence[tuple[float, float]], row: Row, text: str, style: str = "-") -> None:
    """Points in the colour of the smoothing and the marker of the degree."""
    xs, ys = zip(*points, strict=True)
    shown = [max(y, LEAST) for y in ys]
    marker = "D" if row.method != "auto" else "o" if row.degree == 1 else "s"
    axes.plot(xs, shown, marker + style, color=_COLOURS.get(row.smoothing, GREY), ms=6, mec="white", label=text)


def _over_time(axes: Axes, study: Study, quantity: str) -> bool:
    known = [((r.seconds, e), r) for r in study.rows if (e := r.error(quantity)) is not None and r.seconds]
    for point, row in known:
        degree = ", degree 2" if row.degree == 2 else ""
        method = "" if row.method == "auto" else ", another method"
        _line(axes, [point], row, (row.smoothing or "exact law") + degree + method, style="")
    _own(axes, study.own.seconds, study, quantity)
    front = [(r.seconds, max(r.error(quantity) or 0.0, LEAST)) for r in study.front(quantity)]
    if front:
        axes.plot(*zip(*front, strict=True), color=INK, lw=1.6, zorder=1, drawstyle="steps-post", label="the front")
    _label(axes.xaxis, duration)
    return bool(known)


def _own(axes: Axes, x: float | None, study: Study, quantity: str) -> None:
    """The scene's own setting, a star."""
    error = study.own.error(quantity)
    if x and error is not None:
        axes.plot(x, max(error, LEAST), "*", ms=18, mfc="none", mec=INK, mew=1.5, zorder=6, label="the scene's own")


def _over_h(axes: Axes, study: Study, quantity: str) -> bool:
    kinds = {(r.law, r.degree): r for r in study.rows if r.converged}
    lines = [(study.over_h(quantity, row), row) for row in kinds.values()]
    lines = [(points, row) for points, row in lines if len(points) > 1]
    for points, row in sorted(lines, key=lambda line: (line[1].smoothing or "", -(line[1].epsilon or 0.0))):
        order = study.order(quantity, row) if row.smoothing is None else None
        degree = f", degree {row.degree}" if row.degree != study.own.degree else ""
        _line(axes, points, row, row.law + degree)
        if order is not None:
            axes.annotate(
                f"h^{order:.2f}", (points[-1][0], max(points[-1][1], LEAST)), (6, 0), textcoords="offset points"
            )
    _label(axes.xaxis, _decimal)
    return bool(lines)


def _over_epsilon(axes: Axes, study: Study, quantity: str) -> bool:
    own, kinds = study.own, dict[str, list[tuple[float, float, Row]]]()
    wanted = (own.degree, own.mesh, own.method, own.tolerance)
    for row in study.rows:
        error = row.error(quantity)
        if (row.degree, row.mesh, row.method, row.tolerance) == wanted and row.epsilon and error is not None:
            kinds.setdefault(str(row.smoothing), []).append((row.epsilon, error, row))
    for kind, found in kinds.items():
        points = sorted((epsilon, error) for epsilon, error, _ in found)
        _line(axes, points, found[0][2], kind)
    if (bare := study.exact.error(quantity)) is not None:
        axes.axhline(max(bare, LEAST), color=GREEN, ls="--", lw=2, label="exact law")
    _own(axes, own.epsilon, study, quantity)
    _label(axes.xaxis, _decimal)
    return any(len(found) > 1 for found in kinds.values())


_PICTURES: Mapping[str, tuple[str, str, str, Draw]] = {
    "work_precision": (
        "Error against time: each point a run, the line what nothing cheaper is as accurate as.",
        "what accuracy costs: a point is a setting, down and left is better",
        "time to solution, without compilation and output",
        _over_time,
    ),
    "error_h": (
        "Error against the mesh width; a power of h is that of the two finest meshes.",
        "error against the mesh width h",
        "mesh width h in m",
        _over_h,
    ),
    "error_epsilon": (
        "Error against ε, the width of the smoothing.",
        "error against ε on the scene's own mesh",
        "ε, relative to the law's energy at its kink",
        _over_epsilon,
    ),
}
"""By file: the caption, the subject, the words along x, and what draws a panel."""
