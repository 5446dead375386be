"""What accuracy costs in time: a scene solved along several axes, each point measured against a verified reference."""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from scipy import sparse

from ..errors import ExitCode, HviError
from ..report.html import study_page as page
from ..runtime.versions import __version__, versions
from ..scene import Scene, read_scene
from . import meshes, plots, sentences, solution_fields, table
from .errors import QUANTITIES, Errors, Moved, Yardstick
from .meshes import Setting
from .plan import Plan, axis, make
from .progress import Progress
from .reference import Certainty, certainty
from .runner import Job, Runner, stiffness_path, watched
from .store import MARK, Existing, Store, write_json, write_text
from .table import Row, front, row

REPEAT, LIMIT = 9, 120.0
"""Repetitions of a point at most, and seconds that it may take, unless the user says so."""


class ReferenceError(HviError):
    """There is nothing to measure against; the exit code is that of the reference's run."""

    def __init__(self, message: str, code: int) -> None:
        super().__init__(message)
        self.exit_code = code


@dataclass(frozen=True)
class Study:
    """A finished study.

    Attributes:
        scene: what was studied. rows: the points, cheapest mesh first. own, exact: the scene's own setting, and the
            exact law on its mesh. certain: how sure the reference is, by quantity. reference: its row.
        below: errors of the next coarser rungs against the reference, finest first. left_out: combinations not run.
        ranks: that the points ran on.
    """

    scene: Scene
    rows: tuple[Row, ...]
    own: Row
    exact: Row
    certain: Mapping[str, Certainty]
    reference: Row
    below: tuple[Errors, ...]
    left_out: tuple[str, ...]
    ranks: int

    @property
    def sentences(self) -> list[str]:
        """What it says, in words."""
        return [*sentences.all_of_them(self.rows, self.own, self.exact, self.certain), self._measured()]

    def _measured(self) -> str:
        known = [(q, self.certain[q].error) for q in sentences.headlines(self.rows)]
        parts = [f"{sentences.percent(e)} in {sentences.NAMES[q]}" for q, e in known if e is not None]
        sure = f"itself uncertain by {', '.join(parts)}" if parts else "on the only mesh there is"
        return f"Measured against {self.reference.words} ({self.reference.dofs or 0:,} unknowns), {sure}."


def run(options: argparse.Namespace) -> int:
    """Run a study into a folder; the exit code. On one process: the points start their own.

    Raises:
        InputError: the scene, the plan or the folder cannot be used.
        ReferenceError: no solution exists (3), or the reference is not certified (4).
        Stopped: interrupted (130); finished points are kept.
    """
    scene = read_scene(options.scene, options.overrides)
    plan = make(scene, [axis(text) for text in options.axis])
    folder = Path(os.path.abspath(options.out or Path("results") / f"{options.scene.stem}-study"))
    store = Store(folder, options.np or 1)
    store.open(_existing(options))
    with watched(folder):
        with Progress() as progress:
            _run(plan, Runner(store, options.repeat or REPEAT, options.limit or LIMIT, progress))
        study = evaluate(plan, store)
        plots.draw(study, folder)
        write(study, folder)
        page.write(folder)
    print("\n".join([*_heading(study), *study.sentences, f"{folder}: {MARK}, study.csv, pictures"]))
    return 0


def _existing(options: argparse.Namespace) -> Existing:
    return "replace" if options.force else "resume" if options.resume else "refuse"


def _run(plan: Plan, runner: Runner) -> None:
    """The reference first: without it the rest is in vain."""
    references = [Job(setting, stiffness=i == 0) for i, setting in enumerate(plan.reference)]
    wanted = {runner.store.name(job.setting): job for job in (*references, *map(Job, plan.points))}
    wanted |= {runner.store.name(references[0].setting): references[0]}
    jobs = list(wanted.values())
    runner.run(jobs[:1], of=jobs)
    _check(plan.reference[0], runner.store)
    runner.run(jobs, of=jobs)


def _check(reference: Setting, store: Store) -> None:
    record = store.record(reference) or {}
    if not record.get("converged"):
        raise ReferenceError(
            f"the reference ({meshes.words(reference)}, exact law) has no certified solution: {record.get('reason')}; "
            "see `hvi run`, or choose coarser meshes with --axis mesh=...",
            record.get("exit_code") or ExitCode.NOT_CONVERGED,
        )


def evaluate(plan: Plan, store: Store) -> Study:
    """The errors of all points that are in the store, which must hold the reference."""
    finest = plan.reference[0]
    stiffness = sparse.csr_array(sparse.load_npz(stiffness_path(store, finest)))
    yardstick = Yardstick(solution_fields.load(store.path(finest).with_suffix(".npz")), stiffness)
    below = [e for e in (_errors(yardstick, store, s) for s in plan.reference[1:]) if e is not None]
    certain = certainty(below)
    rows = tuple(_rows(plan, store, yardstick, certain))
    reference = row(store.name(finest), finest, store.record(finest) or {}, None, None, None, certain)
    own, exact = (next(r for r in rows if r.point == store.name(s)) for s in (plan.own, plan.exact))
    return Study(plan.own.scene, rows, own, exact, certain, reference, tuple(below), plan.left_out, store.ranks)


def _moved(yardstick: Yardstick, store: Store, setting: Setting) -> Moved | None:
    """A certified point on the reference's mesh; None for another."""
    if not (store.record(setting) or {}).get("converged"):
        return None
    return yardstick.move(solution_fields.load(store.path(setting).with_suffix(".npz")))


def _errors(yardstick: Yardstick, store: Store, setting: Setting) -> Errors | None:
    moved = _moved(yardstick, store, setting)
    return None if moved is None else yardstick.errors(moved)


def _rows(plan: Plan, store: Store, yardstick: Yardstick, certain: Mapping[str, Certainty]) -> Iterator[Row]:
    partner: tuple[Setting | None, Moved | None] = (None, None)
    for setting in plan.points:
        alone = replace(setting, accuracy=None, scene=plan.exact.scene.changed(domain=setting.scene.domain))
        if partner[0] != alone:
            partner = (alone, _moved(yardstick, store, alone))
        moved = _moved(yardstick, store, setting)
        errors = part = left_out = None
        if moved is not None:
            errors, left_out = yardstick.errors(moved), yardstick.left_out(moved)
            if setting.scene.solver.smoothing and setting.accuracy is None and partner[1] is not None:
                part = yardstick.errors(moved, partner[1])
        yield row(store.name(setting), setting, store.record(setting) or {}, errors, part, left_out, certain)


def write(study: Study, folder: Path) -> None:
    """``study.csv`` and, last, ``study.json``."""
    write_text(folder / "study.csv", table.as_csv(study.rows))
    write_json(folder / MARK, as_data(study))


def as_data(study: Study) -> dict[str, Any]:
    """All of ``study.json`` (docs/study.md)."""
    return {
        "scene": study.scene.title,
        "version": __version__,
        "ranks": study.ranks,
        "sentences": study.sentences,
        "quantities": QUANTITIES,
        "headlines": sentences.headlines(study.rows),
        "own": study.own.point,
        "exact": study.exact.point,
        "share_of_epsilon": {q: sentences.share_of_epsilon(study.own, study.exact, q) for q in QUANTITIES},
        "reference": {
            **asdict(study.reference),
            "certainty": {q: asdict(c) for q, c in study.certain.items()},
            "errors_of_coarser_rungs": list(study.below),
        },
        "fronts": {q: [r.point for r in front(study.rows, q, study.certain)] for q in QUANTITIES},
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


__all__ = ["Study", "as_data", "evaluate", "make", "run", "write"]
