"""The rigid position of least energy: where bodies come to rest on their supports, contact and the laws' growth.

Over the amplitudes a of rigid motions the energy is convex, and so is the set that contact leaves. Cutting planes bound
it from below; each linear programme looks in a box about the best position so far, which grows while a better one is
found at its edge. So gaps and dead zones may be of any width.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt
from mpi4py import MPI

from ..runtime.mpi import on_root
from ..typing import Array, magnitude
from .cutting_planes import linear_programme
from .motions import DEFAULT

Energy = Callable[[Array], tuple[Array, Array]]
"""The convex energies of parts at amplitudes (k,): values (p,) and a subgradient of each, (p, k). Collective."""


@dataclass(frozen=True)
class OneSidedSupports:
    """What contact leaves: rows @ a <= limits. The same on all ranks.

    Attributes:
        rows: (m, k).
        limits: finite, (m,).
    """

    rows: Array
    limits: Array


@dataclass(frozen=True)
class RestingPosition:
    """A position at rest.

    Attributes:
        amplitudes: of the motions, (k,).
        bearing: the sides that bear the load, at most k, by number.
    """

    amplitudes: Array
    bearing: npt.NDArray[np.intp]


@dataclass(frozen=True)
class _Step:
    """The least energy of the cut model in a box.

    Attributes:
        amplitudes: where, (k,).
        energy: the model's energy there.
        inside: whether that is not at the edge of the box.
        reactions: of the sides, (m,).
    """

    amplitudes: Array
    energy: float
    inside: bool
    reactions: Array


@dataclass
class _CutModel:
    """The planes below each part's energy that were found so far.

    Attributes:
        work: minus the work of the load, (k,).
        sides: what contact leaves.
        heights: of the planes at a = 0, (p,) each.
        slopes: of the planes, (p, k) each.
    """

    work: Array
    sides: OneSidedSupports
    heights: list[Array] = field(default_factory=list)
    slopes: list[Array] = field(default_factory=list)

    @property
    def size(self) -> float:
        """The largest distance of a side."""
        return magnitude(self.sides.limits) or 1.0

    def cut(self, a: Array, values: Array, slopes: Array) -> float:
        """Add the planes that touch the energies at a, and return the whole energy there.

        Args:
            a: amplitudes, (k,).
            values: of the parts' energies, (p,).
            slopes: their subgradients, (p, k).
        """
        self.heights.append(values - slopes @ a)
        self.slopes.append(slopes)
        return float(self.work @ a + np.sum(values))

    def feasible(self) -> Array | None:
        """Amplitudes near zero that contact admits; None where there are none. Serial."""
        k = len(self.work)
        if np.all(self.sides.limits >= 0.0):
            return np.zeros(k)
        both = np.hstack([self.sides.rows, -self.sides.rows])
        found = self._solve(np.ones(2 * k), both, self.sides.limits, [(0.0, None)] * (2 * k))
        return None if found is None else found.x[:k] - found.x[k:]

    def minimise(self, centre: Array, radius: float) -> _Step | None:
        """The least energy of the model in a box; None where HiGHS finds none. Serial.

        Args:
            centre: of the box, (k,).
            radius: half of its width.
        """
        heights, slopes = np.array(self.heights), np.array(self.slopes)
        rounds, parts, k = slopes.shape
        # unknowns: the move in units of the radius, then each part's energy in units of the largest change of one
        size = radius * max(magnitude(v) for v in (self.work, slopes)) or 1.0
        at_centre = heights + slopes @ centre
        level = np.max(at_centre, axis=0)
        planes = np.hstack([slopes.reshape(-1, k) * (radius / size), -np.tile(np.eye(parts), (rounds, 1))])
        sides = np.hstack([self.sides.rows, np.zeros((len(self.sides.rows), parts))])
        room = (self.sides.limits - self.sides.rows @ centre) / radius
        found = self._solve(
            np.r_[self.work * (radius / size), np.ones(parts)],
            np.vstack([sides, planes]),
            np.r_[room, ((level - at_centre) / size).ravel()],
            [(-1.0, 1.0)] * k + [(None, None)] * parts,
        )
        if found is None:
            return None
        target = centre + radius * found.x[:k]
        return _Step(
            target,
            float(self.work @ target + np.sum(level) + size * np.sum(found.x[k:])),
            magnitude(found.x[:k]) < 1.0 - DEFAULT.rounding,
            -found.ineqlin.marginals[: len(room)],
        )

    def _solve(self, cost: Array, rows: Array, limits: Array, bounds: list[tuple[float | None, float | None]]) -> Any:
        found = linear_programme(cost, rows, limits, None, None, bounds)
        return found if found.status == 0 else None

    def rest(self, a: Array, reactions: Array) -> RestingPosition:
        """The position, and the sides that bear the load: the largest reactions first.

        Args:
            a: the amplitudes, (k,).
            reactions: of the sides, (m,).
        """
        room = self.sides.limits - self.sides.rows @ a
        touching = np.flatnonzero(room <= DEFAULT.touching * self.size)
        first = touching[np.argsort(-reactions[touching], kind="stable")]
        return RestingPosition(a, _independent(self.sides.rows, first, DEFAULT.touching))


def least_energy(comm: MPI.Comm, work: Array, energy: Energy, sides: OneSidedSupports) -> RestingPosition | None:
    """Minimise work·a + Σ_p energy_p(a) over rows @ a <= limits. Collective; the same on all ranks.

    Args:
        comm: the ranks.
        work: minus the work of the load, (k,).
        energy: of the parts.
        sides: what contact leaves.

    Returns:
        None where nothing stops the bodies, or no position is admissible.
    """
    model = _CutModel(work, sides)
    first = on_root(comm, model.feasible)
    return None if first is None else _descend(comm, model, energy, first)


def _descend(comm: MPI.Comm, model: _CutModel, energy: Energy, best: Array) -> RestingPosition | None:
    """From an admissible position to the one of least energy. Collective."""
    reactions: Array = np.zeros(len(model.sides.limits))
    radius, lowest = model.size, model.cut(best, *energy(best))
    tiny = DEFAULT.exact * max(magnitude(v) for v in (model.work, model.slopes[0]))
    for _ in range(DEFAULT.max_rounds):
        step = on_root(comm, functools.partial(model.minimise, best, radius))
        if step is None or radius > 1.0 / DEFAULT.rounding:
            return None
        reactions = step.reactions
        if lowest - step.energy <= tiny:
            break
        found = model.cut(step.amplitudes, *energy(step.amplitudes))
        radius *= (1.0 if step.inside else 4.0) if found < lowest else 0.5
        if found < lowest:
            best, lowest = step.amplitudes, found
        if step.inside and found - step.energy <= tiny:
            break
    return model.rest(best, reactions)


def _independent(rows: Array, order: npt.NDArray[np.intp], least: float) -> npt.NDArray[np.intp]:
    """The rows, taken in this order, that the ones before do not span."""
    chosen: list[int] = []
    basis = np.zeros((0, rows.shape[1]))
    for i in order:
        rest = rows[i] - basis.T @ (basis @ rows[i])
        length = float(np.linalg.norm(rest))
        if length > least * float(np.linalg.norm(rows[i])):
            basis, chosen = np.vstack([basis, rest / length]), [*chosen, int(i)]
    return np.array(chosen, dtype=np.intp)
