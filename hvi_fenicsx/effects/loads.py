"""What drives the body: loads, by area, by volume or as sums over a part; prescribed displacements; heat."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Sequence
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, PlainSerializer, SerializerFunctionWrapHandler, model_serializer
from pydantic_core import PydanticCustomError

from ..errors import InputError
from ..formula import SpatialValue
from ..geometry import in_space
from ..schema import Finite, refusal
from ..typing import Array, magnitude
from .base import BodySizes, Drive, Effect, Evaluate, FormContext, Place, SideMoments, Sides, SurfaceLoad, from_python
from .contribution import Condition, Contribution
from .elasticity import Elasticity, strain, voigt
from .values import FormulaField, Listed, OneValue, Value, Vector, as_value


class Load(Effect):
    """What acts on a boundary part by a traction; a subclass gives it."""

    place = Place.BOUNDARY
    drive = Drive.LOAD

    @abstractmethod
    def traction(self, context: FormContext, part: str) -> Any:
        """The traction in UFL, nondimensional.

        Args:
            context: what it may see of the problem.
            part: where it acts.
        """

    def contribute(self, context: FormContext, where: str | None) -> Contribution:
        """The linear form over its part."""
        import ufl  # here and below: a scene is read without it

        part = where or ""
        work = ufl.inner(self.traction(context, part), context.test)
        return Contribution(linear=(work * context.facets(part, *self.spatial_values()),))


class Traction(Load, Listed):
    """A surface traction t (N/m²): a list of formulas, one for each component."""

    key = "traction"
    term = "<g, v> += ∫ t·v ds"

    values: tuple[FormulaField, ...]

    def traction(self, context: FormContext, part: str) -> Any:
        """By its components."""
        import ufl

        return ufl.as_vector([context.render(f) for f in self.values]) / context.number(context.stress)

    def surface_load(self) -> SurfaceLoad:
        """Its components."""
        return SurfaceLoad(self.values)

    def stress_scale(self, largest: Evaluate, sizes: BodySizes) -> float:
        """The largest component."""
        return max(largest(f) for f in self.values)


class BodyForce(Listed):
    """A force per volume f (N/m³): a list of formulas, one for each component."""

    key = "force"
    label = "a force on the body itself"
    place = Place.BODY
    drive = Drive.LOAD
    term = "<g, v> += ∫ f·v dx"

    values: tuple[FormulaField, ...]

    @from_python
    def __init__(self, values: Vector, region: Sides | None = None) -> None:
        self._make(region, values=values)

    def contribute(self, context: FormContext, where: str | None) -> Contribution:
        """The linear form over its region."""
        import ufl

        factor = context.number(context.length / context.stress)
        vector = factor * ufl.as_vector([context.render(f) for f in self.values])
        return Contribution(linear=(ufl.inner(vector, context.test) * context.cells(where),))

    def stress_scale(self, largest: Evaluate, sizes: BodySizes) -> float:
        """The largest component times the body's length."""
        return max(largest(f) for f in self.values) * sizes.length


def _component(value: Any) -> Any:
    if value is None or (isinstance(value, str) and value == "free"):
        return "free"
    try:
        return as_value(value)
    except PydanticCustomError as error:
        raise refusal(f'{error.message()}; or write "free" (None from Python) to leave the component alone') from None


Component = Annotated[
    Any,
    BeforeValidator(_component),
    PlainSerializer(lambda value: value.source if isinstance(value, SpatialValue) else value),
]
"""A formula or "free"."""


