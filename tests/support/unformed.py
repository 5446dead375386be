"""Paths whose condensed stiffness is formed, and is not."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from mpi4py import MPI

from hvi_fenicsx import prepare, read_tables
from hvi_fenicsx.load_paths.following import PathRun
from hvi_fenicsx.paths.load_path import LoadPath
from hvi_fenicsx.system.thresholds import DEFAULT


def path_run(table: dict[str, Any], *, formed: bool, comm: MPI.Comm = MPI.COMM_WORLD) -> PathRun:
    """A path that is to be followed with or without S as an array."""
    thresholds = replace(DEFAULT, largest_dense=10**6 if formed else 0, solve_overhead=np.inf if formed else 0.0)
    scene = read_tables(table)
    assert scene.path is not None
    return PathRun(prepare(scene, comm, thresholds=thresholds), scene.path)


def words(path: LoadPath) -> list[tuple[object, ...]]:
    """What rows say without figures."""
    places = (None if row.point is None else tuple(row.point.round(9)) for row in path.rows)
    return [(row.event, row.part, row.unstable, row.certified, at) for row, at in zip(path.rows, places, strict=True)]


def figures(path: LoadPath) -> list[list[list[float]]]:
    """The figures of rows, by kind: factors, energies, forces, displacements."""
    rows = path.rows
    return [
        [[row.factor] for row in rows],
        [[row.energy, row.work, row.dissipated, row.released] for row in rows],
        [[float(f) for force in row.forces.values() for f in force] for row in rows],
        [[float(u) for mean in row.displacements.values() for u in mean] for row in rows],
    ]


def difference(one: list[list[list[float]]], other: list[list[list[float]]]) -> float:
    """The largest difference of figures, relative to the greatest of its kind."""
    pairs = [(np.array(a), np.array(b)) for a, b in zip(one, other, strict=True)]
    return max(float(np.max(np.abs(a - b)) / np.max(np.abs(a))) for a, b in pairs)
