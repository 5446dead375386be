"""PETSc options: the program's defaults, set only where the user set nothing, and removed after use.

Precedence: the user's (``--petsc``, PETSC_OPTIONS, ``petsc=`` from Python), then the program's default. All solvers of
a run have one prefix, the same on all ranks; it is ``hvi_`` unless a Python program chooses another.
"""

from __future__ import annotations

import ctypes
import re
import weakref
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from ..errors import InputError
from ..runtime.mpi import agree

CHOLESKY: Mapping[str, object] = {
    "pc_type": "cholesky",
    "pc_factor_mat_solver_type": "mumps",
    "mat_mumps_icntl_14": 100,
}
"""Options of a direct solver. Its foreseen memory (a fifth more by default) is too little for some bodies on ranks."""
_PREFIX: ContextVar[str] = ContextVar("prefix of PETSc options", default="hvi_")
_OPTION = re.compile(r"--?[A-Za-z]")
_NAME = re.compile(r"[A-Za-z]\w*")
_VALUES = (str, bool, int, float, type(None))


def prefix() -> str:
    """The prefix of the options of all solvers that are made now."""
    return _PREFIX.get()


@contextmanager
def default_options(defaults: Mapping[str, Any], own_prefix: str = "") -> Iterator[None]:
    """Defaults in force within a block, unless the user set the option. Collective.

    Levels of a multigrid read their options as late as in ``setUp``.

    Args:
        defaults: values by name, without prefix; None for an option without value.
        own_prefix: of one kind of solver, after that of all options.
    """
    database, before = PETSc.Options(), f"{prefix()}{own_prefix}"
    unset = {f"{before}{k}": v for k, v in defaults.items() if not database.hasName(f"{before}{k}")}
    for name, value in unset.items():
        database.setValue(name, value)
    try:
        yield
    finally:
        for name in unset:
            database.delValue(name)


def configure(target: Any, defaults: Mapping[str, Any]) -> None:
    """Call ``target.setFromOptions()`` with defaults for the options that the user did not set. Collective.

    Args:
        target: a PETSc object that takes options.
        defaults: values by name, without prefix.
    """
    with default_options(defaults):
        target.setOptionsPrefix(prefix())
        target.setFromOptions()


@contextmanager
def chosen(options: Mapping[str, Any], own_prefix: str) -> Iterator[None]:
    """A user's options in force within a block, whose solvers have a prefix of the user's. Collective.

    Args:
        options: values by name, without prefix; None for an option without value.
        own_prefix: of these options, and of those that are in PETSc's database already.

    Raises:
        InputError: a name or a value that no option can have, or one that PETSc cannot use.
    """
    _check(options, own_prefix)
    database = PETSc.Options()
    before = {name: value for name, value in database.getAll().items() if name.startswith(own_prefix)}
    token = _PREFIX.set(own_prefix)
    for name, value in options.items():
        database.setValue(f"{own_prefix}{name}", value)
    try:
        with refusals_told():
            yield
    finally:
        _PREFIX.reset(token)
        for name in options:
            database.delValue(f"{own_prefix}{name}")
            if f"{own_prefix}{name}" in before:
                database.setValue(f"{own_prefix}{name}", before[f"{own_prefix}{name}"] or None)


def _check(options: Any, own_prefix: Any) -> None:
    if not isinstance(own_prefix, str) or not _NAME.fullmatch(own_prefix):
        raise InputError(f'petsc_prefix: {own_prefix!r} is no prefix of options; write letters and _, such as "floor_"')
    if not isinstance(options, Mapping):
        raise InputError(f'petsc: {options!r} is no table of options; write {{"ksp_max_it": 500}}, names without -')
    for name, value in options.items():
        if not isinstance(name, str) or not _NAME.fullmatch(name):
            raise InputError(f'petsc: {name!r} is no option; write its name without - and prefix, such as "ksp_max_it"')
        if not isinstance(value, _VALUES):
            raise InputError(f"petsc: {name} is {value!r}; give a number, a word, or None for an option without value")


