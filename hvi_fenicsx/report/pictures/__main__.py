"""``python3 -m hvi_fenicsx.report.pictures FOLDER``: draw a result folder's pictures into it and print their names.

There are as many processes as processors, each with its share of the pictures. One that ends takes the picture with it
that it was drawing; another one draws the rest of its share. Exit code 0, or 1 with a message for each picture that
failed; the others are there even so.
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
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from ...errors import HviError, NotWrittenError
from ...runtime import processes, writing
from ..errors import PictureError
from ..reader import Result, read
from .draw import COMPLAINT, TOLD, WHEN_TOLD
from .xserver import XServer

if TYPE_CHECKING:
    from .drawings import Drawing


@dataclass(frozen=True)
class Running:
    """A process that draws one picture after the other, and says of each that it is done, or why it failed.

    Attributes:
        drawings: what is drawn, in this order.
        process: that draws them.
        connection: on which it answers.
    """

    drawings: Sequence[Drawing]
    process: BaseProcess
    connection: Connection


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
        failures = draw_all(read(options.folder))
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
        import scipy.ndimage
        import scipy.sparse.csgraph  # noqa: F401

        with contextlib.suppress(ModuleNotFoundError):  # each picture will say what it lacks
            import pyvista  # noqa: F401
    return sys.stdin.readline() == TOLD


def _terminated(*_: object) -> NoReturn:
    """End in good order, so that the X server goes too."""
    raise SystemExit(128 + signal.SIGTERM)


def draw_all(result: Result) -> list[HviError]:
    """Draw the pictures of a result side by side and print the names of those that are there.

    Returns:
        What went wrong with the others.

    Raises:
        PictureError: there is nothing to draw.
    """
    arrays = result.arrays
    if arrays.displacement is None and arrays.escape_mode is None and not arrays.parts:
        raise PictureError(f"{result.folder}: there is nothing to draw, neither a displacement nor a part of Γc")
    with XServer(wanted=result.body.dimension == 3) as server:
        from .drawings import drawings  # loads the plotting library while the server starts

        found = list(drawings(result))
        _ = result.body.pieces  # which pictures need, as they do the boundary: once, for all processes that draw
        server.wait()
        gc.freeze()  # the processes share what is there; a collection in one of them would copy it
        shares = min(len(found), os.cpu_count() or 1)
        running = [_started(found[i::shares]) for i in range(shares)]
        return [failure for one in running for failure in _ended(one)]


def _started(drawings: Sequence[Drawing]) -> Running:
    context = multiprocessing.get_context("fork")
    receiving, sending = context.Pipe(duplex=False)
    process = context.Process(target=_drawn, args=(drawings, sending), daemon=True)
    process.start()
    sending.close()
    return Running(drawings, process, receiving)


def _drawn(drawings: Sequence[Drawing], connection: Connection) -> None:
    """In a process of its own."""
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    for drawing in drawings:
        connection.send(_fault(drawing))


def _fault(drawing: Drawing) -> HviError | None:
    """Draw one picture; what went wrong, if anything did."""
    from .style import save

    try:
        save(drawing.make(), drawing.path, drawing.caption)
    except NotWrittenError as error:
        return error
    except ModuleNotFoundError as error:
        return _failed(drawing, f"needs the package {error.name}, which is not installed here")
    except Exception as error:  # whatever it is, it is reported in one line
        return _failed(drawing, str(error) if isinstance(error, HviError) else f"{type(error).__name__}: {error}")
    return None


def _failed(drawing: Drawing, why: str) -> PictureError:
    return PictureError(f"{drawing.path.name}: {why}")


def _ended(one: Running) -> Iterator[HviError]:
    """Wait for the pictures of a process; what went wrong with them."""
    for place, drawing in enumerate(one.drawings):
        try:
            failure = one.connection.recv()
        except EOFError:
            one.process.join()
            advice = _ADVICE if drawing.rendered else ""
            yield _failed(drawing, f"the drawing process ended with {_reason(one.process.exitcode)}{advice}")
            if rest := one.drawings[place + 1 :]:
                yield from _ended(_started(rest))
            return
        if failure is None:
            print(drawing.path.name, flush=True)
        else:
            yield failure
    one.process.join()


def _reason(code: int | None) -> str:
    return signal.Signals(-code).name if code is not None and code < 0 else f"exit code {code}"


_ADVICE = "; VTK draws on a display: unset DISPLAY and install Xvfb, or use a VTK from 9.4 on"

if __name__ == "__main__":
    raise SystemExit(main())
