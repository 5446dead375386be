"""A module of this package run in a process of its own, which ends with ours, at a signal to us, or after its time.

One that reads files which may hold programs confines itself: from then on it starts none, writes no file, reaches no
network. The kernel enforces that (Landlock, Linux 5.13 and later, where it is switched on); without it only the limits
hold.
"""

from __future__ import annotations

import ctypes
import os
import resource
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence

from ..errors import Interrupted
from . import processes

_CREATE_RULESET, _RESTRICT_SELF = 444, 446
"""System calls, the same on all architectures."""
_VERSION = 1
"""landlock_create_ruleset(2): a flag to ask for the version."""
_NO_NEW_PRIVILEGES = 38
"""prctl(2)."""
_READ = 0b1100
"""Reading files and folders, among the kinds of access to files."""
_KINDS = {1: 13, 2: 14, 3: 15, 5: 16}
"""How many kinds of access to files there are, from which version on."""
_NETWORK, _SCOPES = 0b11, 0b11
"""Bind and connect over TCP; abstract sockets and signals."""
_NETWORK_FROM, _SCOPES_FROM = 4, 6


def run(module: str, words: Sequence[str], seconds: float) -> subprocess.CompletedProcess[bytes]:
    """The process at its end, with what it has printed. Its current folder is empty, and removed in the end.

    Args:
        module: its full name; it calls :func:`.processes.die_with_parent`.
        words: its arguments.
        seconds: how long it may take.

    Raises:
        TimeoutExpired: it took longer.
        Interrupted: a signal came.
    """
    command, end = [*processes.PYTHON, "-m", module, *words], time.monotonic() + seconds
    with tempfile.TemporaryDirectory() as folder:
        child = subprocess.Popen(
            command,
            cwd=folder,
            env=processes.environment(),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )
        with child:
            try:
                return _completed(child, end)
            finally:
                child.kill()


def _completed(child: subprocess.Popen[bytes], end: float) -> subprocess.CompletedProcess[bytes]:
    """The child at its end; until then it is seen whether a signal came."""
    while not processes.stop_asked():
        try:
            out, err = child.communicate(timeout=0.1)
            return subprocess.CompletedProcess(child.args, child.returncode, out, err)
        except subprocess.TimeoutExpired:
            if time.monotonic() > end:
                raise
    raise Interrupted


def confine(memory: float) -> bool:
    """Forbid this process, and all that it starts, what reading needs not. There is no way back.

    Args:
        memory: what it may use, MB.

    Returns:
        Whether the kernel forbids programs, files and network; else there are the limits only.
    """
    for kind, most in (
        (resource.RLIMIT_AS, int(memory * 2**20)),
        (resource.RLIMIT_FSIZE, 0),
        (resource.RLIMIT_CORE, 0),
    ):
        _, hard = resource.getrlimit(kind)
        lowered = most if hard == resource.RLIM_INFINITY else min(most, hard)
        resource.setrlimit(kind, (lowered, lowered))
    return sys.platform == "linux" and _restrict()


def _restrict() -> bool:
    """Handle all kinds of access but reading, and allow none of them anywhere."""
    libc = ctypes.CDLL(None, use_errno=True)
    version = libc.syscall(_CREATE_RULESET, None, ctypes.c_size_t(0), ctypes.c_uint32(_VERSION))
    if version < 1:
        return False
    rules = _rules(version)
    ruleset = libc.syscall(_CREATE_RULESET, rules, ctypes.c_size_t(len(rules)), ctypes.c_uint32(0))
    if ruleset < 0:
        return False
    try:
        libc.prctl(_NO_NEW_PRIVILEGES, 1, 0, 0, 0)
        return bool(libc.syscall(_RESTRICT_SELF, ruleset, ctypes.c_uint32(0)) == 0)
    finally:
        os.close(ruleset)


def _rules(version: int) -> bytes:
    """What the kernel of this version shall handle, as its struct."""
    kinds = max(count for first, count in _KINDS.items() if first <= version)
    fields = [(1 << kinds) - 1 & ~_READ]
    if version >= _NETWORK_FROM:
        fields.append(_NETWORK)
    if version >= _SCOPES_FROM:
        fields.append(_SCOPES)
    return struct.pack(f"={len(fields)}Q", *fields)
