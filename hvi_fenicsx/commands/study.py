"""``hvi study``: what accuracy costs in time."""

from __future__ import annotations

import argparse
from pathlib import Path

from .. import results
from ..errors import ExitCode
from ..model import read_scene
from ..runtime.manifest import MARKS
from ..runtime.mpi import on_root, stop_on_signals
from ..study import plan
from ..study.conduct import Measurement
from .session import COMM, display, say


def execute(options: argparse.Namespace) -> int:
    """Run a study into a folder; the exit code by the contract. Collective.

    Raises:
        InputError: the scene, the plan or the folder cannot be used; on all ranks alike, as all errors.
        NoReferenceError: no solution exists (3), or the reference is not certified (4).
        StudyInterruptedError: a signal came (130); finished points are kept.
    """
    scene = on_root(COMM, lambda: read_scene(options.scene, options.overrides))
    planned = plan.make(scene, [plan.read_axis(text) for text in options.axis])
    interrupted = stop_on_signals(COMM)
    default = Path("results") / f"{options.scene.stem}-study"
    folder = on_root(COMM, lambda: results.resolved(options.out or default))
    measurement = Measurement(
        plan=planned, comm=COMM, repeats=options.repeat, limit=options.limit, interrupted=interrupted
    )
    with display():
        study, warnings = measurement.conduct(
            folder, force=options.force, resume=options.resume, inputs=[options.scene]
        )
        told = [f"warning: {text}" for text in warnings]
        certified = sum(row.converged for row in study.rows)
        ranks = "1 rank" if COMM.size == 1 else f"{COMM.size} ranks"
        say([f"{study.title or 'untitled'}: {len(study.rows)} points, {certified} certified, on {ranks}"])
        if study.left_out:
            say([f"{len(study.left_out)} combinations are no scenes, like {study.left_out[0]}"])
        say([*study.sentences, *told, f"{folder}: {MARKS['study']}, study.csv, pictures"])
    return ExitCode.CERTIFIED
