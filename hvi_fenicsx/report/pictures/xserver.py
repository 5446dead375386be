"""An X server for a VTK that draws through one: Xvfb, which ends with this process whatever ends that.

VTK before 9.4 aborts where it finds no display. Xvfb says by itself when it is ready (``-displayfd``): nothing sleeps.
The number of its display is random. Xvfb itself would take the first free one; but a server that ends removes the
socket of its number, and that may by then be the socket of another, just started. ``xvfb-run`` takes as long, but when
it is killed its server runs on and its folder in ``/tmp`` stays.
"""

from __future__ import annotations

import contextlib
import os
import random
import select
import shutil
import subprocess
import sys
from collections.abc import Iterator

from ...runtime import processes

READY_WITHIN = 15
"""Seconds."""
DISPLAYS = range(1000, 50000)
"""Far from those that people use."""
DRAWS_WITHOUT = (9, 4)
"""The VTK that renders through EGL or in memory by itself."""


@contextlib.contextmanager
def x_server(*, wanted: bool) -> Iterator[None]:
    """Have a display while VTK draws, if it needs one; a server that fails is left out: VTK may do without.

    Args:
        wanted: whether VTK draws.
    """
    if not (wanted and _needed()):
        yield
        return
    ready, told = os.pipe()
    display = f":{random.SystemRandom().choice(DISPLAYS)}"
    size = ["-screen", "0", "640x480x24"]  # pictures are drawn beside the screen, whatever its size
    server = subprocess.Popen(
        ["Xvfb", display, "-displayfd", str(told), *size, "-nolisten", "tcp", "-noreset"],
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


def _needed() -> bool:
    if os.environ.get("DISPLAY") or not sys.platform.startswith("linux") or shutil.which("Xvfb") is None:
        return False
    try:
        from vtkmodules.vtkCommonCore import vtkVersion
    except ImportError:
        return True
    return (vtkVersion.GetVTKMajorVersion(), vtkVersion.GetVTKMinorVersion()) < DRAWS_WITHOUT
