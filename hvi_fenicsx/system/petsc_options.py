"""PETSc options: the program's defaults, set only where the user set nothing, and removed after use.

Precedence: command line (``--petsc``, PETSC_OPTIONS), then the program's default. One constant prefix on all ranks.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from petsc4py import PETSc

from ..errors import InputError

PREFIX = "hvi_"
CHOLESKY: Mapping[str, object] = {"pc_type": "cholesky", "pc_factor_mat_solver_type": "mumps"}
"""Options of a direct solver."""


@contextmanager
def default_options(defaults: Mapping[str, Any], prefix: str = PREFIX) -> Iterator[None]:
    """Defaults in force within a block, unless the user set the option. Collective.

    Levels of a multigrid read their options as late as in ``setUp``.

    Args:
        defaults: values by name, without prefix; None for an option without value.
        prefix: of the options.
    """
    database = PETSc.Options()
    unset = {f"{prefix}{k}": v for k, v in defaults.items() if not database.hasName(f"{prefix}{k}")}
    for name, value in unset.items():
        database.setValue(name, value)
    try:
        yield
    finally:
        for name in unset:
            database.delValue(name)


def configure(target: Any, defaults: Mapping[str, Any], prefix: str = PREFIX) -> None:
    """Call ``target.setFromOptions()`` with defaults for the options that the user did not set. Collective.

    Args:
        target: a PETSc object that takes options.
        defaults: values by name, without prefix.
        prefix: of the options.
    """
    with default_options(defaults, prefix):
        target.setOptionsPrefix(prefix)
        target.setFromOptions()


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
        given = [f"-{k} {v or ''}".strip() for k, v in PETSc.Options().getAll().items() if k.startswith(PREFIX)]
        if not given:
            raise
        reason = str(error).splitlines()[-1].removeprefix(f"[{PETSc.COMM_WORLD.rank}] ")
        raise OptionError(f"--petsc: PETSc stops with the options {' '.join(given)}: {reason}") from None


def insert(text: str) -> None:
    """Add a user's options string (``-hvi_ksp_monitor -hvi_snes_max_it 50``) to PETSc's database."""
    PETSc.Options().insertString(text)
