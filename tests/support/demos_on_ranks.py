"""Small versions of the Python demos: a few numbers of each, the same on all ranks; as a script, those of all ranks."""

from __future__ import annotations

import json
import runpy
import sys
from typing import Any

from mpi4py import MPI
from runs import ROOT

import hvi_fenicsx as hvi


def demo(name: str) -> dict[str, Any]:
    return runpy.run_path(str(ROOT / "demos" / f"{name}.py"))


def plate() -> list[float]:
    found = hvi.solve(demo("own_mesh")["model"](size=0.02), tolerance=1e-10)
    return [found.energy, *found.resultant("floor"), float(found.contact["floor"].pressure.max())]


def loop() -> list[float]:
    return [float(force) for force in demo("load_loop")["forces"](cells=6)[1:]]


def fibres() -> list[float]:
    block = demo("fibres_3d")
    found = hvi.solve(block["block"](hvi.Friction("bottom", block["LAW"])), tolerance=1e-10)
    return [found.energy, block["spread"](found, block["FIBRES"]), block["spread"](found, block["ACROSS"])]


if __name__ == "__main__":
    told = MPI.COMM_WORLD.gather({"own_mesh": plate, "load_loop": loop, "fibres_3d": fibres}[sys.argv[1]](), root=0)
    if MPI.COMM_WORLD.rank == 0:
        print(json.dumps(told))
