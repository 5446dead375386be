"""``python3 -m hvi_fenicsx.studies.point SCENE.toml RESULT``: one point of a study, in a process (or ranks) of its own.

Writes RESULT.npz (the solution), then RESULT.json (what it cost), each whole or not at all; with ``--stiffness`` also
RESULT.stiffness.npz. Exit code 0 whatever the outcome of the solve; 2 for a scene that does not fit its mesh; that of
:func:`.runtime.writing.hand_over` where its files cannot be written.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

from mpi4py import MPI

from ..errors import HviError, NotWrittenError
from ..runtime import writing
from ..runtime.mpi import ended_together, on_root
from ..scene import read_scene
from .measured_point import MeasuredPoint
from .runner import COMPLAINT

COMM = MPI.COMM_WORLD


def main() -> int:
    """The command; its exit code. Collective under mpirun."""
    parser = argparse.ArgumentParser(prog="python3 -m hvi_fenicsx.studies.point")
    parser.add_argument("scene", type=Path)
    parser.add_argument("result", type=Path)
    parser.add_argument("--repeat", type=int, default=1, help="repetitions at most")
    parser.add_argument("--stiffness", action="store_true", help="write the stiffness too: it will be a reference")
    parser.add_argument("--accuracy", type=float, help="of an adaptive mesh, in the energy norm")
    options = parser.parse_args()
    try:
        with ended_together(COMM):
            _point(options)
    except NotWrittenError as error:
        return writing.hand_over(error) if COMM.rank == 0 else os.EX_IOERR
    except HviError as error:
        if COMM.rank == 0:
            print(f"{COMPLAINT}{error}", file=sys.stderr)
        return error.exit_code
    return 0


def _point(options: argparse.Namespace) -> None:
    scene = on_root(COMM, lambda: read_scene(options.scene))
    point = MeasuredPoint(scene=scene, comm=COMM, accuracy=options.accuracy, stiffness=options.stiffness)
    point.measure(options.result, options.repeat)


if __name__ == "__main__":
    raise SystemExit(main())
