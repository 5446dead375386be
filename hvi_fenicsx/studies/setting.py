"""What one point of a study solves."""

from __future__ import annotations

from dataclasses import dataclass

from ..report.units import quantity
from ..scene import Scene

ADAPTIVE = "adaptive to "
"""How the text of an adaptive mesh begins."""


def law_text(smoothing: str | None, epsilon: float | None, epsilon_absolute: float | None) -> str:
    """The law in words: exact, or how it is smoothed.

    Args:
        smoothing: its kind; None for the exact law.
        epsilon: its relative width.
        epsilon_absolute: its width in N/m, where the scene says it so.
    """
    if smoothing is None:
        return "exact law"
    width = f"{epsilon_absolute:g} N/m" if epsilon_absolute is not None else f"{epsilon:.3g}"
    kind = "" if smoothing == "quadratic" else f"{smoothing}, "
    return f"{kind}ε = {width}"


@dataclass(frozen=True)
class Setting:
    """What one point solves.

    Attributes:
        scene: the scene, on its own mesh.
        accuracy: instead of that mesh, one refined adaptively until the estimate is below this (`hvi run --accuracy`).
    """

    scene: Scene
    accuracy: float | None = None

    @property
    def mesh(self) -> str:
        """The mesh, as people name it."""
        if self.accuracy is not None:
            return f"{ADAPTIVE}{100 * self.accuracy:g} %"
        return self.scene.domain.mesh_text(lambda metres: quantity(metres, "m"))

    @property
    def law(self) -> str:
        """The law: exact, or how it is smoothed."""
        solver = self.scene.solver
        return law_text(solver.smoothing, solver.epsilon, solver.epsilon_absolute)

    @property
    def unknowns(self) -> float:
        """About how many there are; of a mesh file, which is not opened for it, a guess."""
        times = 1.0 if self.degree == 1 else 2.0**self.scene.dimension
        return times * self.scene.domain.unknowns(self.scene.dimension)

    @property
    def degree(self) -> int:
        """The degree of the elements."""
        return self.scene.solver.degree or 1
