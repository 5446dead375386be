"""What effects are given by: values in space, one by one or as a list, and effects that are nothing else."""

from __future__ import annotations

import sys
import textwrap
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Annotated, Any, Self

import numpy as np
from pydantic import BeforeValidator, PlainSerializer, SerializerFunctionWrapHandler, model_serializer, model_validator

from ..errors import InputError, of_user
from ..formula import Formula, SpatialValue
from ..schema import refusal
from ..typing import Array
from .base import Effect, Sides, from_python

if TYPE_CHECKING:
    from dolfinx import fem
    from dolfinx import mesh as dmesh

Value = Any
"""A number, a formula in x, y, z, a Python function of x (3, n), a scalar UFL expression or fem.Function; SI."""
Vector = Any
"""A list of values, one for each component; or a Python function with values (d, n), a UFL vector, a fem.Function."""


_OTHER_MESH = "a UFL expression or fem.Function is of another mesh than the body; make it on body.mesh"


class PythonFunction(SpatialValue):
    """A Python function of space, as dolfinx interpolates it: x of shape (3, n) in m, values of shape (n,).

    In forms it is its interpolation by quadratic functions.

    Args:
        function: the function.
    """

    def __init__(self, function: Callable[[Array], Any]) -> None:
        self._function = function
        self.source = f"Python function {getattr(function, '__name__', type(function).__name__)}"

    def at(self, points: Array) -> Array:
        """What it returns, checked."""
        with of_user(self.source):
            values = np.asarray(self._function(np.ascontiguousarray(points.T)))
        if values.dtype.kind not in "iuf" or values.shape not in ((), (len(points),)):
            text = f"returns {values.dtype} values {values.shape} at {len(points)} points; return real numbers, (n,)"
            raise InputError(f"{self.source}: {text}")
        return np.broadcast_to(values, (len(points),)).astype(np.float64)

    def in_ufl(self, mesh: Any, number: Callable[[float], Any]) -> Any:
        """Its interpolation."""
        from dolfinx import fem

        found = fem.Function(fem.functionspace(mesh, ("Lagrange", 2)))
        found.interpolate(lambda x: self.at(x.T))
        return found


class Expression(SpatialValue):
    """A scalar UFL expression, or fem.Function, on the body's own mesh or one of the same cells, straight or curved.

    On the mesh itself it stands in forms as it is, on one of the same cells as it is at their nodes. At vertices,
    and on coarser meshes, which only give start values, it is sampled at the nearest vertex.

    Args:
        expression: in SI.
        mesh: its own.
    """

    everywhere = False

    def __init__(self, expression: Any, mesh: dmesh.Mesh) -> None:
        self._expression, self._mesh = expression, mesh
        self.source = f"UFL expression {textwrap.shorten(str(expression), 40, placeholder='...')}"

    def check_mesh(self, mesh: dmesh.Mesh) -> None:
        """Refuse another mesh than a body's.

        Args:
            mesh: of the body.

        Raises:
            InputError: it has other cells.
        """
        from .. import compat

        if not compat.same_topology(self._mesh, mesh):
            raise InputError(_OTHER_MESH)

    def at(self, points: Array) -> Array:
        """Sampled at the nearest node."""
        from dolfinx import fem
        from scipy.spatial import cKDTree

        from .. import compat

        space = fem.functionspace(self._mesh, ("Lagrange", 2))
        sampled = fem.Function(space)
        with of_user(self.source):
            sampled.interpolate(compat.expression(self._expression, space))
        known = space.tabulate_dof_coordinates()
        if not len(known):
            return np.zeros(len(points))
        return sampled.x.array[cKDTree(known).query(points)[1]]

    def in_ufl(self, mesh: Any, number: Callable[[float], Any]) -> Any:
        """Itself, or what it is at the nodes of another mesh."""
        from dolfinx import fem

        from .. import compat

        if mesh._cpp_object is self._mesh._cpp_object:
            return self._expression
        if compat.same_topology(mesh, self._mesh):
            return self._on_same_cells(mesh)
        found = fem.Function(fem.functionspace(mesh, ("Lagrange", 1)))
        found.interpolate(lambda x: self.at(x.T))
        return found

    def _on_same_cells(self, mesh: dmesh.Mesh) -> fem.Function:
        """The expression at the nodes of a mesh of the same cells, straight or curved: their numbers are the same."""
        import ufl
        from dolfinx import fem

        from .. import compat

        own, other = (fem.functionspace(one, ("Lagrange", 2)) for one in (self._mesh, mesh))
        d = mesh.geometry.dim
        position = fem.Function(fem.functionspace(self._mesh, ("Lagrange", 2, (d,))))
        position.x.array[:] = other.tabulate_dof_coordinates()[:, :d].ravel()
        moved = ufl.replace(self._expression, {ufl.SpatialCoordinate(self._mesh): position})
        sampled, found = fem.Function(own), fem.Function(other)
        sampled.interpolate(compat.expression(moved, own))
        found.x.array[:] = sampled.x.array
        return found


