"""The sizes of a scene, by which mistakes in units are seen: the body, its parts, the sum of each load."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from petsc4py import PETSc

from ..problem import side_moments
from ..problem.problem import Problem
from ..solvers import obstacle_force
from ..system import existence
from ..workflow import Preparation


@dataclass(frozen=True, kw_only=True)
class Sizes:
    """Sizes in SI.

    Attributes:
        body: extent along each axis, m.
        parts: area of each boundary part, m² (m in 2D).
        loads: the sum of each load, N (N/m in 2D), by component.
        obstacle_forces: the force that presses an obstacle, by the name of its part and effect; as the loads.
    """

    body: tuple[float, ...]
    parts: dict[str, float]
    loads: dict[str, tuple[float, ...]]
    obstacle_forces: dict[str, tuple[float, ...]]

    def as_dict(self) -> dict[str, Any]:
        """The sizes by name."""
        return asdict(self)

    def lines(self) -> Iterator[str]:
        """The sizes, a line for each kind."""
        d = len(self.body)
        area, force = ("m", "N/m") if d == 2 else ("m²", "N")
        yield f"body: {' x '.join(f'{e:.4g}' for e in self.body)} m"
        yield f"parts: {', '.join(f'{name} {value:.4g} {area}' for name, value in self.parts.items())}"
        for name, total in self.loads.items():
            yield f"sum of {name}: {_listed(total)} {force}"
        for name, total in self.obstacle_forces.items():
            yield f"force on the obstacle of {name}: {_listed(total)} {force}"


def of(prepared: Preparation) -> Sizes:
    """The sizes of a scene. Collective.

    Args:
        prepared: the scene, assembled.

    Raises:
        InputError: on all ranks alike: forces press several obstacles.
    """
    problem = prepared.problem
    unit, d, comm = problem.scales.force, problem.scales.dimension, problem.domain.mesh.comm
    sums = {name: force.array_r.reshape(-1, d).sum(axis=0) for name, force in _loads(prepared).items()}
    return Sizes(
        body=tuple(map(float, problem.domain.upper - problem.domain.lower)),
        parts={name: side_moments.of(problem.space, facets).area for name, facets in problem.part_facets.items()},
        loads={name: _rounded(comm.allreduce(found) * unit) for name, found in sums.items()},
        obstacle_forces=_obstacle_forces(problem),
    )


def _loads(prepared: Preparation) -> Mapping[str, PETSc.Vec]:
    """The loads that are forces; given strains are none."""
    return existence.loads_of_rigid_motions(prepared.problem, prepared.system.forces)


def _obstacle_forces(problem: Problem) -> dict[str, tuple[float, ...]]:
    """What presses an obstacle, if anything does."""
    if (found := obstacle_force.pressed(problem)) is None:
        return {}
    return {found.name: _rounded(found.force * problem.scales.force * found.direction)}


def _listed(vector: Sequence[float]) -> str:
    return f"({', '.join(f'{component:.4g}' for component in vector)})"


def _rounded(force: Any) -> tuple[float, ...]:
    """The components; what is only rounding beside the largest is zero."""
    least = 1e-12 * float(np.max(np.abs(force), initial=0.0))
    return tuple(float(f) if abs(f) > least else 0.0 for f in force)
