"""What people are shown: lines on the terminal, shares as percentages, the tables of notebooks.

Errors of writing cost no result, and no text commands the terminal.
"""

from __future__ import annotations

import contextlib
import os
import sys
from typing import TextIO

_STANDARD = 2
"""The last of the descriptors of standard input, output and error."""


def prepare() -> None:
    """Open what the caller has closed of the standard streams; write characters that a stream lacks as escapes.

    Otherwise the next file that is opened would get the descriptor of a closed one, and what libraries print.
    """
    while (descriptor := os.open(os.devnull, os.O_RDWR)) <= _STANDARD:
        pass
    os.close(descriptor)
    sys.stdout = sys.stdout or _nowhere()
    sys.stderr = sys.stderr or _nowhere()
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")


def _nowhere() -> TextIO:
    return open(os.devnull, "w", encoding="utf-8")


def say(text: str) -> None:
    """Write lines to standard output."""
    _write(sys.stdout, text)


def complain(text: str) -> None:
    """Write lines to standard error."""
    _write(sys.stderr, text)


def finish() -> None:
    """Write what is still in the buffers, such as a library's lines."""
    for stream in (sys.stdout, sys.stderr):
        _write(stream, "", end="")


def printable(text: str) -> str:
    r"""Text with every character that is not printable as ``\uXXXX``, new lines excepted."""
    return "".join(c if c.isprintable() or c == "\n" else f"\\u{ord(c):04x}" for c in text)


def _write(stream: TextIO, text: str, end: str = "\n") -> None:
    try:
        print(printable(text), end=end, file=stream, flush=True)
    except (OSError, ValueError):  # a broken pipe, a closed terminal, a full disk; a closed stream
        _silence(stream)


def _silence(stream: TextIO) -> None:
    """Send all that is still written to a stream nowhere; its buffer would raise the same error again at the end."""
    with contextlib.suppress(OSError, ValueError):
        descriptor = os.open(os.devnull, os.O_WRONLY)
        os.dup2(descriptor, stream.fileno())
        os.close(descriptor)


def percent(share: float) -> str:
    """Two digits and no power of ten, or all digits before the point.

    Args:
        share: of one; from about 1e-6 on.
    """
    return f"{100.0 * share:.0f} %" if share >= 0.1 else f"{100.0 * share:.2g} %"
