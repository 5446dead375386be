"""How mesh, smoothing and tolerance of the next adaptive step follow from the parts of the last step's error."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ..scene import Scene
from .cost_forecast import AdaptiveStep, Elements
from .quantity_base import Quantity
from .thresholds import ControlThresholds


@dataclass(frozen=True, kw_only=True)
class ErrorBalance:
    """The balance between the three parts of the error.

    The mesh has the largest part; smoothing and solver get what is small beside it.

    Attributes:
        accuracy: what is asked for, relative; None: as small as the time allows.
        quantity: the target quantity.
        elements: that are refined.
        thresholds: how the parts are balanced.
    """

    accuracy: float | None
    quantity: Quantity
    elements: Elements
    thresholds: ControlThresholds

    @property
    def largest_bulk(self) -> float:
        """Part of the squared error that a step refines, unless it is the last one."""
        if self.quantity.known_from_one_mesh and not self.quantity.in_energy_norm:
            return self.thresholds.bulk_on_contact
        return self.thresholds.bulk_2d if self.elements.dimension == 2 else self.thresholds.bulk_3d

    def bulk(self, last: AdaptiveStep) -> float:
        """Part of the squared error to refine: no more than the aim needs.

        Args:
            last: the last step.
        """
        if self.accuracy is None or not self.quantity.known_from_one_mesh:
            return self.largest_bulk
        mesh, smoothing, _ = self.quantity.parts(last)
        left = self._beside(smoothing) / mesh if mesh > 0 else 1.0
        # On Γc errors fall as the square of the energy norm's. Halving the edges of marked cells leaves 4^-p of it.
        needed = (1 - (left**2 if self.quantity.in_energy_norm else left)) / (1 - 0.25**self.elements.degree)
        return max(self.thresholds.smallest_bulk, needed) if needed <= self._largest_last_bulk else self.largest_bulk

    @property
    def _largest_last_bulk(self) -> float:
        """Part of the squared error that a step may refine if that is enough for the aim."""
        goes_far = self.elements == Elements(dimension=2, degree=2) and self.quantity.in_energy_norm
        return self.thresholds.last_bulk_of_degree_2 if goes_far else self.largest_bulk

    def _beside(self, part: float) -> float:
        """The largest error beside a part with which both together are no larger than the aim."""
        return math.sqrt(max((self.thresholds.aim * (self.accuracy or 0.0)) ** 2 - part**2, 0.0))

    def mesh_suffices(self, steps: Sequence[AdaptiveStep]) -> bool:
        """Whether the next step must change ε or the tolerance, and not the mesh.

        Args:
            steps: all steps so far, one at least.
        """
        mesh, smoothing, algebraic = self.quantity.parts(steps[-1])
        if smoothing > max(mesh, self._allowed_smoothing(mesh)):
            return self._smoothing_falls(steps)
        wanted = self.thresholds.aim * (self.accuracy or 0.0)
        return mesh <= wanted < max(smoothing, algebraic) * 2

    @staticmethod
    def _smoothing_falls(steps: Sequence[AdaptiveStep]) -> bool:
        """Whether a smaller ε on the same mesh, where the last step tried it, made smoothing's part smaller."""
        last, before = steps[-1], steps[-2] if len(steps) > 1 else None
        return before is None or before.dofs != last.dofs or last.smoothing < 0.99 * before.smoothing

    def _allowed_smoothing(self, mesh: float) -> float:
        """The error that smoothing may cause: a part of the accuracy, or all that a fine enough mesh leaves."""
        if self.accuracy is None:
            return self.thresholds.smoothing * mesh
        return max(self.thresholds.smoothing * self.accuracy, self._beside(mesh))

    def next_scene(self, scene: Scene, last: AdaptiveStep) -> Scene:
        """The scene with the ε and the tolerance of the next step.

        Args:
            scene: of the last step.
            last: the last step.
        """
        mesh, smoothing, _ = self.quantity.parts(last)
        allowed = self._allowed_smoothing(mesh)
        factor = max(0.8 * allowed / smoothing, self.thresholds.narrowest_step) if smoothing > allowed else 1.0
        return narrowed(with_tolerance(scene, self._next_tolerance(last)), factor)

    def _next_tolerance(self, last: AdaptiveStep) -> float:
        estimate = last.discretisation if self.accuracy is None else self.accuracy
        error = min(last.error, max(last.discretisation, estimate))
        wanted = self.thresholds.algebraic * (error if self.quantity.in_energy_norm else min(error, estimate))
        if last.algebraic > 0.1 * max(last.discretisation, estimate):
            wanted = min(wanted, 0.1 * last.tolerance)
        return min(max(wanted, self.thresholds.finest_tolerance), self.thresholds.coarsest_tolerance)


def with_tolerance(scene: Scene, tolerance: float) -> Scene:
    """The scene with another tolerance of the solver.

    Args:
        scene: what to solve.
        tolerance: relative.
    """
    return scene.with_solver(tolerance=tolerance)


def narrowed(scene: Scene, factor: float) -> Scene:
    """The scene with a smaller ε; the same where it does not smooth.

    Args:
        scene: what to solve.
        factor: on ε.
    """
    solver = scene.solver
    widths = {name: getattr(solver, name) for name in ("epsilon", "epsilon_absolute")}
    changed = {name: factor * width for name, width in widths.items() if width is not None}
    return scene.with_solver(**changed)