class VectorFunction(PythonFunction):
    """A Python function of space with all components, (d, n)."""

    def components(self, count: int) -> tuple[PythonFunction, ...]:
        """Each of ``count`` components."""
        return tuple(PythonFunction(self._component(i, count)) for i in range(count))

    def _component(self, i: int, count: int) -> Callable[[Array], Any]:
        def component(x: Array) -> Any:
            values = self._function(x)
            if not isinstance(values, Sequence | np.ndarray) or len(values) != count:
                raise InputError(f"{self.source}: must return {count} components, ({count}, n)")
            return values[i]

        component.__name__ = f"{str(self.source).removeprefix('Python function ')}[{i}]"
        return component


def expression(given: Any) -> SpatialValue:
    """A scalar UFL expression as a value in space.

    Args:
        given: the expression, or a fem.Function.

    Raises:
        InputError: it is no scalar, or of several meshes.
    """
    import ufl
    from dolfinx import mesh as dmesh
    from ufl.algorithms.analysis import extract_type

    if extract_type(given, ufl.classes.Restricted):
        raise InputError("jump, avg and restrictions are of two cells; give what is known in each cell")
    if given.ufl_shape != ():
        raise InputError(f"a scalar is wanted; the UFL expression has the shape {given.ufl_shape}")
    domains = ufl.domain.extract_domains(given)
    if not domains:
        return Formula(float(given(())))  # a number needs no mesh
    own = [dmesh.Mesh(domain.ufl_cargo(), domain) for domain in domains]
    if any(one._cpp_object is not own[0]._cpp_object for one in own):
        raise InputError(_OTHER_MESH)
    return Expression(given, own[0])


def components(given: Any) -> tuple[SpatialValue, ...]:
    """The components of a whole vector.

    Args:
        given: a Python function with values (d, n), whose components are known by their number only; a UFL expression
            or a fem.Function.
    """
    import ufl

    if not isinstance(given, ufl.core.expr.Expr):
        return (VectorFunction(given),)
    if len(given.ufl_shape) != 1:
        raise refusal(
            f"a vector has a component for each dimension; the UFL expression has the shape {given.ufl_shape}"
        )
    return tuple(expression(given[i]) for i in range(given.ufl_shape[0]))


def as_value(given: Any) -> SpatialValue:
    """A value in space, for a validator.

    Args:
        given: a number, a formula's text, a value already, or from Python a function or UFL.

    Raises:
        PydanticCustomError: it is none of these.
    """
    try:
        if isinstance(given, SpatialValue):
            return given
        if _is_ufl(given):
            return expression(given)
        return PythonFunction(given) if callable(given) else Formula(given)
    except InputError as error:
        raise refusal(str(error)) from None


def _is_ufl(given: Any) -> bool:
    ufl = sys.modules.get("ufl")  # a scene is read without it
    return ufl is not None and isinstance(given, ufl.core.expr.Expr)


FormulaField = Annotated[SpatialValue, BeforeValidator(as_value), PlainSerializer(lambda f: f.source)]
"""A number or a formula in x, y, z (SI), as a field of an effect."""


def require_components(formulas: tuple[Any, ...], dimension: int, key: str) -> None:
    """Refuse a vector of the wrong length.

    Args:
        formulas: its components.
        dimension: how many there must be.
        key: its name in the message.

    Raises:
        InputError: with the number of components wanted.
    """
    if len(formulas) != dimension:
        raise InputError(f"{key} has {len(formulas)} components; in {dimension}D it has {dimension}")


class Bare(Effect):
    """An effect of one field, which a scene writes without its name: ``pressure = 1e5``, ``traction = [1e6, 0]``."""

    @model_validator(mode="before")
    @classmethod
    def _from_bare(cls, data: Any) -> Any:
        (name,) = cls.model_fields
        if isinstance(data, cls):
            return data
        return {name: cls._read(data[name] if isinstance(data, dict) and name in data else data)}

    @classmethod
    def _read(cls, data: Any) -> Any:
        return data

    @model_serializer(mode="wrap")
    def _as_bare(self, handler: SerializerFunctionWrapHandler) -> Any:
        (found,) = handler(self).values()
        return found


class OneValue(Bare):
    """An effect that is one number or formula: ``pressure = 1e5``."""

    value: FormulaField

    @from_python
    def __init__(self, side: Sides, value: Value) -> None:
        self._make(side, value=value)


class Listed(Bare):
    """An effect that is a list, one entry for each component: ``traction = [1e6, 0]``."""

    values: tuple[Any, ...]

    @from_python
    def __init__(self, side: Sides, values: Vector) -> None:
        self._make(side, values=values)

    @classmethod
    def _read(cls, data: Any) -> Any:
        if isinstance(data, list | tuple):
            return tuple(data)
        if callable(data) or _is_ufl(data):
            return components(data)
        raise refusal("must be a list, one entry for each component, like [1e6, 0.0]")

    def fitted(self, dimension: int) -> Self:
        """With the components of a function that gives them all."""
        given = self.values[0] if len(self.values) == 1 else None
        parts = getattr(given, "components", None)
        return self if parts is None else self.model_copy(update={"values": parts(dimension)})

    def check(self, dimension: int) -> None:
        """As many components as the scene has dimensions."""
        require_components(self.values, dimension, self.key)
