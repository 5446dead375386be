"""What an effect adds to a problem: forms, conditions, bounds and laws, as data."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Any

from ..laws import Superpotential
from ..spatial_value import SpatialValue


class Direction(Enum):
    """The scalar displacement that a law of Γc acts on."""

    SLIP = "slip"
    """u_t; in 3D |u_t|."""
    OPENING = "opening"
    """-u·n, n outward: positive when the body lifts off."""
    PENETRATION = "penetration"
    """u·n: positive when the body is pressed into its support."""


@dataclass(frozen=True, slots=True)
class Condition:
    """A prescribed displacement component on a part.

    Attributes:
        component: its number, from 0.
        value: m.
    """

    component: int
    value: SpatialValue


@dataclass(frozen=True, slots=True)
class NormalBounds:
    """lower ≤ -u·n ≤ upper on a part. Unilateral contact with the gap g has lower = -g.

    Attributes:
        lower: m; None: no bound.
        upper: m; None: no bound.
        direction: the unit vector towards a flat obstacle, which stands for n; None: the part's own normal.
        measured: whether the distance of the two sides of an interface, as they are meshed, is added to the gap.
    """

    lower: SpatialValue | None
    upper: SpatialValue | None
    direction: tuple[float, ...] | None = None
    measured: bool = False


@dataclass(frozen=True, slots=True)
class BoundaryLaw:
    """A superpotential that acts on one scalar displacement of a part.

    Attributes:
        direction: the displacement.
        law: the superpotential, SI.
    """

    direction: Direction
    law: Superpotential


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

    def __post_init__(self) -> None:
        """Refuse entries of a wrong kind: what is done with them would fail far from the effect that made them.

        Raises:
            TypeError: with the entry's name.
        """
        import ufl  # reading a scene needs none of it

        forms = dict.fromkeys((*_ARGUMENTS, "across"), ufl.Form)
        for name, kind in {**_KINDS, **forms}.items():
            for entry in getattr(self, name):
                if not isinstance(entry, kind):
                    raise TypeError(f"Contribution.{name} holds a {type(entry).__name__}, not a {kind.__name__}")
        for name, arguments in _ARGUMENTS.items():
            for form in getattr(self, name):
                if len(form.arguments()) != arguments:
                    raise TypeError(f"Contribution.{name} holds a form of {len(form.arguments())} arguments")


_KINDS: dict[str, type] = {
    "averaged": Averaged,
    "conditions": Condition,
    "bounds": NormalBounds,
    "laws": BoundaryLaw,
}
_ARGUMENTS = {"bilinear": 2, "linear": 1, "strains": 1}
"""How many of test and trial function the forms have."""
