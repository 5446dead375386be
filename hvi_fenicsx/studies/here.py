"""A study within this program: the points are solved one after the other by the ranks that ask for it."""

from __future__ import annotations

from mpi4py import MPI

from ..errors import HviError, NotWrittenError
from ..runtime.mpi import on_root
from .measured_point import MeasuredPoint
from .plan import Plan
from .run import check_reference
from .setting import Setting
from .store import Store, failed, write_json


def run_here(plan: Plan, store: Store, comm: MPI.Comm, repeat: int) -> None:
    """Run all points of a plan, the reference first. Collective.

    Unlike the points of ``hvi study`` they share a process: their peak memory is that of all before, and none is given
    up after a time.

    Args:
        plan: what is run.
        store: where the points go.
        comm: the ranks.
        repeat: repetitions of each point at most.

    Raises:
        NoReferenceError: no solution exists (3), or the reference is not certified (4); on all ranks alike.
        NotWrittenError: files cannot be written; on all ranks alike.
    """
    on_root(comm, store.open)
    finest, done = plan.reference[0], {store.name(plan.reference[0])}
    _measure(finest, store, comm, 1, stiffness=True)
    on_root(comm, lambda: check_reference(finest, store))
    for setting in (*plan.reference[1:], *plan.points):
        if (name := store.name(setting)) not in done:
            done.add(name)
            _measure(setting, store, comm, repeat)


def _measure(setting: Setting, store: Store, comm: MPI.Comm, repeat: int, *, stiffness: bool = False) -> None:
    """Measure a point; one that fails is a result too."""
    on_root(comm, lambda: store.announce(setting))
    point = MeasuredPoint(scene=setting.scene, comm=comm, accuracy=setting.accuracy, stiffness=stiffness)
    try:
        point.measure(store.path(setting), repeat)
    except NotWrittenError:
        raise
    except HviError as error:
        record = failed(str(error), error.exit_code)
        on_root(comm, lambda: write_json(store.path(setting).with_suffix(".json"), record))
