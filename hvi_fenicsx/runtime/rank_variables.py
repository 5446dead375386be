"""What mpirun tells each process by variables of the environment, before MPI is started."""

from __future__ import annotations

import os

_RANK = ("OMPI_COMM_WORLD_RANK", "PMIX_RANK", "PMI_RANK")
_SIZE = ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE")


def is_under_mpirun() -> bool:
    """Whether mpirun or a batch system has started this process as a rank."""
    return any(name in os.environ for name in _RANK)


def is_first_rank() -> bool:
    """Whether this is rank 0, or no rank."""
    return next((os.environ[name] for name in _RANK if name in os.environ), "0") == "0"


def ranks() -> int:
    """The number of ranks; 1 where it is not known."""
    return next((int(os.environ[name]) for name in _SIZE if name in os.environ), 1)
