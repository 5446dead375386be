"""What an effect is: one physical contribution, validated data with what it adds to a problem.

A new effect is a new subclass of :class:`Effect` in a module of its own; it registers itself under
its ``key``, which is then a key of the scene file at its ``place``. Nothing else is edited.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Annotated, Any, ClassVar, Protocol

from pydantic import BaseModel, BeforeValidator, ConfigDict, PlainSerializer
from pydantic_core import PydanticCustomError

from ..errors import InputError
from ..formula import Formula
from ..laws import Superpotential


class Place(Enum):
    """Where in a scene an effect stands."""

    BOUNDARY = "boundary"
    BODY = "body"
    MATERIAL = "material"


class Drive(Enum):
    """How an effect drives the body; the scales come from the first kind that is there."""

    LOAD = "load"
    KINEMATIC = "prescribed displacement or strain"
    RESISTANCE = "none: it only resists"


def _formula(value: Any) -> Formula:
    try:
        return value if isinstance(value, Formula) else Formula(value)
    except InputError as error:
        raise refusal(str(error)) from None


FormulaField = Annotated[
    Formula,
    BeforeValidator(_formula),
    PlainSerializer(lambda f: f.source),
]
"""A number or a formula in x, y, z (SI), as a field of a scene model."""


def refusal(text: str) -> PydanticCustomError:
    """A refusal for a validator to raise; the scene reports it with its place."""
    # Through the context, since braces in the text itself would be taken for places to fill.
    return PydanticCustomError("effect", "{reason}", {"reason": text})


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
    """A prescribed displacement component (SI) on a part."""

    component: int
    value: Formula


@dataclass(frozen=True, slots=True)
class NormalBounds:
    """lower ≤ -u·n ≤ upper on a part (SI; None: no bound). Unilateral contact with gap g has lower = -g.

    ``direction`` stands for n where it is given: the unit vector towards a flat obstacle.
    """

    lower: Formula | None
    upper: Formula | None
    direction: tuple[float, ...] | None = None


@dataclass(frozen=True, slots=True)
class BoundaryLaw:
    """A superpotential (SI) acting on one scalar displacement of a part."""

    direction: Direction
    law: Superpotential


@dataclass(frozen=True, slots=True)
class Averaged:
    """A volumetric energy ½ modulus Σ_i (∫ φ_i div u dx)² / ∫ φ_i dx over a region's vertices, nondimensional.

    Attributes:
        modulus: λ. shear: 2μ of the same material.
        divergence: UFL form of the scalar test function and the trial function. volume: of the scalar test function.
    """

    modulus: float
    shear: float
    divergence: Any
    volume: Any


@dataclass(frozen=True, slots=True)
class Contribution:
    """What one effect adds to the problem; forms are nondimensional UFL in the context's arguments."""

    bilinear: tuple[Any, ...] = ()
    averaged: tuple[Averaged, ...] = ()
    linear: tuple[Any, ...] = ()
    strains: tuple[Any, ...] = ()
    """Linear forms of ε(v): no rigid motion feels them."""
    across: tuple[Any, ...] = ()
    """Parts of ∫ σ_33 q dx in a plane body, over p0: forms of the scalar test function q and, where they need it, u."""
    conditions: tuple[Condition, ...] = ()
    bounds: tuple[NormalBounds, ...] = ()
    laws: tuple[BoundaryLaw, ...] = ()


class FormContext(Protocol):
    """What an effect may see of the problem that is being composed."""

    dimension: int
    trial: Any
    test: Any
    normal: Any

    @property
    def scalar_test(self) -> Any:
        """A test function of scalar P1."""

    @property
    def length(self) -> float:
        """Length scale L in m."""

    @property
    def stress(self) -> float:
        """Stress scale p0 in N/m²."""

    @property
    def modulus(self) -> float:
        """Young's modulus scale E0 in N/m²."""

    def number(self, value: float) -> Any:
        """A ``fem.Constant``, so that the value is not compiled into the form."""

    def render(self, formula: Formula) -> Any:
        """A formula in UFL, in the SI coordinates of the mesh."""

    @property
    def materials(self) -> Sequence[tuple[str | None, Effect]]:
        """The elasticities, each with its region (None: the whole body)."""

    def cells(self, *regions: str | None) -> Any:
        """The measure dx/L^d of what regions share (None: the whole body); None where that is nothing."""

    def facets(self, part: str) -> Any:
        """The measure ds/L^(d-1) of a boundary part."""


@dataclass(frozen=True, slots=True)
class Sizes:
    """What an effect's scale may depend on.

    Attributes:
        length: of the body, m. modulus: the largest Young's modulus, N/m². expansion: the largest |α|, 1/K.
    """

    length: float
    modulus: float
    expansion: float


Evaluate = Callable[[Formula], float]
"""Largest absolute value of a formula over the place of an effect."""


class Effect(BaseModel):
    """One physical contribution: validated data (SI) and what it adds.

    Class attributes:
        key: the scene file's key. place: where the key stands. term: what it adds, in words and symbols.
        drive: how it drives the body. exclusive: whether a side of the body bears only one of its kind.
    """

    model_config = ConfigDict(
        extra="forbid", frozen=True, strict=True, arbitrary_types_allowed=True, use_attribute_docstrings=True
    )

    key: ClassVar[str]
    place: ClassVar[Place]
    term: ClassVar[str]
    drive: ClassVar[Drive] = Drive.RESISTANCE
    exclusive: ClassVar[bool] = False
    registry: ClassVar[dict[Place, dict[str, type[Effect]]]] = {place: {} for place in Place}

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        super().__pydantic_init_subclass__(**kwargs)
        if "key" in cls.__dict__:
            known = Effect.registry[cls.place].setdefault(cls.key, cls)
            if known is not cls and known.__qualname__ != cls.__qualname__:
                raise TypeError(f"two effects are called {cls.key!r}: {known} and {cls}")

    @abstractmethod
    def contribute(self, context: FormContext, where: str | None) -> Contribution:
        """What it adds on ``where`` (a boundary part, a region, or None for the whole body)."""

    def stress_scale(self, largest: Evaluate, sizes: Sizes) -> float:
        """The largest stress (N/m²) it brings."""
        return 0.0

    def modulus_scale(self) -> float:
        """The largest Young's modulus (N/m²) it brings."""
        return 0.0

    def expansion_scale(self) -> float:
        """The largest |α| (1/K) it brings."""
        return 0.0

    def dimension(self) -> int | None:
        """The dimension of space that it is made for; None: any."""
        return None

    def check(self, dimension: int) -> None:
        """Refuse what makes no sense in 2D or 3D.

        Raises:
            InputError: with the reason and the mend.
        """


def components(formulas: tuple[Any, ...], dimension: int, key: str) -> None:
    """Refuse a vector of the wrong length.

    Raises:
        InputError: with the number of components wanted.
    """
    if len(formulas) != dimension:
        raise InputError(f"{key} has {len(formulas)} components; a {dimension}D scene wants {dimension}")