class Displacement(Listed):
    """A prescribed displacement (m): a list of formulas, one for each component. ``"free"`` prescribes nothing."""

    key = "displacement"
    place = Place.BOUNDARY
    drive = Drive.KINEMATIC
    term = "u_i = value, by component"

    values: tuple[Component, ...]

    def contribute(self, context: FormContext, where: str | None) -> Contribution:
        """The conditions of its components that are not free."""
        return Contribution(conditions=tuple(Condition(i, self.values[i]) for i in self.prescribed()))

    def prescribed(self) -> tuple[int, ...]:
        """Indices of the components that are not free."""
        return tuple(i for i, f in enumerate(self.values) if f != "free")

    def stress_scale(self, largest: Evaluate, sizes: BodySizes) -> float:
        """The stress of the largest component, as a strain over the body's length."""
        return max((largest(f) for f in self.values if f != "free"), default=0.0) * sizes.modulus / sizes.length


class Pressure(Load, OneValue):
    """A pressure p (N/m²) against the boundary: a number or a formula; negative: suction."""

    key = "pressure"
    term = "<g, v> += -∫ p v·n ds"

    def traction(self, context: FormContext, part: str) -> Any:
        """Against the normal."""
        return -context.render(self.value) / context.number(context.stress) * context.normal

    def surface_load(self) -> SurfaceLoad:
        """The pressure."""
        return SurfaceLoad(pressure=self.value)

    def stress_scale(self, largest: Evaluate, sizes: BodySizes) -> float:
        """The largest pressure."""
        return largest(self.value)


class _Total(Load, Listed):
    """A load that is stated as a sum over its part; one of a single number is written without brackets."""

    is_sum = True

    values: tuple[Finite, ...]

    @classmethod
    def _read(cls, data: Any) -> Any:
        numbers = data if isinstance(data, list | tuple) else (data,)
        if not all(isinstance(n, int | float) and not isinstance(n, bool) for n in numbers):
            raise refusal("is the sum over the part: numbers only; for a load that varies use traction")
        return tuple(map(float, numbers))

    @model_serializer(mode="wrap")
    def _as_bare(self, handler: SerializerFunctionWrapHandler) -> Any:
        found = handler(self)["values"]
        return found[0] if len(found) == 1 else found


class Force(_Total):
    """A force (N; N/m in 2D) on a part, one number for each component, spread evenly over it."""

    key = "force"
    label = "a force on the whole part"
    term = "<g, v> += ∫ F/|part| · v ds"

    def traction(self, context: FormContext, part: str) -> Any:
        """The force over the area."""
        import ufl

        scale = context.side_moments(part).area * context.stress
        return ufl.as_vector([context.number(force / scale) for force in self.values])

    def spread_at(self, moments: SideMoments, points: Array) -> Array:
        """The force over the area."""
        return np.tile(np.array(self.values) / moments.area, (len(points), 1))

    def stress_scale(self, largest: Evaluate, sizes: BodySizes) -> float:
        """The largest component over the body's length, squared in 3D."""
        return max(map(abs, self.values)) / sizes.length ** (len(self.values) - 1)


class Moment(_Total):
    """A moment (N m; N in 2D) on a part about its centroid: one number in 2D, three in 3D.

    The traction A x r grows linearly with the distance r from the centroid, as in a bent or twisted beam; its sum is
    zero.
    """

    key = "moment"
    label = "a moment on the whole part"
    term = "<g, v> += ∫ (A x r)·v ds, the moment of A x r being M"

    @from_python
    def __init__(self, side: Sides, value: float | Sequence[float]) -> None:
        self._make(side, values=value)

    def check(self, dimension: int) -> None:
        """One component in 2D, three in 3D."""
        if len(self.values) != (1 if dimension == 2 else 3):
            wanted = "one number (about z)" if dimension == 2 else "three numbers"
            raise InputError(f"moment has {len(self.values)} components; in {dimension}D it is {wanted}")

    def traction(self, context: FormContext, part: str) -> Any:
        """A x r.

        Raises:
            InputError: no traction of this kind has the moment: the part has no extent across it.
        """
        import ufl

        moments = context.side_moments(part)
        rate, met = _rotation(moments.second, self.values)
        if not met:
            text = "the part has no extent across the moment's axis; take a wider part"
            raise InputError(f"boundary.{part}.moment: {text}")
        x = ufl.SpatialCoordinate(context.test.ufl_function_space().mesh)
        r = [x[i] - context.number(float(c)) for i, c in enumerate(moments.centroid)]
        a = [context.number(c / context.stress) for c in rate]
        if context.dimension == 2:
            return ufl.as_vector([-a[2] * r[1], a[2] * r[0]])
        return ufl.cross(ufl.as_vector(a), ufl.as_vector(r))

    def spread_at(self, moments: SideMoments, points: Array) -> Array:
        """A x r."""
        d = len(moments.centroid)
        r = in_space(points[:, :d] - moments.centroid)
        return np.cross(_rotation(moments.second, self.values)[0], r)[:, :d]

    def stress_scale(self, largest: Evaluate, sizes: BodySizes) -> float:
        """The largest component over the body's length squared, cubed in 3D."""
        return max(map(abs, self.values)) / sizes.length ** (2 if len(self.values) == 1 else 3)


