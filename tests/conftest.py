"""The environment of all tests: MPI runs as any user and with more ranks than cores; drawn examples repeat.

The examples that hypothesis draws are the same in each run, so that no unchanged program fails by chance. A search with
new ones: ``./hvi test --hypothesis-profile=search``; what it finds belongs into a test by name.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings

for name, value in {
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "PRTE_MCA_rmaps_default_mapping_policy": ":oversubscribe",
    "PRTE_MCA_mapby": ":oversubscribe",
    "OMPI_MCA_rmaps_base_oversubscribe": "1",
    # One machine: libfabric would take a second of each start to look for networks.
    "OMPI_MCA_btl": "^tcp,ofi",
    # Ranks that wait beside another test's would take its core.
    "OMPI_MCA_mpi_yield_when_idle": "1",
    "OMP_NUM_THREADS": "1",
}.items():
    os.environ.setdefault(name, value)
# Ranks and children of the tests find what the tests share, as pytest itself does.
os.environ["PYTHONPATH"] = os.pathsep.join([str(Path(__file__).parent / "support"), os.environ.get("PYTHONPATH", "")])

# No deadline for one example: the first one compiles or imports what the others find ready.
settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.register_profile("search", derandomize=False, deadline=None)
settings.load_profile("repeatable")


@pytest.fixture(autouse=True)
def session(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Each test's mpirun keeps its files apart: it would not start on those of a killed one of the same number."""
    with tempfile.TemporaryDirectory(prefix="hvi-mpi-", ignore_cleanup_errors=True) as folder:
        monkeypatch.setenv("PRTE_MCA_prte_local_tmpdir_base", folder)
        yield
