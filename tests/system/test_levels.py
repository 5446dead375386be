"""What the coarser levels take over of Γc: bonds on a part with a corner, where the local axes turn."""

from __future__ import annotations

import numpy as np
from mpi4py import MPI
from scenes import NESTED, Table, model

from hvi_fenicsx import prepare, read_tables
from hvi_fenicsx.runtime.timing import Timer
from hvi_fenicsx.solvers import nested_iteration
from hvi_fenicsx.solvers.context import RunControl
from hvi_fenicsx.system.system import System
from hvi_fenicsx.typing import Array


def glued_corner() -> Table:
    glue = {"law": "graph", "points": [[0, 0], [1e-6, 1e6], [1e-5, 0]]}
    table = model(64, degree=2)
    del table["boundary"]["floor"], table["boundary"]["pull"]
    table["boundary"]["glue"] = {"on": ["bottom", "right"], "where": "x > 0.25", "cohesion": glue}
    return table


def springs(system: System) -> Array:
    """W K at the vertices of Γc in Cartesian components, (m, d, d)."""
    rows = system.jacobian.rows
    turned = system.frames.at(rows.vertices) if system.frames is not None else np.eye(2)
    return np.asarray(np.swapaxes(turned, -1, -2) @ rows.tangent @ turned)


def test_translations_meet_the_same_bonds_on_all_levels_at_corners_too() -> None:
    scene = read_tables(glued_corner())
    system = (found := prepare(scene, MPI.COMM_SELF, thresholds=NESTED)).system
    levels = nested_iteration.coarser_levels(scene.formulation(), system, found.options, RunControl(timer=Timer()))
    assert len(levels) > 1
    assert system.frames is not None
    generator = np.random.default_rng(2)
    system.jacobian.set_rates([np.eye(2) * generator.random((len(k), 1, 2)) for k in system.jacobian.rates])
    for level in levels:
        level.update()
        found_here = springs(level.system)
        assert np.allclose(found_here.sum(axis=0), springs(system).sum(axis=0), rtol=1e-12, atol=1e-14)
        assert np.allclose(found_here, found_here.transpose(0, 2, 1), rtol=1e-12, atol=1e-14)
