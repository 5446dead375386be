"""What a method found, and the iterations that it took."""

from __future__ import annotations

from dataclasses import dataclass, field

from dolfinx import fem

from .convergence import Outcome


@dataclass
class Counts:
    """Iterations spent.

    Attributes:
        newton: Newton steps.
        linear: iterations of linear solvers.
        branch: convex steps.
    """

    newton: int = 0
    linear: int = 0
    branch: int = 0

    def add_outcome(self, step: Outcome) -> None:
        """Add the iterations of one solve of the active set solver."""
        self.newton += step.newton
        self.linear += step.linear

    def add(self, other: Counts) -> None:
        """Add the iterations of another method."""
        self.newton += other.newton
        self.linear += other.linear
        self.branch += other.branch


@dataclass(frozen=True, kw_only=True)
class Borne:
    """The last state that is borne, where the load path ends before the whole load.

    Attributes:
        u: the displacement in units of u0, ghosts updated.
        factor: of all loads and prescribed displacements.
    """

    u: fem.Function
    factor: float


@dataclass(frozen=True, kw_only=True)
class SolveResult:
    """What a method found.

    Attributes:
        u: the displacement in units of u0, ghosts updated.
        method: its name.
        converged: by the method's own test.
        reason: why it ended, for people.
        counts: iterations.
        energies: after each convex step, nondimensional.
        interrupted: whether it ended because it was asked to.
        levels: levels of the mesh hierarchy on which it was solved, one after the other.
        steady: whether the pieces and the active set of the start were the final ones, on every level.
        borne: what of the load is borne, where a load path was followed and says so.
        off_path: how the load path ended, where it ended before the whole load and this was found from another start.
    """

    u: fem.Function
    method: str
    converged: bool
    reason: str
    counts: Counts = field(default_factory=Counts)
    energies: tuple[float, ...] = ()
    interrupted: bool = False
    levels: int = 1
    steady: bool = False
    borne: Borne | None = None
    off_path: str | None = None
