"""What an effect adds to a problem: forms, prescribed components, bounds, laws."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any, Protocol

import numpy as np

from ..formula import Formula, SpatialValue
from ..laws import Length, Mixity, Superpotential
from ..typing import Array


class Direction(Enum):
    """The displacement that a law of Γc acts on."""

    SLIP = "slip"
    """u_t; in 3D |u_t|."""
    OPENING = "opening"
    """-u·n, n outward: positive when the body lifts off."""
    PENETRATION = "penetration"
    """u·n: positive when the body is pressed into its support."""
    SEPARATION = "separation"
    """sqrt(⟨-u·n⟩₊² + β²|u_t|²): opening and slip together; compression does not count."""

    @property
    def tangential(self) -> bool:
        """Whether the slip is in it."""
        return self in (Direction.SLIP, Direction.SEPARATION)

    @property
    def normal(self) -> bool:
        """Whether an opening or a penetration is in it."""
        return self is not Direction.SLIP

    def along(self, normals: Array, tangents: Array) -> Array:
        """The unit vectors of the components that it is made of, (m, k, d).

        Args:
            normals: outward, (m, d).
            tangents: (m, d-1, d).
        """
        opening = -normals[:, None, :]
        found = {
            Direction.SLIP: (tangents,),
            Direction.OPENING: (opening,),
            Direction.PENETRATION: (-opening,),
            Direction.SEPARATION: (opening, tangents),
        }
        return np.concatenate(found[self], axis=1)

    def length(self, tangents: int, slip: float) -> Length | None:
        """The length of these components that a law acts on; None: it acts on the one component, with its sign.

        Args:
            tangents: how many there are.
            slip: what a slip is multiplied by where it is taken together with an opening.
        """
        if self is Direction.SEPARATION:
            return Length((1.0,) + (slip,) * tangents, opens=True)
        return Length.plain(tangents) if self is Direction.SLIP and tangents > 1 else None


@dataclass(frozen=True, slots=True)
class Condition:
    """A prescribed displacement component on a part.

    Attributes:
        component: its number, from 0.
        value: m.
    """

    component: int
    value: SpatialValue


class Towards(Protocol):
    """In which direction an obstacle is."""

    @property
    def constant(self) -> tuple[float, ...] | None:
        """The unit vector towards it, where that is the same for all points."""

    def towards(self, points: Array) -> Array:
        """The unit vectors towards it.

        Args:
            points: (m, d), m.

        Returns:
            (m, d); NaN where there is none.
        """


@dataclass(frozen=True, slots=True)
class ObstacleMotion:
    """What moves an obstacle: a displacement, or a force along which it slides.

    Attributes:
        vector: m; of a force N/m in 2D, N in 3D.
        lower: the lower bound without the displacement, or where it has slid by a metre along the force, m.
        straight: whether the bound changes in proportion to the way.
    """

    vector: tuple[float, ...]
    lower: SpatialValue
    straight: bool


@dataclass(frozen=True, slots=True)
class NormalBounds:
    """lower ≤ -u·n ≤ upper on a part. Unilateral contact with the gap g has lower = -g.

    Attributes:
        lower: m; None: no bound.
        upper: m; None: no bound.
        towards: the obstacle, whose direction stands for n; None: the part's own normal.
        measured: whether the distance of the two sides of an interface, as they are meshed, is added to the gap.
        move: the displacement of the obstacle that is in the bounds; None: it has none.
        force: what presses the obstacle, which is where it is described in the bounds; None: it does not slide.
    """

    lower: SpatialValue | None
    upper: SpatialValue | None
    towards: Towards | None = None
    measured: bool = False
    move: ObstacleMotion | None = None
    force: ObstacleMotion | None = None


ONE = Formula(1)


@dataclass(frozen=True, slots=True)
class BoundaryLaw:
    """A superpotential that acts on one displacement of a part.

    Attributes:
        direction: the displacement.
        law: the superpotential, SI.
        multiplier: what its tractions are multiplied by, positive.
        length_multiplier: what its lengths are multiplied by, positive: at c times the displacement it has the traction
            that it had.
        slip: β, what a slip is multiplied by where it is taken together with an opening.
        mixity: how the energy of separation depends on the mode; None: it does not.
        contradictions: what keeps formulas in the place of its numbers from being one law at points (n, 3), in words.
    """

    direction: Direction
    law: Superpotential
    multiplier: SpatialValue = ONE
    length_multiplier: SpatialValue = ONE
    slip: float = 1.0
    mixity: Mixity | None = None
    contradictions: Callable[[Array], list[str]] | None = None


@dataclass(frozen=True, slots=True)
class Averaged:
    """A volumetric energy ½ modulus Σ_i (∫ φ_i div u dx)² / ∫ φ_i dx over a region's vertices, nondimensional.

    Attributes:
        modulus: λ.
        shear: 2μ of the same material.
        divergence: UFL form of the scalar test function and the trial function.
        volume: UFL form of the scalar test function.
    """

    modulus: float
    shear: float
    divergence: Any
    volume: Any

    @property
    def ratio(self) -> float:
        """λ/μ."""
        return 2.0 * self.modulus / self.shear

    def softened(self, ratio: float) -> Averaged:
        """The same with λ/μ of no more than a ratio.

        Args:
            ratio: at most.
        """
        return replace(self, modulus=min(self.modulus, 0.5 * ratio * self.shear))


@dataclass(frozen=True, slots=True, kw_only=True)
class Contribution:
    """What one effect adds to the problem; forms are nondimensional UFL in the context's arguments.

    Attributes:
        bilinear: forms a(u, v).
        averaged: volumetric energies that are averaged by vertex.
        linear: forms <g, v>.
        strains: linear forms of ε(v): no rigid motion feels them.
        across: parts of ∫ σ_33 q dx in a plane body, over p0: forms of the scalar test function q and, where they need
            it, u.
        conditions: prescribed displacement components.
        bounds: of the normal displacement.
        laws: superpotentials of a slip, an opening or a penetration.
    """

    bilinear: tuple[Any, ...] = ()
    averaged: tuple[Averaged, ...] = ()
    linear: tuple[Any, ...] = ()
    strains: tuple[Any, ...] = ()
    across: tuple[Any, ...] = ()
    conditions: tuple[Condition, ...] = ()
    bounds: tuple[NormalBounds, ...] = ()
    laws: tuple[BoundaryLaw, ...] = ()
