"""PETSc options: the program's defaults, set only where the user set nothing, and never left behind.

Precedence: command line (``--petsc``, PETSC_OPTIONS), then the program's default. One constant prefix on all ranks.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from petsc4py import PETSc

PREFIX = "hvi_"


def configure(target: Any, defaults: Mapping[str, Any], prefix: str = PREFIX) -> None:
    """Call ``target.setFromOptions()`` under a prefix with these defaults below the user's own options. Collective."""
    database = PETSc.Options()
    unset = {f"{prefix}{k}": v for k, v in defaults.items() if not database.hasName(f"{prefix}{k}")}
    for name, value in unset.items():
        database.setValue(name, value)
    target.setOptionsPrefix(prefix)
    target.setFromOptions()
    for name in unset:
        database.delValue(name)


def insert(text: str) -> None:
    """Add a user's options string (``-hvi_ksp_monitor -hvi_snes_max_it 50``) to PETSc's database."""
    PETSc.Options().insertString(text)
