"""The command ``hvi study``: what accuracy costs in time. Run, measured, drawn and written into a folder."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from ..errors import ExitCode
from ..report.errors import ReportError
from ..report.html import study_page
from ..results.folder import inputs_of
from ..results.output_folder import Existing, OutputFolder
from ..runtime import terminal, writing
from ..runtime.manifest import MARKS
from ..runtime.versions import __version__, versions
from ..scene import read_scene
from . import axes, plots, table
from .error_norms import ERROR_NORMS
from .errors import NoReferenceError
from .plan import Plan, make
from .progress import StudyProgress
from .runner import PointRun, Runner, watched
from .sentences import headlines, of_error, sentences, share_of_epsilon
from .setting import Setting
from .store import Store, write_json
from .study import Study, evaluate
from .thresholds import DEFAULT

MARK = MARKS["study"]


def run(options: argparse.Namespace) -> int:
    """Run a study into a folder; the exit code. On one process: the points start their own.

    Raises:
        InputError: the scene, the plan or the folder cannot be used.
        NoReferenceError: no solution exists (3), or the reference is not certified (4).
        StudyInterruptedError: a signal came (130); finished points are kept.
    """
    scene = read_scene(options.scene, options.overrides)
    plan = make(scene, [axes.read(text) for text in options.axis])
    folder = OutputFolder(options.out or Path("results") / f"{options.scene.stem}-study", "study")
    try:
        folder.check(_existing(options), [options.scene])
        if options.force:
            folder.clear()
        with watched(folder.target), folder.told():
            _fill(folder, plan, options)
    finally:
        folder.close()
    return 0


def _fill(folder: OutputFolder, plan: Plan, options: argparse.Namespace) -> None:
    """Run the points, measure them, write and tell what they say."""
    store = Store(folder.target, options.np or 1)
    store.open()
    with StudyProgress() as progress:
        repeat, limit = options.repeat or DEFAULT.repetitions, options.limit or DEFAULT.time_limit
        _run(plan, Runner(store, repeat, limit, progress))
    study = evaluate(plan, store)
    warnings = [f"warning: {text}" for text in fill(folder, study, store)]
    place = f"{folder.target}: {MARK}, study.csv, pictures"
    terminal.say("\n".join([*_heading(study), *said(study), *warnings, place]))


def fill(folder: OutputFolder, study: Study, store: Store) -> list[str]:
    """Write tables, pictures and page of a study beside its points.

    Args:
        folder: that of the study.
        study: what was found.
        store: the points, in that folder.

    Returns:
        What could not be done, or was moved aside, in words.
    """
    work = folder.stage()
    plots.draw(study, work)
    write(study, work)
    without_page = list(_failed_page(work))
    kept = folder.move_in(inputs_of(study.scene, folder.target), store.listed())
    return [*without_page, *kept]


def _failed_page(folder: Path) -> Iterator[str]:
    """Write the page; why it cannot be made costs a line, not the study."""
    try:
        study_page.write(folder)
    except ReportError as error:
        yield str(error)


def _existing(options: argparse.Namespace) -> Existing:
    return "replace" if options.force else "resume" if options.resume else "refuse"


def _run(plan: Plan, runner: Runner) -> None:
    """The reference first: without it the rest is in vain."""
    references = [PointRun(setting, stiffness=i == 0) for i, setting in enumerate(plan.reference)]
    wanted = {runner.store.name(one.setting): one for one in (*references, *map(PointRun, plan.points))}
    wanted |= {runner.store.name(references[0].setting): references[0]}
    runs = list(wanted.values())
    runner.run(runs[:1], runs)
    check_reference(plan.reference[0], runner.store)
    runner.run(runs, runs)


def check_reference(reference: Setting, store: Store) -> None:
    """Refuse a reference that is not certified.

    Args:
        reference: its setting.
        store: where it is.

    Raises:
        NoReferenceError: with the reason.
    """
    record = store.record(reference) or {}
    if not record.get("converged"):
        raise NoReferenceError(
            f"the reference ({reference.mesh}, exact law) has no certified solution: {record.get('reason')}; "
            "see `hvi run`, or choose coarser meshes with --axis mesh=...",
            record.get("exit_code") or ExitCode.NOT_CONVERGED,
        )


def write(study: Study, folder: Path) -> None:
    """Write ``study.csv`` and, last, ``study.json``.

    Args:
        study: what was found.
        folder: where to.
    """
    writing.text(folder / "study.csv", table.as_csv(study.rows))
    write_json(folder / MARK, as_data(study))


def said(study: Study) -> list[str]:
    """What a study says, in sentences."""
    known = [(q, study.certain[q].error) for q in headlines(study.rows)]
    parts = [f"{of_error(e)} in {ERROR_NORMS[q].name}" for q, e in known if e is not None]
    sure = f"itself uncertain by {', '.join(parts)}" if parts else "on the only mesh there is"
    reference = f"{study.reference.text} ({study.reference.dofs or 0:,} unknowns)"
    return [
        *sentences(study.rows, study.own, study.exact, study.certain),
        f"Measured against {reference}, {sure}.",
    ]


def as_data(study: Study) -> dict[str, Any]:
    """All of ``study.json`` (docs/study.md)."""
    return {
        "scene": study.scene.title,
        "version": __version__,
        "ranks": study.ranks,
        "sentences": said(study),
        "quantities": {key: norm.description for key, norm in ERROR_NORMS.items()},
        "headlines": headlines(study.rows),
        "own": study.own.point,
        "exact": study.exact.point,
        "share_of_epsilon": {q: share_of_epsilon(study.own, study.exact, q) for q in ERROR_NORMS},
        "reference": {
            **asdict(study.reference),
            "certainty": {q: asdict(c) for q, c in study.certain.items()},
            "errors_of_coarser_meshes": list(study.coarser),
        },
        "fronts": {q: [r.point for r in table.front(study.rows, q, study.certain)] for q in ERROR_NORMS},
        "points": table.as_data(study.rows),
        "left_out": list(study.left_out),
        "versions": versions(),
    }


def _heading(study: Study) -> Sequence[str]:
    title = study.scene.title or "untitled"
    certified = sum(r.converged for r in study.rows)
    ranks = "1 rank" if study.ranks == 1 else f"{study.ranks} ranks"
    lines = [f"{title}: {len(study.rows)} points, {certified} certified, on {ranks}"]
    if study.left_out:
        lines.append(f"{len(study.left_out)} combinations are no scenes, like {study.left_out[0]}")
    return lines
