"""A search for equilibria on the ranks of MPI: what each rank logs, and what each says of points that differ."""

from __future__ import annotations

import json
import logging
from dataclasses import replace

from mpi4py import MPI
from scenes import block, quadratic_linear

import hvi_fenicsx as hvi
from hvi_fenicsx.equilibrium_search.bodies import Equilibria
from hvi_fenicsx.errors import SolverError

comm = MPI.COMM_WORLD
records: list[str] = []


class Kept(logging.Handler):
    def emit(self, record: logging.LogRecord) -> None:
        records.append(record.getMessage())


package = logging.getLogger("hvi_fenicsx")
package.addHandler(Kept())
package.setLevel(logging.DEBUG)
scene = hvi.read_tables(block(2, 0.0, friction=quadratic_linear(1e6)))
found = hvi.equilibria(scene)
searched = Equilibria(hvi.prepare(scene, comm))
(point,) = searched.find(lowest=False, gap=1e-8, stop=lambda: False, report=lambda _: None).points
try:
    said = str(searched.solution(replace(point, x=point.x * (1.0 + 1e-3 * comm.rank))).reason)
except SolverError as error:
    said = str(error)
certified = sum(line.startswith("certified: ") for line in records)
told = comm.gather([len(found.solutions), certified, said], root=0)
if comm.rank == 0:
    print(json.dumps(told))
