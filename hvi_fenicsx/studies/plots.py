"""The pictures of a study, one page each. To add one, write a function here under :func:`study_picture`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from ..report.pictures.style import (
    BLUE,
    GREEN,
    GREY,
    HEADING,
    INK,
    ORANGE,
    PALE,
    area,
    figure,
    save,
    titled,
)
from .cost import PHASES
from .plot_axes import LEAST, apart, error_axis, plain_log, span, time_axis
from .plot_page import FOOT, Kind, colour, kinds, legend, marker, page, quantities
from .sentences import order, over_h, seconds
from .study import Study
from .table import Row, front

_PHASE_COLOURS = dict(zip(PHASES, (PALE, "#8fb8d6", ORANGE, BLUE, GREEN), strict=True))
_BARS = 12
"""Bars of the picture of time, at most."""


@dataclass(frozen=True)
class StudyPicture:
    """A picture of a study.

    Attributes:
        caption: what a reader sees under it.
        make: draws it; None where the study has no values for it.
    """

    caption: str
    make: Callable[[Study], Figure | None]


PICTURES: dict[str, StudyPicture] = {}
"""All by the names of their files, without the ending."""
Maker = Callable[[Study], Figure | None]


def study_picture(name: str, *, caption: str) -> Callable[[Maker], Maker]:
    """Register the function below as a picture of a study.

    Args:
        name: of its file, without the ending.
        caption: what a reader sees under it.
    """

    def register(make: Maker) -> Maker:
        PICTURES[name] = StudyPicture(caption, make)
        return make

    return register


def draw(study: Study, folder: Path) -> None:
    """Draw all that the study has values for.

    Args:
        study: what was found.
        folder: where to.
    """
    for name, picture in PICTURES.items():
        fig = picture.make(study)
        if fig is not None:
            save(fig, folder / f"{name}.png", picture.caption)


@study_picture(
    "work_precision",
    caption="Error against time: each point a run, the line what nothing cheaper is as accurate as.",
)
def _work_precision(study: Study) -> Figure | None:
    drawn = quantities(study)[:2]
    if not any(r.seconds for r in study.rows):
        return None
    fig, axes = page(study, "what accuracy costs: a point is a setting, down and left is better", len(drawn))
    for quantity, here in zip(drawn, axes, strict=True):
        _cost_panel(here, study, quantity)
        here.tick_params(labelbottom=here is axes[-1])
    legend(axes[0], kinds(study))
    axes[-1].set_xlabel("time to solution, without compilation and output")
    low, high = span([r.seconds for r in study.rows if r.converged and r.seconds])
    for here in axes:
        here.set_xlim(low / 3.0, high * 1.3)
    time_axis(axes[-1])
    return fig


def _cost_panel(axes: Axes, study: Study, quantity: str) -> None:
    known = [(r.seconds, e, r) for r in study.rows if (e := r.error(quantity)) is not None and r.seconds]
    for s, e, r in known:
        here = marker(r)
        axes.plot(s, max(e, LEAST), here, color=colour(r.smoothing), ms=6.5, alpha=0.85, mec="white", mew=0.6)
    own = study.own
    if (error := own.error(quantity)) is not None and own.seconds:
        axes.plot(own.seconds, max(error, LEAST), "*", ms=19, mfc="none", mec=INK, mew=1.5, zorder=6)
    error_axis(axes, quantity, study.certain[quantity].error, [e for _, e, _ in known])
    if best := front(study.rows, quantity, study.certain):
        _front_line(axes, best, quantity)


def _front_line(axes: Axes, best: Sequence[Row], quantity: str) -> None:
    points = [(r.seconds or 0.0, max(r.error(quantity) or 0.0, LEAST)) for r in best]
    xs, ys = zip(*points, strict=True)
    axes.plot(xs, ys, color=INK, lw=1.6, zorder=1, drawstyle="steps-post")
    named: list[float] = []
    for r, (x, y) in zip(best, points, strict=True):  # the cheapest first: nothing stands to the left of it
        if all(apart(axes, y, other) for other in named):
            named.append(y)
            axes.annotate(
                _short(r), (x, y), (-8, -2), textcoords="offset points", ha="right", va="center", size=10, zorder=7,
                path_effects=[withStroke(linewidth=3, foreground="white")],
            )  # fmt: skip


def _short(found: Row) -> str:
    degree = "degree 2, " if found.degree == 2 else ""
    return f"{found.mesh.removesuffix(' cells')}, {degree}{found.law.replace('exact law', 'exact')}"


@study_picture(
    "error_h", caption="Error against the mesh width; a power of h is that of the exact law at the two finest meshes."
)
def _against_h(study: Study) -> Figure | None:
    drawn = [q for q in quantities(study) if len(over_h(study.rows, study.own, q)) > 1][:3]
    if not drawn:
        return None
    fig, axes = page(study, "error against the mesh width h", len(drawn), 2.3, 4.6)
    for quantity, here in zip(drawn, axes, strict=True):
        values, ends = _lines_over_h(here, study, quantity)
        found = order(study.rows, study.own, quantity, study.certain)
        note = "" if found is None else f"exact law: h^{found:.2f}"
        error_axis(here, quantity, study.certain[quantity].error, values, note)
        _name_lines(here, ends)
        here.tick_params(labelbottom=here is axes[-1])
        plain_log(here)
        here.set_xticks(sorted({h for h, _ in over_h(study.rows, study.own, quantity)}))
        here.invert_xaxis()
    axes[-1].set_xlabel("mesh width h in m, finer to the right")
    return fig


End = tuple[float, float, str, str]
"""Where a line ends at the fine mesh (h, error), its name and colour."""


def _lines_over_h(axes: Axes, study: Study, quantity: str) -> tuple[list[float], list[End]]:
    """The exact law, then each smoothing by its width, bolder where it is narrower; the errors drawn, and the ends."""
    curves = _curves(study)
    ends: list[End] = []
    values: list[float] = []
    for i, like in enumerate(curves):
        points = over_h(study.rows, study.own, quantity, law=like.law, degree=like.degree)
        if len(points) < 2:
            continue
        xs, ys = zip(*points, strict=True)
        shown = [max(y, LEAST) for y in ys]
        thin: dict[str, Any] = {"lw": 1.5, "alpha": 0.35 + 0.6 * i / len(curves)}
        style = thin if like.smoothing else {"lw": 2.6, "zorder": 5}
        axes.plot(xs, shown, marker(like) + "-", color=colour(like.smoothing), ms=5, **style)
        degree = f", degree {like.degree}" if like.degree != study.own.degree else ""
        ends.append((xs[-1], shown[-1], like.law + degree, colour(like.smoothing)))
        values += shown
    return values, ends


def _curves(study: Study) -> list[Row]:
    """One row of each law and degree: the exact law, then each smoothing by its width."""
    own = [r for r in study.rows if r.converged and r.method == study.own.method]
    found = {(r.law, r.degree): r for r in own}
    return sorted(found.values(), key=lambda r: (r.smoothing or "", -(r.epsilon or 0.0), r.degree))


def _name_lines(axes: Axes, ends: Sequence[End]) -> None:
    """At the fine end; lines that end together share a name."""
    groups: list[list[End]] = []
    for end in sorted(ends, key=lambda e: -e[1]):
        if groups and not apart(axes, end[1], groups[-1][-1][1]):
            groups[-1].append(end)
        else:
            groups.append([end])
    for group in groups:
        exact = next((e for e in group if e[2].startswith("exact law")), group[0])
        words = exact[2] if len(group) == 1 else f"{exact[2]} and {len(group) - 1} more"
        axes.annotate(words, exact[:2], (8, 0), textcoords="offset points", size=10, color=exact[3], va="center")


@study_picture("error_epsilon", caption="Error against ε, the width of the smoothing.")
def _against_epsilon(study: Study) -> Figure | None:
    drawn = [q for q in quantities(study) if any(len(p) > 1 for _, _, p in _over_epsilon(study, q))][:3]
    if not drawn:
        return None
    fig, axes = page(study, f"error against ε; {study.exact.mesh}; dashed: the exact law", len(drawn), 2.3)
    shown: dict[str, Kind] = {}
    for quantity, here in zip(drawn, axes, strict=True):
        values: list[float] = []
        for kind, shade, points in _over_epsilon(study, quantity):
            xs, ys = zip(*points, strict=True)
            here.plot(xs, [max(y, LEAST) for y in ys], "o-", color=shade, ms=6)
            shown[kind] = ("o", shade, kind)
            values += ys
        if (bare := study.exact.error(quantity)) is not None:
            here.axhline(max(bare, LEAST), color=GREEN, ls=(0, (4, 3)), lw=2)
            values.append(bare)
        if (own := study.own.error(quantity)) is not None and study.own.epsilon:
            here.plot(study.own.epsilon, max(own, LEAST), "*", ms=19, mfc="none", mec=INK, mew=1.5, zorder=6)
            values.append(own)
            shown["~own"] = ("*", INK, "the scene's own")
        error_axis(here, quantity, study.certain[quantity].error, values)
        plain_log(here)
        here.tick_params(labelbottom=here is axes[-1])
    legend(axes[0], [shown[k] for k in sorted(shown)])
    axes[-1].set_xlabel("ε, relative to the law's energy at its kink")
    return fig


def _over_epsilon(study: Study, quantity: str) -> list[tuple[str, str, list[tuple[float, float]]]]:
    """Smoothing, colour, and (ε, error) of the points on the scene's own mesh with its method, by falling ε."""
    own, found = study.own, []
    for kind in sorted({r.smoothing for r in study.rows if r.smoothing}):
        points = {
            r.epsilon: e
            for r in study.rows
            if (r.smoothing, r.degree, r.mesh) == (kind, own.degree, own.mesh)
            and (r.method, r.tolerance) == (own.method, own.tolerance)
            and r.epsilon is not None
            and (e := r.error(quantity)) is not None
        }
        if points:
            found.append((kind, colour(kind), sorted(points.items())))
    return found


