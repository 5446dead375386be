"""An X server for a VTK that draws through one: Xvfb, started while other things load, and always ended.

VTK before 9.4 aborts where it finds no display. Xvfb says by itself when it is ready (``-displayfd``): nothing sleeps.
The number of its display is random. Xvfb itself would take the first free one; but a server that ends removes the
socket of its number, and that may by then be the socket of another, just started. ``xvfb-run`` takes as long, but when
it is killed its server runs on and its folder in ``/tmp`` stays.
"""

from __future__ import annotations

import os
import random
import select
import shutil
import socket
import subprocess
import sys

READY_WITHIN = 15.0
"""Seconds."""
DISPLAYS = range(1000, 50000)
"""Far from those that people use."""
DRAWS_WITHOUT = (9, 4)
"""The VTK that renders through EGL or in memory by itself."""
_HELLO = b"l\0\x0b\0" + bytes(8)
"""X11, little-endian, version 11, no authorisation."""


class XServer:
    """A server being started, if one is wanted and needed; a context manager, at whose end it is gone.

    It also goes when this process is killed: it runs with ``-terminate``, and only a connection of ours keeps it.
    """

    def __init__(self, wanted: bool = True) -> None:
        self._ready = -1
        self._connection: socket.socket | None = None
        self._process = self._start() if wanted and _needed() else None

    def _start(self) -> subprocess.Popen[bytes]:
        self._ready, writing = os.pipe()
        display = f":{random.SystemRandom().choice(DISPLAYS)}"
        size = ["-screen", "0", "640x480x24"]  # pictures are drawn beside the screen, whatever its size
        process = subprocess.Popen(
            ["Xvfb", display, "-displayfd", str(writing), *size, "-nolisten", "tcp", "-terminate"],
            pass_fds=[writing],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(writing)
        return process

    def wait(self) -> None:
        """Wait until it is ready; sets ``DISPLAY``. A server that fails is left out: VTK may do without."""
        if self._ready >= 0:
            number = _line(self._ready)
            os.close(self._ready)
            self._ready = -1
            if number:
                os.environ["DISPLAY"] = f":{number}"
                self._connection = _connected(number)

    def __enter__(self) -> XServer:
        return self

    def __exit__(self, *_: object) -> None:
        if self._process is None:
            return
        os.environ.pop("DISPLAY", None)
        if self._connection is not None:
            self._connection.close()
        self._process.terminate()
        try:
            self._process.wait(timeout=5.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


def _connected(number: str) -> socket.socket | None:
    """A client that does nothing. Without one, the server would end when VTK has looked at it for the first time."""
    client = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    client.settimeout(READY_WITHIN)
    try:
        client.connect(f"/tmp/.X11-unix/X{number}")
        client.sendall(_HELLO)
        client.recv(8)
    except OSError:
        client.close()
        return None
    return client


def _line(pipe: int) -> str:
    """What the server says, to the end of its line: it gives up if the pipe is closed before."""
    line = b""
    while not line.endswith(b"\n") and select.select([pipe], [], [], READY_WITHIN)[0]:
        piece = os.read(pipe, 16)
        if not piece:
            return ""
        line += piece
    return line.decode().strip()


def _needed() -> bool:
    if os.environ.get("DISPLAY") or not sys.platform.startswith("linux") or shutil.which("Xvfb") is None:
        return False
    try:
        from vtkmodules.vtkCommonCore import vtkVersion
    except ImportError:
        return True
    return (vtkVersion.GetVTKMajorVersion(), vtkVersion.GetVTKMinorVersion()) < DRAWS_WITHOUT
