"""Bodies and the rigid obstacles that forces press on them: the way of each obstacle is one more translation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..typing import Array
from .kernel import FixedDirections
from .motion_names import NEGLIGIBLE
from .motions import Mode, MotionFields, Movable, fields_at
from .reduction import ContactCone, Resistance, RigidProblem


@dataclass(frozen=True)
class PressedBody:
    """A body and obstacles that slide along given directions; nondimensional.

    Attributes:
        body: the body.
        obstacles: their names.
    """

    body: Movable
    obstacles: tuple[str, ...]

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return self.body.dimension

    @property
    def index(self) -> int:
        """The number of the body."""
        return self.body.index

    @property
    def motions(self) -> int:
        """Number of rigid motions, those of the obstacles among them."""
        return self.body.motions + len(self.obstacles)

    @property
    def shifts(self) -> int:
        """Number of translations: the body's, then the obstacles'."""
        return self.body.shifts + len(self.obstacles)

    def own(self, coefficients: Array) -> Array:
        """The coefficients of the body alone."""
        return np.delete(coefficients, range(self.body.shifts, self.shifts))

    def describe(self, coefficients: Array, *, signed: bool) -> str:
        """A motion in words.

        Args:
            coefficients: on the basis of the body, with those of the obstacles after its translations.
            signed: whether the name has the sense too.
        """
        least = NEGLIGIBLE * np.abs(coefficients).max()
        own, ways = self.own(coefficients), coefficients[self.body.shifts : self.shifts]
        who = " and ".join(name for name, way in zip(self.obstacles, ways, strict=True) if abs(way) > least)
        moved = self.body.describe(own, signed=signed) if np.abs(own).max() > least else ""
        if not who:
            return moved
        return f"{moved}, together with the obstacle of {who}" if moved else f"the obstacle of {who} alone"

    def widened(self, fields: Array, ways: Array | None = None) -> MotionFields:
        """The basis motions at some vertices, with those of the obstacles.

        Args:
            fields: of the body, (m, motions, d).
            ways: of the obstacles, (m, obstacles, d); None: they move nothing there.
        """
        m, _, d = fields.shape
        ways = np.zeros((m, len(self.obstacles), d)) if ways is None else ways
        at = self.body.shifts
        return MotionFields(np.concatenate([fields[:, :at], ways, fields[:, at:]], axis=1))


def pressed(problem: RigidProblem, forces: Mapping[str, float], ways: Sequence[Array]) -> RigidProblem:
    """The problem of a body and of obstacles that forces press on it.

    Args:
        problem: of the body, the obstacles at rest.
        forces: the size of each force, by the name of its obstacle.
        ways: what a unit of each obstacle's way does at the vertices of each contact cone: the cone admits motions y
            with (y + way)·n <= 0, (m, obstacles, d).
    """
    body = PressedBody(problem.body, tuple(forces))
    nothing = np.zeros(len(forces))
    loads = {name: _inserted(body, work, nothing) for name, work in problem.loads.items()}
    for i, (name, force) in enumerate(forces.items()):
        loads[name] = _inserted(body, np.zeros(problem.body.motions), force * np.eye(len(forces))[i])
    return RigidProblem(
        body=body,
        loads=loads,
        fixed=tuple(FixedDirections(_widened(body, f), f.directions) for f in problem.fixed),
        contact=tuple(
            ContactCone(_widened(body, cone, way), cone.normals)
            for cone, way in zip(problem.contact, ways, strict=True)
        ),
        resistances=tuple(replace(part, points=_widened(body, part)) for part in problem.resistances),
        force=problem.force + sum(forces.values()),
    )


def without_obstacles(problem: RigidProblem, mode: Mode | None) -> Mode | None:
    """A motion as one of the body alone, with its whole name; None where the body rests.

    Args:
        problem: of the body and its obstacles.
        mode: one of its motions.
    """
    if mode is None or not isinstance(problem.body, PressedBody):
        return mode
    own = problem.body.own(np.array(mode.coefficients))
    return replace(mode, coefficients=tuple(map(float, own))) if own.any() else None


def _inserted(body: PressedBody, work: Array, more: Array) -> Array:
    return np.insert(work, body.body.shifts, more)


def _widened(
    body: PressedBody, part: FixedDirections | ContactCone | Resistance, ways: Array | None = None
) -> MotionFields:
    return body.widened(fields_at(part.points, body.body), ways)
