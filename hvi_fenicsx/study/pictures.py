"""The pictures of a study: error over time, over the mesh width and over ε, each for a few quantities."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from ..report.pictures.style import BLUE, GREEN, GREY, INK, ORANGE, PURPLE, VERMILION, figure, save, titled
from .errors import NORMS
from .table import Row, Study

_COLOURS = {None: GREEN, "quadratic": BLUE, "chks": PURPLE, "log_exp": ORANGE, "paper": VERMILION}
_PICTURES: Mapping[str, tuple[str, str]] = {
    "work_precision": ("seconds", "time to solution in s, without compilation and output"),
    "error_h": ("h", "mesh width h in m"),
    "error_epsilon": ("epsilon", "ε, relative to the law's energy at its kink, on the scene's own mesh"),
}
"""By file: the attribute of a row that the error is drawn over, and what it is."""


def draw(study: Study, folder: Path) -> None:
    """Draw all that the study has values for.

    Args:
        study: what was found.
        folder: where to.
    """
    for name, (along, label) in _PICTURES.items():
        lines = {name: rows for name, rows in _lines(study, along).items() if along == "seconds" or len(rows) > 1}
        if lines and study.headlines():
            save(_page(study, along, label, lines), folder / f"{name}.png", f"Error over {label}.")


def _page(study: Study, along: str, label: str, lines: Mapping[str, list[Row]]) -> Figure:
    """A panel for each quantity, the traction first: it is what accuracy costs most in."""
    drawn = study.headlines()[::-1]
    fig = figure(0.5 + 2.9 * len(drawn))
    titled(fig, study.title or "untitled", f"error over {label}")
    panels = fig.subplots(len(drawn), 1, sharex=True, squeeze=False)[:, 0]
    for axes, quantity in zip(panels, drawn, strict=True):
        axes.set(xscale="log", yscale="log")
        for name, rows in lines.items():
            _line(axes, rows, along, quantity, name)
        _beside(axes, study, along, quantity)
        _dress(axes, study, quantity)
    handles = {text: line for axes in panels for line, text in zip(*axes.get_legend_handles_labels(), strict=True)}
    fig.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=3, fontsize=10)
    _label(panels[-1].xaxis)
    panels[-1].set_xlabel(label)
    return fig


def _lines(study: Study, along: str) -> dict[str, list[Row]]:
    """The certified rows that are drawn together, by what they are called."""
    own, found = study.own, dict[str, list[Row]]()
    for row in study.rows:
        degree = f", degree {row.degree}" if row.degree != own.degree else ""
        name = (row.law if along == "h" else row.smoothing or "exact law") + degree
        if along == "seconds":
            name += "" if row.method == "auto" else ", another method"
        elif row.way != own.way or (along == "epsilon" and row.mesh != own.mesh):
            continue
        if row.converged and getattr(row, along):
            found.setdefault(name, []).append(row)
    return found


def _line(axes: Axes, rows: list[Row], along: str, quantity: str, name: str) -> None:
    """Errors in the colour of the smoothing and with the marker of the degree; over time they are points alone."""
    known = sorted((getattr(r, along), e) for r in rows if (e := r.error(quantity)) is not None)
    marker = "D" if rows[0].method != "auto" else "o" if rows[0].degree == 1 else "s"
    (line,) = axes.plot([x for x, _ in known], [e for _, e in known], marker + ("" if along == "seconds" else "-"))
    line.set(color=_COLOURS.get(rows[0].smoothing, GREY), markersize=6, markeredgecolor="white", label=name)


def _beside(axes: Axes, study: Study, along: str, quantity: str) -> None:
    """The scene's own setting, a star; over time the front, over ε the exact law on the same mesh."""
    own, x, exact = study.own.error(quantity), getattr(study.own, along), study.exact.error(quantity)
    if own is not None and x:
        axes.plot(x, own, "*", ms=18, mfc="none", mec=INK, mew=1.5, zorder=6, label="the scene's own")
    if along == "seconds" and (front := study.front(quantity)):
        points = [(r.seconds, r.error(quantity)) for r in front]
        axes.plot(*zip(*points, strict=True), color=INK, lw=1.6, zorder=1, drawstyle="steps-post", label="the front")
    if along == "epsilon" and exact is not None:
        axes.axhline(exact, color=GREEN, ls="--", lw=2, label="exact law")


def _dress(axes: Axes, study: Study, quantity: str) -> None:
    """The title and the grid; the reference's own error is a grey band from below."""
    axes.grid(which="major", color="#e6e6e6", lw=0.8)
    axes.set_title(f"error in {NORMS[quantity][1]}".replace("_t", "ₜ").replace("_n", "ₙ").replace("-", "−"), loc="left")
    _label(axes.yaxis)
    axes.yaxis.set_major_formatter(lambda value, _: f"{100 * value:g} %")
    low, own = axes.get_ylim()[0], study.certain[quantity].error
    if own is not None and own > low:
        axes.axhspan(low, own, color=GREY, alpha=0.16, lw=0, zorder=0, label="the reference's own error")


def _label(axis: Axis) -> None:
    """Label a logarithmic axis at the powers of ten, between few of them at 2 and 5 too."""
    low, high = axis.get_view_interval()
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < 1e3 * low else (1.0,)))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_formatter("")
