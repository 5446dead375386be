"""What commands that run on several ranks share: the ranks, and how they tell what they do."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable
from typing import TypeVar

from mpi4py import MPI

from ..runtime import log
from ..runtime.mpi import on_root

COMM = MPI.COMM_WORLD
LOG = log.logger("commands")
H = TypeVar("H", bound=logging.Handler)


def on_first_rank(make: Callable[[], H]) -> list[H]:
    """The handler that rank 0 makes, none on the others. Collective."""
    made: list[H] = []
    on_root(COMM, lambda: made.append(make()))
    return made


def finish(run_logs: Iterable[log.RunLog]) -> None:
    """Close logs; an error of writing is raised. Rank 0 only."""
    for run_log in run_logs:
        run_log.finish()


def say(lines: Iterable[str]) -> None:
    """Tell lines: on the terminal and in the log."""
    for line in lines:
        LOG.info(line)
