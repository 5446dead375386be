"""``python3 -m hvi_fenicsx.report.pictures FOLDER``: draw a result folder's pictures into it and print their names.

Each picture is drawn in a process of its own, side by side, so that one that fails takes no other with it.
Exit code 0, or 1 with a message for each picture that failed; the others are there even so.
"""

from __future__ import annotations

import argparse
import importlib
import multiprocessing
import signal
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any, NoReturn

from ...errors import HviError
from ..reader import Result, read
from ..vtu import Body, read_body
from .draw import COMPLAINT, PictureError
from .xserver import XServer


@dataclass(frozen=True)
class Job:
    """A picture: its path, the module whose ``draw`` draws it, from what, and whether VTK must draw for it."""

    path: Path
    module: str
    sources: tuple[Any, ...]
    rendered: bool = False

    def run(self) -> None:
        """Draw it, here and now."""
        importlib.import_module(f"{__package__}.{self.module}").draw(self.path, *self.sources)


@dataclass(frozen=True)
class Running:
    """A job in its process, which says on the connection that it is done, or why it failed."""

    job: Job
    process: BaseProcess
    connection: Connection


def main(arguments: Sequence[str] | None = None) -> int:
    """The command; its exit code."""
    parser = argparse.ArgumentParser(
        prog="python3 -m hvi_fenicsx.report.pictures", description="Draw a result's pictures."
    )
    parser.add_argument("folder", type=Path, help="a finished result folder")
    folder = parser.parse_args(arguments).folder
    signal.signal(signal.SIGTERM, _terminated)
    try:
        failures = draw_all(list(jobs(folder)))
    except HviError as error:
        failures = [str(error)]
    for failure in failures:
        print(f"{COMPLAINT}{failure}", file=sys.stderr)
    return 1 if failures else 0


def _terminated(*_: object) -> NoReturn:
    """End in good order, so that the X server goes too."""
    raise SystemExit(128 + signal.SIGTERM)


def jobs(folder: Path) -> Iterator[Job]:
    """What a folder has to draw.

    Raises:
        PictureError: nothing, or its files are damaged.
    """
    result = read(folder)
    fields = folder / "displacement.pvd"
    body = read_body(fields) if fields.exists() else None
    if body is None and not result.parts:
        raise PictureError(f"{folder}: there is nothing to draw, neither displacement.pvd nor contact.csv")
    if body is not None:
        yield _of_body(result, body)
    if body is not None and "von_mises" in body.by_cell:
        solid = body.dimension == 3
        yield Job(folder / "stress.png", "stress_space" if solid else "stress_plane", (result, body), solid)
    if body is not None and result.sides:
        solid = body.dimension == 3
        yield Job(folder / "scene.png", "scene_space" if solid else "scene_plane", (result, body), solid)
    for part in result.parts:
        path = folder / ("contact.png" if len(result.parts) == 1 else f"contact_{part.name}.png")
        if not part.spatial:
            yield Job(path, "contact_curves", (result, part))
        elif body is not None:
            yield Job(path, "contact_maps", (result, part, body))


def _of_body(result: Result, body: Body) -> Job:
    solid = body.dimension == 3
    if "escape_mode" in body.fields:
        return Job(result.folder / "escape.png", "escape_space" if solid else "escape_plane", (result, body), solid)
    if "displacement" not in body.fields:
        raise PictureError(f"{result.folder / 'displacement.pvd'}: has neither displacement nor escape_mode")
    return Job(result.folder / "body.png", "body_space" if solid else "body_plane", (result, body), solid)


def draw_all(found: Sequence[Job]) -> list[str]:
    """Draw pictures side by side and print the names of those that are there; returns what went wrong with others."""
    context = multiprocessing.get_context("fork")
    with XServer(any(job.rendered for job in found)) as server:
        from . import style  # noqa: F401 (what all pictures load, once and while the server starts)

        server.wait()
        running = [_started(job, context) for job in found]
        failures = [_ended(one) for one in running]
    return [failure for failure in failures if failure]


def _started(job: Job, context: multiprocessing.context.ForkContext) -> Running:
    receiving, sending = context.Pipe(duplex=False)
    process = context.Process(target=_drawn, args=(job, sending), daemon=True)
    process.start()
    sending.close()
    return Running(job, process, receiving)


def _drawn(job: Job, connection: Connection) -> None:
    """In the job's own process."""
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    try:
        job.run()
        connection.send("")
    except ModuleNotFoundError as error:
        connection.send(f"needs the package {error.name}, which is not installed here")
    except Exception as error:  # whatever it is, it is told in one line
        connection.send(str(error) if isinstance(error, HviError) else f"{type(error).__name__}: {error}")


def _ended(one: Running) -> str:
    """Wait for a job; what went wrong with it, or nothing."""
    try:
        failure = str(one.connection.recv())
    except EOFError:
        failure = "aborted"
    one.process.join()
    if failure == "aborted":
        failure = f"the drawing process ended with {_reason(one.process.exitcode)}{_advice(one.job)}"
    if not failure:
        print(one.job.path.name, flush=True)
    return f"{one.job.path.name}: {failure}" if failure else ""


def _reason(code: int | None) -> str:
    return signal.Signals(-code).name if code is not None and code < 0 else f"exit code {code}"


def _advice(job: Job) -> str:
    return "; VTK draws on a display: unset DISPLAY and install Xvfb, or use a VTK from 9.4 on" if job.rendered else ""


if __name__ == "__main__":
    raise SystemExit(main())