@study_picture("time", caption="Where the time goes.")
def _time(study: Study) -> Figure | None:
    rows = _bars(study)
    if not rows:
        return None
    fig = figure(HEADING + 0.42 * len(rows) + 0.55 + FOOT)
    titled(fig, study.scene.title or "untitled", "where the time goes: the scene's own setting and the front")
    axes = area(fig, 3.1, FOOT, 4.2, 0.42 * len(rows))
    for i, r in enumerate(reversed(rows)):
        left = 0.0
        for phase in PHASES:
            length = (r.phases or {}).get(phase, 0.0)
            axes.barh(i, length, left=left, color=_PHASE_COLOURS[phase], height=0.72)
            left += length
        axes.text(left, i, f" {seconds(r.seconds)}", va="center", size=10.5, color=GREY)
    axes.set_yticks(range(len(rows)), [_bar_name(study, r) for r in reversed(rows)], size=10.5)
    axes.tick_params(axis="y", length=0, labelcolor=INK)
    axes.set_xlim(0, 1.12 * max(r.seconds or 0.0 for r in rows))
    axes.set_xlabel("seconds, without compilation and output")
    for phase in PHASES:
        axes.bar(0, 0, color=_PHASE_COLOURS[phase], label=phase)
    axes.legend(loc="lower right", bbox_to_anchor=(1.03, 1.0), ncols=len(PHASES), frameon=False, fontsize=11,
                handlelength=1.0, handletextpad=0.4, columnspacing=1.0)  # fmt: skip
    return fig


def _bars(study: Study) -> list[Row]:
    """The front of the first quantity and the scene's own setting, by cost."""
    drawn = quantities(study)
    best = front(study.rows, drawn[0], study.certain)[-(_BARS - 2) :] if drawn else []
    chosen = {r.point: r for r in (*best, study.own, study.exact) if r.converged and r.phases}
    return sorted(chosen.values(), key=lambda r: r.seconds or 0.0)


def _bar_name(study: Study, found: Row) -> str:
    words = found.text.replace(" cells", "").replace("exact law", "exact")
    return f"★ {words}" if found.point == study.own.point else words
