"""``python3 -m hvi_fenicsx.report.pictures.drawings FOLDER``: draw a finished folder's pictures, print their names.

A new picture of a body has two lines in :func:`_of_body`. Each picture has a process of its own, as many at a time as
there are processors: one that dies takes its picture with it and no other. Exit code 0, or 1 with a message for each
picture that failed; the others are there even so.
"""

from __future__ import annotations

import argparse
import contextlib
import gc
import multiprocessing
import os
import random
import select
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from matplotlib.figure import Figure

from ...errors import HviError, NotWrittenError
from ...runtime import processes, writing
from .. import reader
from ..page import COMPLAINT, PictureError
from ..reader import Result
from . import bodies, charts, contact
from .style import save

READY_WITHIN = 15
"""Seconds until a display is there."""
DISPLAYS = range(1000, 50000)
"""Far from those that people use."""
_ADVICE = "; VTK draws on a display: unset DISPLAY and install Xvfb, or use a VTK from 9.4 on"


@dataclass(frozen=True)
class Drawing:
    """A picture of one result.

    Attributes:
        path: where it goes.
        caption: what a reader sees under it.
        make: draws it.
        rendered: whether VTK may draw for it.
    """

    path: Path
    caption: str
    make: Callable[[], Figure]
    rendered: bool = False


def drawings_of(folder: Path) -> list[Drawing]:
    """What there is to draw of a finished folder, of whatever kind it is.

    Raises:
        ResultError: the folder is damaged.
        PictureError: there is nothing to draw.
    """
    if (folder / "equilibria.csv").exists():
        search = reader.read_equilibria(folder)
        return [Drawing(folder / "equilibria.png", charts.EQUILIBRIA_CAPTION, partial(charts.equilibria_chart, search))]
    if (folder / "path.csv").exists():
        path = reader.read_path(folder)
        drawn = path.driven is not None
        return [Drawing(folder / "path.png", charts.PATH_CAPTION, partial(charts.path_chart, path))] * drawn
    result = reader.read(folder)
    arrays = result.arrays
    if arrays.displacement is None and arrays.escape_mode is None and not arrays.parts:
        raise PictureError(f"{folder}: there is nothing to draw, neither a displacement nor a part of Γc")
    _ = result.body.boundary  # which pictures need: once, for all processes that draw
    return list(drawings(result))


def drawings(result: Result) -> Iterator[Drawing]:
    """What there is to draw of a result."""
    for name, caption, make in _of_body(result):
        yield Drawing(result.folder / f"{name}.png", caption, partial(make, result), result.body.dimension == 3)
    for part in result.parts:
        name, words = f"contact_{part.name}", f"“{part.name}”"
        if len(result.parts) == 1:
            name, words = "contact", "the contact part"
        caption = f"Along {words}: displacement, friction and pressure."
        yield Drawing(result.folder / f"{name}.png", caption, partial(contact.contact, result, part))


def _of_body(result: Result) -> Iterator[tuple[str, str, Callable[[Result], Figure]]]:
    """The pictures of a body, the slowest first: name of the file, caption, and what draws it."""
    if result.body.displacement is not None:
        yield "body", "The deformed body, its displacements magnified, with what acts on it.", bodies.body
    if result.body.escape_mode is not None:
        yield "escape", "The rigid motion along which the load carries the body away.", bodies.escape
    if result.body.von_mises is not None:
        end = "the scale may end below a peak in a corner"
        yield "stress", f"Stress in the body (von Mises), constant in each cell; {end}.", bodies.stress
    if result.arrays.sides:
        yield "scene", "The scene: the undeformed body with its supports, loads and contact parts.", bodies.scene


def main(arguments: Sequence[str] | None = None) -> int:
    """The command; its exit code."""
    parser = argparse.ArgumentParser(description="Draw a result's pictures.")
    parser.add_argument("folder", type=Path, help="a finished result folder")
    parser.add_argument("--when-told", action="store_true", help="wait for a line on the standard input")
    options = parser.parse_args(arguments)
    processes.die_with_parent()  # or it would write into the folder of the next run
    processes.stand_back()  # the ranks may still be computing
    if options.when_told and not sys.stdin.readline():
        return 1
    try:
        found, at_once = drawings_of(options.folder), os.cpu_count() or 1
    except HviError as error:
        return _complain(str(error))
    with x_server(wanted=any(drawing.rendered for drawing in found)):
        gc.freeze()  # the processes share what is there; a collection in one of them would copy it
        batches = (found[start : start + at_once] for start in range(0, len(found), at_once))
        return max([code for batch in batches for code in _drawn(batch)], default=0)


def _drawn(batch: Sequence[Drawing]) -> Iterator[int]:
    """Draw pictures side by side, each in a process of its own; the exit codes."""
    context = multiprocessing.get_context("fork")
    running = [context.Process(target=_draw, args=(drawing,), daemon=True) for drawing in batch]
    for process in running:
        process.start()
    for drawing, process in zip(batch, running, strict=True):
        process.join()
        code = process.exitcode or 0
        if code < 0:
            reason = f"the drawing process ended with {signal.Signals(-code).name}{_ADVICE * drawing.rendered}"
            code = _complain(f"{drawing.path.name}: {reason}")
        yield code


def _draw(drawing: Drawing) -> None:
    """Draw one picture in a process of its own; tell its name, or what went wrong."""
    try:
        save(drawing.make(), drawing.path, drawing.caption)
    except NotWrittenError as error:
        sys.exit(writing.hand_over(error))
    except Exception as error:  # whatever it is, it is reported in one line
        words = str(error) if isinstance(error, HviError) else f"{type(error).__name__}: {error}"
        sys.exit(_complain(f"{drawing.path.name}: {words}"))
    sys.stdout.write(f"{drawing.path.name}\n")  # in one piece: several processes draw
    sys.stdout.flush()


def _complain(words: str) -> int:
    """Tell the caller what went wrong; the exit code."""
    sys.stderr.write(f"{COMPLAINT}{words}\n")
    return 1


@contextlib.contextmanager
def x_server(*, wanted: bool) -> Iterator[None]:
    """Have a display while VTK draws: Xvfb, which ends with this process whatever ends that; it says when it is ready.

    A server that fails is left out: VTK may do without, as it does from 9.4 on. The display's number is random: a
    server that ends removes the socket of its number, and of the first free one that may be another's by then.

    Args:
        wanted: whether VTK draws.
    """
    if not wanted or os.environ.get("DISPLAY") or shutil.which("Xvfb") is None:
        yield
        return
    ready, told = os.pipe()
    display = f":{random.SystemRandom().choice(DISPLAYS)}"
    server = subprocess.Popen(
        # pictures are drawn beside the screen, whatever its size
        ["Xvfb", display, "-displayfd", str(told), "-screen", "0", "640x480x24", "-nolisten", "tcp", "-noreset"],
        pass_fds=[told],
        preexec_fn=processes.die_with_parent,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    os.close(told)
    try:
        if select.select([ready], [], [], READY_WITHIN)[0] and (number := os.read(ready, 16).decode().strip()):
            os.environ["DISPLAY"] = f":{number}"
        yield
    finally:
        os.environ.pop("DISPLAY", None)
        os.close(ready)
        server.terminate()
        server.wait()


if __name__ == "__main__":
    raise SystemExit(main())