def check_read(options: Mapping[str, Any], comm: MPI.Comm) -> None:
    """Refuse options that no solver has read, as a misspelt one. Collective.

    Args:
        options: of :func:`chosen`, within its block.
        comm: the ranks that solved.

    Raises:
        InputError: on all ranks alike.
    """
    for name in options:
        if not any(agree(comm, _is_read(f"{prefix()}{name}"))):
            raise InputError(
                f"petsc: no solver of this run has read {name}: it is misspelt, or of a solver that is not in use here "
                '("ksp_view": None shows those that are)'
            )


def _is_read(name: str) -> bool:
    """Whether some solver has asked for an option. petsc4py does not hand on this question of PETSc's."""
    found = ctypes.c_int(0)
    ctypes.CDLL(PETSc.__file__).PetscOptionsUsed(None, name.encode(), ctypes.byref(found))
    return bool(found.value)


class OptionError(InputError):
    """PETSc cannot use an option that the user set."""

    everywhere = False


@contextmanager
def refusals_told() -> Iterator[None]:
    """Tell an error of PETSc with the user's options, where there are any: they are what can be mended.

    Raises:
        OptionError: in the place of PETSc's error.
    """
    try:
        yield
    except PETSc.Error as error:
        raise_python_error(error)
        given = [f"-{k} {v or ''}".strip() for k, v in PETSc.Options().getAll().items() if k.startswith(prefix())]
        if not given:
            raise
        reason = str(error).splitlines()[-1].removeprefix(f"[{PETSc.COMM_WORLD.rank}] ")
        raise OptionError(f"PETSc stops with the options {' '.join(given)}: {reason}") from None


def insert(text: str) -> None:
    """Add a user's options string (``-hvi_ksp_monitor -hvi_snes_max_it 50``) to PETSc's database.

    Raises:
        InputError: a word of it is neither an option nor the value of one; PETSc would pass over it.
    """
    words = text.split()
    for before, word in zip(["", *words], words, strict=False):
        if not _OPTION.match(word) and not _OPTION.match(before):
            raise InputError(f'--petsc: "{word}" is no option and no value of one; options begin with a dash')
    PETSc.Options().insertString(text)
    if any(word.startswith("-log_view") for word in words):
        PETSc.Log.begin()  # PETSc itself asks for this option when it starts


def unread(text: str) -> Iterator[str]:
    """Warnings of options in a user's string that no solver has asked for, in sentences.

    Args:
        text: as given to :func:`insert`.
    """
    for word in text.split():
        if _OPTION.match(word) and not word.startswith("-log_view") and not _is_read(word[1:]):
            yield (
                f"--petsc: nothing has read {word}; options of this program's solvers begin with -{prefix()}, like "
                f"-{prefix()}ksp_type, and each is read only where such a solver is in use (docs/cluster.md)"
            )


_OF_SOLVES = (PETSc.Error, ArithmeticError, np.linalg.LinAlgError)
"""What a solve from a bad start may end with: PETSc's own errors, overflow, singular matrices."""


def raise_python_error(error: PETSc.Error) -> None:
    """Raise what a Python function has raised within a solve; nothing where the solve itself has failed.

    A request to stop at once is such an error, and a mistake in a law or in this program.

    Args:
        error: of the solve.

    Raises:
        BaseException: that of the function.
    """
    cause: BaseException | None = error
    while isinstance(cause, PETSc.Error):
        cause = cause.__cause__
    if cause is not None and not isinstance(cause, _OF_SOLVES):
        raise cause


def applied_by(owner: Any, matrix: PETSc.Mat) -> PETSc.PC:
    """The PC. Collective.

    Args:
        owner: its method ``apply(x, y)`` solves for y of the load x; it must not have a method ``destroy``, which
            petsc4py would call with every PC.
        matrix: what it preconditions.
    """
    # weakly: nothing would free a circle via PETSc
    pc, apply = PETSc.PC().create(matrix.comm), cast(Any, weakref.WeakMethod(owner.apply))
    pc.setOperators(matrix)
    pc.setType(PETSc.PC.Type.PYTHON)
    pc.setPythonContext(SimpleNamespace(apply=lambda _, x, y: apply()(x, y)))
    return pc
