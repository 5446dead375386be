"""Processes that the program starts: an environment in which they are no ranks of ours, and an end in any event.

Nothing here starts MPI.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

from ..errors import InputError

_PR_SET_PDEATHSIG = 1
"""prctl(2)."""
_MPI = ("OMPI_", "PMIX_", "PRTE_", "PMI_", "HYDRA_", "MPI_LOCAL")
_WISHES = (
    "OMPI_ALLOW_RUN_AS_ROOT",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM",
    "OMPI_MCA_btl",
    "OMPI_MCA_mpi_yield_when_idle",
    "OMPI_MCA_rmaps_base_oversubscribe",
    "PRTE_MCA_mapby",
    "PRTE_MCA_rmaps_default_mapping_policy",
)
"""Variables of users (and of `./hvi`) for any mpirun, not of one run."""


def environment() -> dict[str, str]:
    """Ours, without what would make a child believe that it is a rank, and with this package on its path."""
    kept = {name: value for name, value in os.environ.items() if name in _WISHES or not name.startswith(_MPI)}
    paths = [str(Path(__file__).parents[2]), kept.get("PYTHONPATH", "")]
    return {**kept, "PYTHONPATH": os.pathsep.join(filter(None, paths))}


def launcher(ranks: int) -> list[str]:
    """What starts Python on so many ranks; `-m mpi4py` ends all ranks when one fails.

    Raises:
        InputError: there is no mpirun.
    """
    mpirun = shutil.which("mpirun")
    if mpirun is None:
        raise InputError("--np: there is no mpirun on the PATH; install Open MPI or MPICH, or leave --np out")
    return [mpirun, "-n", str(ranks), sys.executable, "-m", "mpi4py"]


def die_with_parent(order: signal.Signals = signal.SIGTERM) -> None:
    """Send this process a signal when the one that started it is killed. Linux only.

    Nothing else would end mpirun in a session of its own, nor a rank, which waits for ever for the mpirun that is gone.
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, order)


def end(child: subprocess.Popen[str], patience: float) -> None:
    """End a child that leads a group: politely first, so that it and its own children can tidy up."""
    for order in (signal.SIGTERM, signal.SIGKILL):
        with contextlib.suppress(OSError):
            os.killpg(child.pid, order)
        with contextlib.suppress(subprocess.TimeoutExpired):
            child.communicate(timeout=patience)
