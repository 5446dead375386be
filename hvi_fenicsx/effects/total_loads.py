"""Loads that a user states for a whole part: its pressure, the force on it, the moment about its centroid."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from pydantic import SerializerFunctionWrapHandler, model_serializer
from typing_extensions import override

from ..errors import InputError
from ..schema import refusal
from ..typing import Array
from .base import Drive, Evaluate, FormContext, Place, SideMoments, Sizes, SurfaceLoad, part_of
from .contribution import Contribution
from .plain_values import Listed, OneValue


class Pressure(OneValue):
    """A pressure p (N/m²) against the boundary: a number or a formula; negative: suction."""

    key: ClassVar[str] = "pressure"
    place: ClassVar[Place] = Place.BOUNDARY
    drive: ClassVar[Drive] = Drive.LOAD
    term: ClassVar[str] = "<g, v> += -∫ p v·n ds"

    @override
    def contribute(self, context: FormContext, where: str | None) -> Contribution:
        """The linear form over its part."""
        import ufl

        pressure = context.render(self.value) / context.number(context.stress)
        work = -pressure * ufl.inner(context.normal, context.test)
        return Contribution(linear=(work * context.facets(part_of(where, self.key), self.value),))

    @override
    def surface_load(self) -> SurfaceLoad:
        """The pressure."""
        return SurfaceLoad(pressure=self.value)

    @override
    def stress_scale(self, largest: Evaluate, sizes: Sizes) -> float:
        """The largest pressure."""
        return largest(self.value)


class _Total(Listed):
    """A load that is stated as a sum over its part; one of a single number is written without brackets."""

    place: ClassVar[Place] = Place.BOUNDARY
    drive: ClassVar[Drive] = Drive.LOAD
    is_sum: ClassVar[bool] = True

    values: tuple[float, ...]

    @override
    @classmethod
    def _entries(cls, data: Any) -> tuple[Any, ...]:
        numbers = tuple(data) if isinstance(data, list | tuple) else (data,)
        if not all(isinstance(n, int | float) and not isinstance(n, bool) for n in numbers):
            raise refusal("is the sum over the part: numbers only; for a load that varies use traction")
        return tuple(map(float, numbers))

    @model_serializer(mode="wrap")
    def _as_numbers(self, handler: SerializerFunctionWrapHandler) -> Any:
        found = list(handler(self)["values"])
        return found[0] if len(found) == 1 else found


class TotalForce(_Total):
    """A force (N; N/m in 2D) on a part, one number for each component, spread evenly over it."""

    key: ClassVar[str] = "force"
    label: ClassVar[str] = "a force on the whole part"
    term: ClassVar[str] = "<g, v> += ∫ F/|part| · v ds"

    @override
    def contribute(self, context: FormContext, where: str | None) -> Contribution:
        """The linear form over its part."""
        import ufl

        part = part_of(where, self.key)
        scale = context.side_moments(part).area * context.stress
        mean = ufl.as_vector([context.number(force / scale) for force in self.values])
        return Contribution(linear=(ufl.inner(mean, context.test) * context.facets(part),))

    @override
    def spread_at(self, moments: SideMoments, points: Array) -> Array:
        """The force over the area."""
        return np.tile(np.array(self.values) / moments.area, (len(points), 1))

    @override
    def stress_scale(self, largest: Evaluate, sizes: Sizes) -> float:
        """The largest component over the body's length, squared in 3D."""
        return max(map(abs, self.values)) / sizes.length ** (len(self.values) - 1)


class Moment(_Total):
    """A moment (N m; N in 2D) on a part about its centroid: one number in 2D, three in 3D.

    The traction A x r grows linearly with the distance r from the centroid, as in a bent or twisted beam; its sum is
    zero.
    """

    key: ClassVar[str] = "moment"
    label: ClassVar[str] = "a moment on the whole part"
    term: ClassVar[str] = "<g, v> += ∫ (A x r)·v ds, the moment of A x r being M"

    @override
    def check(self, dimension: int) -> None:
        """One component in 2D, three in 3D."""
        if len(self.values) != (1 if dimension == 2 else 3):
            wanted = "one number (about z)" if dimension == 2 else "three numbers"
            raise InputError(f"moment has {len(self.values)} components; in {dimension}D it is {wanted}")

    @override
    def contribute(self, context: FormContext, where: str | None) -> Contribution:
        """The linear form over its part.

        Raises:
            InputError: no traction of this kind has the moment: the part has no extent across it.
        """
        import ufl

        part = part_of(where, self.key)
        moments = context.side_moments(part)
        rate, met = _rotation(moments.second, self.values)
        if not met:
            text = "the part has no extent across the moment's axis; take a wider part"
            raise InputError(f"boundary.{part}.moment: {text}")
        x = ufl.SpatialCoordinate(context.test.ufl_function_space().mesh)
        r = [x[i] - context.number(c) for i, c in enumerate(moments.centroid)]
        a = [context.number(c / context.stress) for c in rate]
        if context.dimension == 2:
            traction = ufl.as_vector([-a[2] * r[1], a[2] * r[0]])
        else:
            traction = ufl.cross(ufl.as_vector(a), ufl.as_vector(r))
        return Contribution(linear=(ufl.inner(traction, context.test) * context.facets(part),))

    @override
    def spread_at(self, moments: SideMoments, points: Array) -> Array:
        """A x r."""
        d = len(moments.centroid)
        r = np.pad(points[:, :d] - moments.centroid, ((0, 0), (0, 3 - d)))
        return np.asarray(np.cross(_rotation(moments.second, self.values)[0], r)[:, :d], dtype=np.float64)

    @override
    def stress_scale(self, largest: Evaluate, sizes: Sizes) -> float:
        """The largest component over the body's length squared, cubed in 3D."""
        return max(map(abs, self.values)) / sizes.length ** (2 if len(self.values) == 1 else 3)


def _rotation(second: Array, moment: tuple[float, ...]) -> tuple[Array, bool]:
    """A (3,) with ∫ r x (A x r) ds = M, from the second moments ∫ r rᵀ ds, (d, d), and whether there is one.

    A plane part turns about z.
    """
    wide = np.pad(second, (0, 3 - len(second)))
    inertia = np.trace(wide) * np.eye(3) - wide
    wanted = np.array([0.0, 0.0, *moment] if len(moment) == 1 else moment)
    rate = np.asarray(np.linalg.pinv(inertia, rcond=1e-12, hermitian=True) @ wanted)
    return rate, bool(np.allclose(inertia @ rate, wanted, rtol=0.0, atol=1e-9 * np.max(np.abs(wanted))))
