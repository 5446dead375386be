"""A long action on rank 0 asks whether to stop; a rank other than that says so at the third question."""

import json

from mpi4py import MPI

from hvi_fenicsx.runtime.mpi import on_root_asking

COMM = MPI.COMM_WORLD
asked = 0


def question() -> bool:
    """Whether the last rank has been asked three times. Collective."""
    global asked
    asked += 1
    return bool(COMM.allreduce(COMM.rank == COMM.size - 1 and asked == 3, op=MPI.LOR))


def steps(ask: object) -> int:
    """The steps until the answer is yes."""
    return next(number for number in range(1, 10) if ask())  # type: ignore[operator]


found = [on_root_asking(COMM, steps, question), on_root_asking(COMM, lambda ask: -1, question)]
told = COMM.gather((found, asked))
if COMM.rank == 0:
    print(json.dumps(told))