def _rotation(second: Array, moment: tuple[float, ...]) -> tuple[Array, bool]:
    """A (3,) with ∫ r x (A x r) ds = M, from the second moments ∫ r rᵀ ds, (d, d), and whether there is one.

    A plane part turns about z.
    """
    wide = np.pad(second, (0, 3 - len(second)))
    inertia = np.trace(wide) * np.eye(3) - wide
    wanted = np.array([0.0, 0.0, *moment] if len(moment) == 1 else moment)
    rate = np.linalg.pinv(inertia, rcond=1e-12, hermitian=True) @ wanted
    return rate, bool(np.allclose(inertia @ rate, wanted, rtol=0.0, atol=1e-9 * magnitude(wanted)))


class Temperature(OneValue):
    """The temperature above that of the stress-free state (K): a number or a formula.

    Strains α ΔT by the material's `thermal_expansion`; the stress is C : (ε(u) - α ΔT I).
    """

    key = "temperature"
    label = "a change of temperature"
    place = Place.BODY
    drive = Drive.KINEMATIC
    term = "<g, v> += ∫ C:(α ΔT I):ε(v) dx"

    @from_python
    def __init__(self, value: Value, region: Sides | None = None) -> None:
        self._make(region, value=value)

    def contribute(self, context: FormContext, where: str | None) -> Contribution:
        """The linear forms over the materials of its region."""
        pairs = [(m, cells) for m, cells in _heated(context, where) if m.thermal_expansion]
        if not pairs:
            place = f" of {where}" if where else ""
            raise InputError(f"body.temperature does nothing: give the material{place} thermal_expansion = α (1/K)")
        loads = tuple(self._load(context, m) * cells for m, cells in pairs)
        return Contribution(strains=loads, across=tuple(self._across(context, pairs)))

    def _across(self, context: FormContext, heated: list[tuple[Elasticity, Any]]) -> Iterator[Any]:
        """What holds the thickness of a plane body back from expanding."""
        for material, cells in heated:
            if held := float(material.out_of_plane()[2]):
                yield -context.number(held / context.stress) * context.render(self.value) * context.scalar_test * cells

    def _load(self, context: FormContext, material: Elasticity) -> Any:
        """(C : αI) : ε(v) ΔT, nondimensional."""
        virtual = context.number(context.length) * strain(context.test)
        pairs = zip(material.thermal_stress() / context.stress, voigt(virtual, context.dimension), strict=True)
        return context.render(self.value) * sum(context.number(float(s)) * e for s, e in pairs if s)

    def stress_scale(self, largest: Evaluate, sizes: BodySizes) -> float:
        """E α ΔT."""
        return sizes.modulus * sizes.expansion * largest(self.value)


def _heated(context: FormContext, where: str | None) -> list[tuple[Elasticity, Any]]:
    """The materials in a region, with the measures of where they overlap it."""
    found = ((m, context.cells(where, region)) for region, m in context.materials)
    return [(m, cells) for m, cells in found if isinstance(m, Elasticity) and cells is not None]
