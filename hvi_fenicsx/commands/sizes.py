"""The sizes of a scene, by which mistakes in units are seen: the body, its parts, the sum of each load."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from petsc4py import PETSc

from ..preparation import Preparation
from ..problem import side_moments
from ..system import existence


@dataclass(frozen=True, kw_only=True)
class Sizes:
    """Sizes in SI.

    Attributes:
        body: extent along each axis, m.
        parts: area of each boundary part, m² (m in 2D).
        loads: the sum of each load, N (N/m in 2D), by component.
    """

    body: tuple[float, ...]
    parts: dict[str, float]
    loads: dict[str, tuple[float, ...]]

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
            yield f"sum of {name}: ({', '.join(f'{f:.4g}' for f in total)}) {force}"


def of(prepared: Preparation) -> Sizes:
    """The sizes of a scene. Collective.

    Args:
        prepared: the scene, assembled.
    """
    problem = prepared.problem
    unit, d, comm = problem.scales.force, problem.scales.dimension, problem.domain.mesh.comm
    sums = {name: force.array_r.reshape(-1, d).sum(axis=0) for name, force in _loads(prepared).items()}
    return Sizes(
        body=tuple(map(float, problem.domain.upper - problem.domain.lower)),
        parts={name: side_moments.of(problem.domain, facets).area for name, facets in problem.part_facets.items()},
        loads={name: _rounded(comm.allreduce(found) * unit) for name, found in sums.items()},
    )


def _loads(prepared: Preparation) -> Mapping[str, PETSc.Vec]:
    """The loads that are forces; given strains are none."""
    return existence.loads_of_rigid_motions(prepared.problem, prepared.system.forces)


def _rounded(force: Any) -> tuple[float, ...]:
    """The components; what is only rounding beside the largest is zero."""
    least = 1e-12 * float(np.max(np.abs(force), initial=0.0))
    return tuple(float(f) if abs(f) > least else 0.0 for f in force)
