"""``hvi study``: what accuracy costs in time."""

from __future__ import annotations

import argparse

from .. import console
from ..errors import ExitCode
from ..runtime.manifest import MARKS
from ..runtime.mpi import stop_on_signals
from ..study import plan
from ..study.conduct import Measurement
from .session import COMM, display, say, scene_of, target_of


def execute(options: argparse.Namespace) -> int:
    """Run a study into a folder; the exit code by the contract. Collective.

    Raises:
        InputError: the scene, the plan or the folder cannot be used; on all ranks alike, as all errors.
        NoReferenceError: no solution exists (3), or the reference is not certified (4).
        StudyInterruptedError: a signal came (130); finished points are kept.
    """
    planned = plan.make(scene_of(options), [plan.read_axis(text) for text in options.axis])
    interrupted = stop_on_signals(COMM)
    folder = target_of(options)
    measurement = Measurement(
        plan=planned, comm=COMM, repeats=options.repeat, limit=options.limit, interrupted=interrupted
    )
    with display():
        study, warnings = measurement.conduct(
            folder, force=options.force, resume=options.resume, inputs=[options.scene]
        )
        certified = sum(row.converged for row in study.rows)
        ranks = "1 rank" if COMM.size == 1 else f"{COMM.size} ranks"
        say([f"{study.title or 'untitled'}: {len(study.rows)} points, {certified} certified, on {ranks}"])
        if study.left_out:
            say([f"{len(study.left_out)} combinations are no scenes, like {study.left_out[0]}"])
        say([*study.sentences, *console.warnings(warnings), f"{folder}: {MARKS['study']}, study.csv, pictures"])
    return ExitCode.CERTIFIED
