"""Loads, gaps and prescribed values as Python programs give them: numbers, formulas, functions, UFL, fem.Functions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from dolfinx import mesh as dmesh
from scipy.spatial import cKDTree
from typing_extensions import override

from .. import compat
from ..errors import InputError
from ..formula import Formula, SpatialValue
from ..mesh import nodes
from ..typing import Array


class PythonFunction(SpatialValue):
    """A Python function of space, as dolfinx interpolates it: x of shape (3, n) in m, values of shape (n,).

    In forms it is its interpolation by quadratic functions.

    Args:
        function: the function.
    """

    __slots__ = ("_function", "source")

    def __init__(self, function: Callable[[Array], Any]) -> None:
        self._function = function
        self.source = f"Python function {getattr(function, '__name__', type(function).__name__)}"

    @override
    def at(self, points: Array) -> Array:
        values = np.asarray(self._function(np.ascontiguousarray(points.T)))
        if values.dtype.kind not in "iuf":
            raise InputError(f"{self.source}: returns {values.dtype} values; return real numbers")
        if values.shape not in ((), (len(points),)):
            raise InputError(f"{self.source}: returns an array {values.shape} at {len(points)} points; return (n,)")
        return np.broadcast_to(values, (len(points),)).astype(np.float64)

    @override
    def in_ufl(self, mesh: Any, number: Callable[[float], Any]) -> Any:
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

    __slots__ = ("_expression", "_mesh", "source")

    def __init__(self, expression: Any, mesh: dmesh.Mesh) -> None:
        self._expression, self._mesh = expression, mesh
        self.source = f"UFL expression {_shortened(str(expression))}"

    @property
    @override
    def everywhere(self) -> bool:
        return False

    @override
    def at(self, points: Array) -> Array:
        space = fem.functionspace(self._mesh, ("Lagrange", 2))
        sampled = fem.Function(space)
        sampled.interpolate(compat.expression(self._expression, space))
        known = nodes.points(space)
        if not len(known):
            return np.zeros(len(points))
        return np.asarray(sampled.x.array[cKDTree(known).query(points)[1]], dtype=np.float64)

    @override
    def in_ufl(self, mesh: Any, number: Callable[[float], Any]) -> Any:
        if mesh is self._mesh:
            return self._expression
        if compat.same_topology(mesh, self._mesh):
            return self._on_same_cells(mesh)
        found = fem.Function(fem.functionspace(mesh, ("Lagrange", 1)))
        found.interpolate(lambda x: self.at(x.T))
        return found

    def _on_same_cells(self, mesh: dmesh.Mesh) -> fem.Function:
        """The expression at the nodes of a mesh of the same cells, straight or curved: their numbers are the same."""
        own, other = (fem.functionspace(one, ("Lagrange", 2)) for one in (self._mesh, mesh))
        d = mesh.geometry.dim
        position = fem.Function(fem.functionspace(self._mesh, ("Lagrange", 2, (d,))))
        position.x.array[:] = nodes.points(other)[:, :d].ravel()
        moved = ufl.replace(self._expression, {ufl.SpatialCoordinate(self._mesh): position})
        sampled, found = fem.Function(own), fem.Function(other)
        sampled.interpolate(compat.expression(moved, own))
        found.x.array[:] = sampled.x.array
        return found


def spatial_value(given: Any, mesh: dmesh.Mesh) -> Any:
    """A value in space that only Python has, or a number; what is neither as it is, for the effect to read.

    Args:
        given: a number, a formula in x, y, z, a Python function, a scalar UFL expression or a scalar fem.Function.
        mesh: the body's mesh.

    Raises:
        InputError: a UFL expression is no scalar, or of another mesh.
    """
    if isinstance(given, ufl.core.expr.Expr):
        return _expression(given, mesh)
    return PythonFunction(given) if callable(given) else number(given)


def components(given: Any, mesh: dmesh.Mesh) -> list[Any]:
    """The components of a vector, each as :func:`spatial_value` has it.

    Args:
        given: a list with an entry for each component, or the whole vector as a Python function with values (d, n), a
            UFL expression or a fem.Function.
        mesh: the body's mesh.

    Raises:
        InputError: it is none of these.
    """
    d = mesh.geometry.dim
    if isinstance(given, ufl.core.expr.Expr):
        if given.ufl_shape != (d,):
            raise InputError(f"a vector has {d} components in {d}D; the UFL expression has the shape {given.ufl_shape}")
        return [_expression(given[i], mesh) for i in range(d)]
    if callable(given):
        return [PythonFunction(_component(given, i, d)) for i in range(d)]
    if not isinstance(given, Sequence | np.ndarray) or isinstance(given, str | bytes) or not np.iterable(given):
        raise InputError(f"a vector is a list with {d} entries, a function or a UFL expression, not {given!r}")
    return [spatial_value(value, mesh) for value in given]


def numbers(given: Any, each: Callable[[Any], Any] | None = None) -> Any:
    """A list of numbers of any kind, as a tuple of Python's; what is no list as it is, for the effect to refuse.

    Args:
        given: what the user gave.
        each: what reads an entry; None: :func:`number`.
    """
    if isinstance(given, str | bytes) or not np.iterable(given):
        return given
    return tuple(map(each or number, given))


def number(given: Any) -> Any:
    """A number of any kind, such as NumPy's, as Python's; what is none as it is, for the effect to refuse.

    The effect knows the field, and finds all that is wrong at once. A boolean is no number; pydantic would take NumPy's
    for one.

    Args:
        given: what the user gave.
    """
    if getattr(given, "dtype", None) == np.bool_:
        return plain(given)
    try:
        return given if isinstance(given, str | bytes | bool) else float(given)
    except (TypeError, ValueError, OverflowError):
        return given


def plain(given: Any) -> Any:
    """NumPy's number or array as Python's number or list, its kind kept; lists of such too; all else as it is.

    Args:
        given: what the user gave.
    """
    if isinstance(given, np.generic | np.ndarray):
        return given.tolist()
    return [plain(one) for one in given] if isinstance(given, list | tuple) else given


def _component(function: Callable[[Array], Any], i: int, count: int) -> Callable[[Array], Any]:
    """One of ``count`` components of a function of space."""
    name = getattr(function, "__name__", type(function).__name__)

    def component(x: Array) -> Any:
        values = function(x)
        if not isinstance(values, Sequence | np.ndarray) or len(values) != count:
            wanted = f"return {count} components, ({count}, n)"
            raise InputError(f"Python function {name}: returns {_kind(values)}; {wanted}")
        return values[i]

    component.__name__ = f"{name}[{i}]"
    return component


def _kind(values: Any) -> str:
    return f"an array {np.shape(values)}" if isinstance(values, np.ndarray) else f"{values!r}"


def _expression(given: Any, mesh: dmesh.Mesh) -> SpatialValue:
    if given.ufl_shape != ():
        raise InputError(f"a scalar is wanted; the UFL expression has the shape {given.ufl_shape}")
    domains = ufl.domain.extract_domains(given)
    if not domains:
        return Formula(float(given(())))  # a number needs no mesh
    own = [_mesh_of(domain, mesh) for domain in domains]
    if any(one is not own[0] for one in own) or not compat.same_topology(own[0], mesh):
        raise InputError("a UFL expression or fem.Function is of another mesh than the body; make it on body.mesh")
    return Expression(given, own[0])


def _mesh_of(domain: ufl.Mesh, mesh: dmesh.Mesh) -> dmesh.Mesh:
    """The mesh of UFL's domain: the body's, or the one that the user made the body of."""
    cargo = domain.ufl_cargo()
    return mesh if cargo is mesh._cpp_object else dmesh.Mesh(cargo, domain)


def _shortened(text: str) -> str:
    return text if len(text) <= 40 else text[:37] + "..."
