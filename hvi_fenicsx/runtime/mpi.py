"""Collective helpers: all ranks agree on values and on errors before any of them goes on."""

from __future__ import annotations

import math
import sys
import time
import traceback
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt
from mpi4py import MPI

from ..errors import HviError, InputError
from . import log, processes

T = TypeVar("T")
_TOGETHER = 2.0
"""Seconds within which ranks raise the same error."""


def agree(comm: MPI.Comm, value: T) -> list[T]:
    """Every rank's value, on every rank, in the order of the ranks. Collective.

    Args:
        comm: the ranks.
        value: this rank's.
    """
    return comm.allgather(value)


def refuse(comm: MPI.Comm, reasons: Iterable[str]) -> None:
    """Refuse the input for the first reason that any rank has. Collective.

    Args:
        comm: the ranks.
        reasons: this rank's.

    Raises:
        InputError: on all ranks alike.
    """
    for reason in (reason for rank in agree(comm, list(reasons)) for reason in rank):
        raise InputError(reason)


def on_root(comm: MPI.Comm, action: Callable[[], T], *, asleep: bool = False) -> T:
    """Run an action on rank 0 only; all ranks get its result, or raise its error. Collective.

    Args:
        comm: the ranks.
        action: what to do; only errors of the program and of the file system may come from it.
        asleep: whether the other ranks sleep meanwhile, since other processes may need their processors.

    Raises:
        HviError: what the action raised; of a file that cannot be read or written, which one and why.
    """
    tried = _tried(action) if comm.rank == 0 else None
    if asleep:
        asleep_until_all(comm)
    error, result = comm.bcast(tried, root=0)
    if error is not None:
        raise error
    return result


def _tried(action: Callable[[], Any]) -> tuple[HviError | None, Any]:
    """The error of an action, or its result; one of the file system in words."""
    try:
        return None, action()
    except HviError as caught:
        return caught, None
    except OSError as caught:
        words = f"{caught.filename or 'a file could not be written'}: {caught.strerror or caught}"
        return InputError(words), None


def on_root_asking(comm: MPI.Comm, action: Callable[[Callable[[], bool]], T], question: Callable[[], bool]) -> T:
    """Run a long action on rank 0 only, which may ask a question that all ranks must ask together. Collective.

    Args:
        comm: the ranks; all get the result.
        action: what to do with a function that asks; it raises no error that the program goes on from.
        question: is asked on all ranks when the action asks; rank 0's answer counts.
    """

    def ask() -> bool:
        comm.bcast(True, root=0)
        return question()

    if comm.rank != 0:
        while comm.bcast(None, root=0):
            question()
        return comm.bcast(None, root=0)
    try:
        result = action(ask)
    finally:
        comm.bcast(False, root=0)
    return comm.bcast(result, root=0)


@contextmanager
def ended_together(comm: MPI.Comm) -> Iterator[None]:
    """End all ranks when one of them has an error that the others do not have: they would wait for it for ever.

    Collective.
    """
    twin = comm.Dup()  # apart from what the others may wait in
    try:
        yield
    except KeyboardInterrupt:
        raise
    except ImportError:
        if processes.stop_asked():  # a library's own import makes this of a KeyboardInterrupt within it
            raise KeyboardInterrupt from None
        raise
    except HviError as error:
        if error.everywhere or asleep_until_all(twin, _TOGETHER):
            raise
        log.complain(f"hvi: {error}")
        comm.Abort(error.exit_code)
    except Exception:
        if comm.size > 1:
            traceback.print_exc()
            sys.stderr.flush()
            comm.Abort(1)
        raise


def asleep_until_all(comm: MPI.Comm, seconds: float = math.inf) -> bool:
    """Wait until all ranks come here, without the processor, which other processes may need. Collective.

    Args:
        comm: the ranks.
        seconds: how long to wait at most.

    Returns:
        Whether all have come.
    """
    request, end = comm.Ibarrier(), time.monotonic() + seconds
    while not (done := request.Test()) and time.monotonic() < end:
        time.sleep(0.01)
    return bool(done)


def time_over(comm: MPI.Comm, limit: float | None) -> Callable[[], bool]:
    """Whether a time from now on is over, by the clock of rank 0; to be asked by all ranks. Collective when asked.

    Args:
        comm: the ranks.
        limit: seconds; None: it is never over.
    """
    start = time.monotonic()
    return lambda: bool(comm.bcast(limit is not None and time.monotonic() - start > limit, root=0))


def joined(comm: MPI.Comm, values: npt.NDArray[Any]) -> Any:
    """What all ranks have, one after the other, on rank 0; elsewhere their own. Collective.

    Args:
        comm: the ranks.
        values: of this rank, with the same shape on all but for the first axis.
    """
    pieces = comm.gather(np.ascontiguousarray(values), root=0)
    return values if pieces is None else np.concatenate(pieces)


def total(comm: MPI.Comm, value: float) -> float:
    """Sum over the ranks. Collective.

    Args:
        comm: the ranks.
        value: this rank's.
    """
    return float(comm.allreduce(value, op=MPI.SUM))


def largest(comm: MPI.Comm, value: float) -> float:
    """Maximum over the ranks. Collective.

    Args:
        comm: the ranks.
        value: this rank's.
    """
    return float(comm.allreduce(value, op=MPI.MAX))


def stop_on_signals(comm: MPI.Comm) -> Callable[[], bool]:
    """Have the first signal from now on be a request to stop: solvers end, the result is written; a second one ends.

    Args:
        comm: the ranks that stop together.

    Returns:
        Whether any rank was signalled. Collective.
    """
    processes.catch(processes.SIGNALS, raise_second)
    return lambda: bool(comm.allreduce(processes.stop_asked(), op=MPI.LOR))


def raise_second(number: int, frame: FrameType | None) -> None:
    """A handler of signals: only one that is not the first interrupts.

    Args:
        number: of the signal.
        frame: where it came.
    """
    if processes.stop_asked() > 1:
        raise KeyboardInterrupt
