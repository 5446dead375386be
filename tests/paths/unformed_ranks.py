"""Prints the rows of a path whose condensed stiffness is not formed, and whether all ranks have the same."""

from __future__ import annotations

import json

from mpi4py import MPI
from test_unformed_paths import QUICK, SCENES
from unformed import figures, path_run, words


def main() -> None:
    """Loaded, unloaded and loaded again."""
    comm = MPI.COMM_WORLD
    path = path_run(SCENES[QUICK], formed=False, comm=comm).follow()
    found = {"end": path.end, "words": words(path), "figures": figures(path)}
    everywhere = comm.gather(found)
    if comm.rank == 0:
        print(json.dumps(found | {"equal": all(other == found for other in everywhere)}))


if __name__ == "__main__":
    main()
