"""The contact pressure within facets under a gap that varies there: a contact problem of each facet on its own.

A facet gives way to a change of pressure by the compliance of its modes. The body as a whole moves along the normal so
that the force on the part stays, unless something holds it.
"""

from __future__ import annotations

import numpy as np
from mpi4py import MPI

from ...runtime.mpi import total
from ...typing import Array
from .facet_modes import FacetModes
from .thresholds import EstimateThresholds


def redistributed(
    comm: MPI.Comm,
    on: FacetModes,
    pushes: Array,
    gaps: Array,
    compliance: Array,
    *,
    free: bool,
    thresholds: EstimateThresholds,
) -> Array:
    """Pressures p ≥ 0 with w ≤ gap and p (gap - w) = 0, w being what the pushes less p cause, (f, q). Collective.

    Args:
        comm: the ranks.
        on: the facets.
        pushes: pressures that are given, (f, q).
        gaps: how far the facets are from the obstacle, (f, q).
        compliance: of the facets along the normal, (f,).
        free: whether the body may move along the normal.
        thresholds: how many rounds.
    """
    kernel = (on.values.T / (on.degrees + 0.5)) @ on.values * on.weights
    missing = np.eye(len(on.weights)) - on.values.T @ on.values * on.weights
    kernel += missing / (on.degrees[-1] + 1.5)
    within, pressure = gaps / compliance[:, None], pushes.copy()
    if not free:
        return _solved(kernel, pushes, within, pressure, 4 * thresholds.coupled_rounds)
    areas = on.facets.areas[:, None] * on.weights
    wanted = total(comm, float(np.sum(areas * pushes)))
    if wanted == 0.0:
        return pressure
    reach = (pushes @ kernel.T) * compliance[:, None]
    low = comm.allreduce(float(np.min(gaps - reach, initial=0.0)), op=MPI.MIN)
    high = comm.allreduce(float(np.max(gaps, initial=0.0)), op=MPI.MAX)
    for _ in range(thresholds.gap_shifts):
        shift = (low + high) / 2
        pressure = _solved(kernel, pushes, within - shift / compliance[:, None], pressure, thresholds.coupled_rounds)
        more = total(comm, float(np.sum(areas * pressure))) > wanted
        low, high = (low, shift) if more else (shift, high)
    return pressure


def _solved(kernel: Array, pushes: Array, within: Array, pressure: Array, sweeps: int) -> Array:
    """Projected Gauss-Seidel sweeps over the points, all facets at once, (f, q)."""
    p = pressure.copy()
    beyond = (pushes - p) @ kernel.T - within
    for _ in range(sweeps):
        for i, own in enumerate(np.diag(kernel)):
            change = np.maximum(beyond[:, i] / own, -p[:, i])
            p[:, i] += change
            beyond -= change[:, None] * kernel[:, i]
    return p
