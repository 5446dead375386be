"""PETSc options: the program's defaults, set only where the user set nothing, and never left behind.

Precedence: command line (``--petsc``, PETSC_OPTIONS), then the program's default. One constant prefix on all ranks.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from petsc4py import PETSc

PREFIX = "hvi_"


@contextmanager
def below_the_users(defaults: Mapping[str, Any], prefix: str = PREFIX) -> Iterator[None]:
    """Defaults in force within a block. Levels of multigrid read theirs as late as in ``setUp``. Collective."""
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
    """Call ``target.setFromOptions()`` under a prefix with these defaults below the user's own options. Collective."""
    with below_the_users(defaults, prefix):
        target.setOptionsPrefix(prefix)
        target.setFromOptions()


def insert(text: str) -> None:
    """Add a user's options string (``-hvi_ksp_monitor -hvi_snes_max_it 50``) to PETSc's database."""
    PETSc.Options().insertString(text)
