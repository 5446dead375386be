"""Compiled forms: kept on disk for later runs, whatever becomes of the run that compiles them.

dolfinx's own cache marks a form that is being compiled by a file. The file stays when the process is killed; later runs
wait for it and fail. Here a form is compiled in a folder of its own, which gets its final name when it is complete. A
lock of the kernel, which ends with its process, has a second run wait instead of compile the same form.
"""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import os
import shutil
import sysconfig
import tempfile
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import dolfinx.jit
import ffcx
import ffcx.options
import numpy as np
import ufl
from dolfinx import fem
from dolfinx.mesh import meshtags
from mpi4py import MPI

from .. import compat
from ..errors import HviError, InputError
from . import log, processes
from .mpi import agree, on_root

_LOG = log.logger("runtime")


_COMPILATION = 600
"""Seconds that a rank waits for a form which is compiled on another one."""


class CompilationError(HviError):
    """A form cannot be compiled."""


class FormCache:
    """Compiles forms and keeps them; where the cache cannot be written, in a folder that goes with this process.

    Args:
        wanted: the folder of the cache; None: dolfinx's, from XDG_CACHE_HOME or the options of dolfinx.
    """

    def __init__(self, wanted: Path | None = None) -> None:
        self._wanted = wanted
        self._temporary: tempfile.TemporaryDirectory[str] | None = None

    def compiled(self, form: Any) -> fem.Form:
        """A UFL form, compiled now or by an earlier run. Collective.

        Args:
            form: UFL, not empty.

        Raises:
            CompilationError: it cannot be compiled, on all ranks alike.
        """
        form, comm = _renumbered(form), compat.comm_of(form)
        kept = on_root(comm, lambda: self.folder / _name(form))
        if all(agree(comm, kept.is_dir())):
            with contextlib.suppress(CompilationError):
                return _made(form, comm, kept)
            on_root(comm, lambda: shutil.rmtree(kept, ignore_errors=True))  # damaged
        lock = on_root(comm, lambda: _lock(kept.with_suffix(".lock")))
        try:
            return _made(form, comm, kept) if all(agree(comm, kept.is_dir())) else _built(form, comm, kept)
        finally:
            if comm.rank == 0:
                os.close(lock)

    @cached_property
    def folder(self) -> Path:
        """The folder of the cache, which can be written. Rank 0 only."""
        usual = Path(options()["cache_dir"])
        if not usual.is_absolute():  # or empty: the default, as XDG wants it
            usual = Path.home() / ".cache" / "fenics"
        wanted = self._wanted or usual / "hvi_fenicsx"
        try:
            wanted.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=wanted):
                return wanted
        except OSError as error:
            self._temporary = tempfile.TemporaryDirectory(prefix="hvi-forms-", ignore_cleanup_errors=True)
            text = "they are compiled again at each start: make room there, or set XDG_CACHE_HOME to another folder"
            _LOG.warning("compiled forms cannot be kept in %s (%s); %s", wanted, error.strerror, text)
            return Path(self._temporary.name)


def _built(form: Any, comm: MPI.Comm, kept: Path) -> fem.Form:
    """Compile a form; its folder gets its name when it is complete. Collective; rank 0 holds the lock."""
    folder = on_root(comm, lambda: _new_folder(kept))
    try:
        result = _made(form, comm, folder)
        on_root(comm, lambda: folder.rename(kept))
        return result
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _made(form: Any, comm: MPI.Comm, folder: Path) -> fem.Form:
    """What dolfinx makes of the form in a folder. Collective.

    Raises:
        CompilationError: on all ranks alike.
        KeyboardInterrupt: on all ranks alike, after a signal, which ends the compiler too.
    """
    result, fault = None, ""
    asked = {**options(), "cache_dir": folder, "timeout": _COMPILATION}
    try:
        result = fem.form(form, jit_options=asked)
    except Exception as error:  # dolfinx, ffcx, cffi, setuptools and the file system have errors of their own
        fault = f"{type(error).__name__}: {error}"
    faults = [text for text in agree(comm, fault) if text]
    if not faults:
        return result
    if any(agree(comm, processes.stop_asked())):
        raise KeyboardInterrupt
    raise CompilationError(f"a form cannot be compiled: {faults[0]}; it needs a C compiler and Python's headers")


compiled = FormCache().compiled
"""The cache of this process."""


@cache
def options() -> dict[str, Any]:
    """The options of dolfinx's compiler: its defaults and the user's, without those of the current folder.

    Raises:
        InputError: a file of options is damaged.
    """
    try:
        with contextlib.chdir(Path(__file__).parent):  # both read a file of the current folder, once
            ffcx.options.get_options()
            return dict(dolfinx.jit.get_options())
    except ValueError as error:
        raise InputError(f"the user's dolfinx_jit_options.json or ffcx_options.json is not valid: {error}") from None


def _name(form: Any) -> str:
    """A name for all that the compiled form depends on."""
    return hashlib.sha256(repr([form.signature(), *_surroundings()]).encode()).hexdigest()[:40]


@cache
def _surroundings() -> list[Any]:
    """What all compiled forms depend on."""
    free = {key: value for key, value in options().items() if key not in ("cache_dir", "timeout")}
    system = [sysconfig.get_config_var(name) for name in ("SOABI", "CFLAGS")]
    compiler = sorted(ffcx.options.get_options().items())
    return [ffcx.__version__, compat.VERSION, system, sorted(free.items()), compiler]


def _new_folder(kept: Path) -> Path:
    """An empty folder to compile in; what killed runs have left of the same form goes. Rank 0 only, with the lock."""
    for left in kept.parent.glob(f"{kept.name}.building-*"):
        shutil.rmtree(left, ignore_errors=True)
    return Path(tempfile.mkdtemp(prefix=f"{kept.name}.building-", dir=kept.parent))


def _lock(file: Path) -> int:
    """The lock of a form, waited for, which ends with its process; none where the file system has no locks."""
    descriptor = os.open(file, os.O_RDWR | os.O_CREAT)
    with contextlib.suppress(OSError):
        fcntl.flock(descriptor, fcntl.LOCK_EX)
    return descriptor


def _renumbered(form: Any) -> Any:
    """A form over one boundary part as one over facets of the number 1: so parts share a compiled form."""
    over = [i for i in form.integrals() if i.integral_type() == "exterior_facet"]
    tags, numbers = (over[0].subdomain_data(), over[0].subdomain_id()) if over and form.arguments() else (None, "")
    others = any(i.subdomain_data() is not tags or i.subdomain_id() != numbers for i in over)
    if tags is None or isinstance(numbers, str) or others:
        return form
    on = tags.indices[np.isin(tags.values, numbers)]
    one = meshtags(form.arguments()[0].ufl_function_space().mesh, tags.dim, on, np.ones_like(on))
    rest = [i for i in form.integrals() if i.integral_type() != "exterior_facet"]
    return ufl.Form([*rest, *(i.reconstruct(subdomain_id=1, subdomain_data=one) for i in over)])
