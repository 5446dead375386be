"""What one point of a study solves."""

from __future__ import annotations

from dataclasses import dataclass

from ..report.units import quantity
from ..scene import Scene

ADAPTIVE = "adaptive to "
"""How the text of an adaptive mesh begins."""


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
        width = solver.epsilon if solver.epsilon is not None else solver.epsilon_absolute
        return "exact law" if width is None else f"{solver.smoothing}, ε = {width:g}"

    @property
    def unknowns(self) -> float:
        """About how many there are; of a mesh file, which is not opened for it, a guess."""
        times = 1.0 if self.degree == 1 else 2.0**self.scene.dimension
        return times * self.scene.domain.unknowns(self.scene.dimension)

    @property
    def degree(self) -> int:
        """The degree of the elements."""
        return self.scene.solver.degree or 1
