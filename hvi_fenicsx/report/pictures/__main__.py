"""``python3 -m hvi_fenicsx.report.pictures FOLDER``: draw the pictures of a finished folder into it, print their names.

Each picture has a process of its own, as many at a time as there are processors: one that dies takes its picture with
it and no other. Exit code 0, or 1 with a message for each picture that failed; the others are there even so.
"""

from __future__ import annotations

import argparse
import contextlib
import gc
import multiprocessing
import os
import signal
import sys
from collections.abc import Iterator, Sequence
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from ...errors import HviError, NotWrittenError
from ...runtime import processes, writing
from ..errors import PictureError
from .draw import COMPLAINT, TOLD, WHEN_TOLD
from .xserver import x_server

if TYPE_CHECKING:
    from .drawings import Drawing


def main(arguments: Sequence[str] | None = None) -> int:
    """The command; its exit code."""
    parser = argparse.ArgumentParser(
        prog="python3 -m hvi_fenicsx.report.pictures", description="Draw a result's pictures."
    )
    parser.add_argument("folder", type=Path, help="a finished result folder")
    told = "load what draws a body in this dimension, then wait for a line on the standard input"
    parser.add_argument(WHEN_TOLD, type=int, choices=(2, 3), metavar="DIMENSION", help=told)
    options = parser.parse_args(arguments)
    signal.signal(signal.SIGTERM, _terminated)
    processes.die_with_parent()  # or it would write into the folder of the next run
    processes.stand_back()  # the ranks may still be computing
    if options.when_told is not None and not _told(options.when_told):
        return 1
    try:
        failures = draw_all(options.folder)
    except HviError as error:
        failures = [error]
    for failure in failures:
        print(f"{COMPLAINT}{failure}", file=sys.stderr)
    for failure in failures:
        if isinstance(failure, NotWrittenError):
            return writing.hand_over(failure)
    return 1 if failures else 0


def _told(dimension: int) -> bool:
    """Load what draws, and wait; whether there is something to draw."""
    from . import drawings  # noqa: F401 (loads matplotlib)

    if dimension == 3:
        with contextlib.suppress(ModuleNotFoundError):  # each picture will say what it lacks
            from . import space  # noqa: F401
    return sys.stdin.readline() == TOLD


def _terminated(*_: object) -> NoReturn:
    """End in good order, so that the X server goes too."""
    raise SystemExit(128 + signal.SIGTERM)


def draw_all(folder: Path) -> list[HviError]:
    """Draw the pictures of a folder side by side and print the names of those that are there.

    Returns:
        What went wrong with the others.

    Raises:
        ResultError: the folder is damaged.
        PictureError: there is nothing to draw.
    """
    from .drawings import drawings_of  # loads the plotting library

    found, at_once = drawings_of(folder), os.cpu_count() or 1
    with x_server(wanted=any(drawing.rendered for drawing in found)):
        gc.freeze()  # the processes share what is there; a collection in one of them would copy it
        batches = (found[start : start + at_once] for start in range(0, len(found), at_once))
        return [failure for batch in batches for failure in _drawn(batch)]


def _drawn(batch: Sequence[Drawing]) -> Iterator[HviError]:
    """Draw pictures side by side, each in a process of its own; what went wrong with them."""
    context, running = multiprocessing.get_context("fork"), []
    for drawing in batch:
        receiving, sending = context.Pipe(duplex=False)
        process = context.Process(target=_draw, args=(drawing, sending), daemon=True)
        process.start()
        sending.close()
        running.append((drawing, process, receiving))
    for drawing, process, receiving in running:
        try:
            failure = receiving.recv()
        except EOFError:
            process.join()
            code = process.exitcode or 0
            reason = signal.Signals(-code).name if code < 0 else f"exit code {code}"
            failure = _failed(drawing, f"the drawing process ended with {reason}{_ADVICE * drawing.rendered}")
        process.join()
        if failure is None:
            print(drawing.path.name, flush=True)
        else:
            yield failure


def _draw(drawing: Drawing, connection: Connection) -> None:
    """Draw one picture in a process of its own; say what went wrong, if anything did."""
    from .style import save

    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    failure: HviError | None = None
    try:
        save(drawing.make(), drawing.path, drawing.caption)
    except NotWrittenError as error:
        failure = error
    except ModuleNotFoundError as error:
        failure = _failed(drawing, f"needs the package {error.name}, which is not installed here")
    except Exception as error:  # whatever it is, it is reported in one line
        failure = _failed(drawing, str(error) if isinstance(error, HviError) else f"{type(error).__name__}: {error}")
    connection.send(failure)


def _failed(drawing: Drawing, why: str) -> PictureError:
    return PictureError(f"{drawing.path.name}: {why}")


_ADVICE = "; VTK draws on a display: unset DISPLAY and install Xvfb, or use a VTK from 9.4 on"

if __name__ == "__main__":
    raise SystemExit(main())
