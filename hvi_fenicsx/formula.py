"""Numbers at each point of space; formulas in x, y, z, parsed by Python's own ``ast`` through a whitelist, not run.

A formula is checked once, when the scene is read, and then rendered into whatever algebra is at hand
(UFL for the forms, NumPy for values at vertices): see :class:`Algebra`.
"""

from __future__ import annotations

import ast
import math
import operator
import sys
import warnings
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
from typing_extensions import override

from .class_registry import closest
from .errors import InputError
from .typing import Array

COORDINATES = ("x", "y", "z")
CONSTANTS = {"pi": math.pi}
_NUMPY: Mapping[str, Callable[..., Any]] = {
    "abs": np.abs,
    "sqrt": np.sqrt,
    "exp": np.exp,
    "log": np.log,
    "sin": np.sin,
    "cos": np.cos,
    "tan": np.tan,
    "sinh": np.sinh,
    "cosh": np.cosh,
    "tanh": np.tanh,
    "min": np.minimum,
    "max": np.maximum,
}
FUNCTIONS = tuple(_NUMPY)
_TWO_ARGUMENTS = ("min", "max")
_BINARY: Mapping[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}
COMPARISONS: Mapping[type[ast.cmpop], Callable[[Any, Any], Any]] = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
}
_LONGEST, _DEEPEST, _LARGEST_POWER = 2000, 50, 64
_LONGEST_SHOWN = 60


class SpatialValue(ABC):
    """A number at each point of space.

    Attributes:
        source: what stands for it in files: a number, a formula, or a few words.
    """

    __slots__ = ()
    source: float | str

    @property
    def is_number(self) -> bool:
        """Whether it is a plain number."""
        return isinstance(self.source, float)

    @property
    def everywhere(self) -> bool:
        """Whether it is known at all points; else it belongs to a mesh, and on others is known at its vertices only."""
        return True

    def check_mesh(self, mesh: Any) -> None:  # noqa: B027
        """Refuse a mesh that it does not belong to.

        Raises:
            InputError: it has data of another mesh.
        """

    @abstractmethod
    def at(self, points: Array) -> Array:
        """Values at points of shape (n, 3), m; shape (n,). Not checked for finiteness."""

    def in_ufl(self, mesh: Any, number: Callable[[float], Any]) -> Any:
        """The value in UFL, where forms are made of it.

        Args:
            mesh: the dolfinx mesh on which a form is made, m.
            number: wraps a number, so that its value is not compiled into the form.
        """
        raise NotImplementedError(f"{self.source}: no form is made of it")

    def negative(self) -> SpatialValue:
        """The value with the other sign."""
        return Computed(f"-({self.source})", lambda points: -self.at(points), everywhere=self.everywhere)

    def positive_part(self) -> SpatialValue:
        """The value where it is positive, else 0."""
        text = f"max(0, {self.source})"
        return Computed(text, lambda points: np.maximum(self.at(points), 0.0), everywhere=self.everywhere)


class Computed(SpatialValue):
    """A value that is computed at each point; no form is made of it.

    Args:
        source: what it is, in a few words.
        at: its values at points.
        everywhere: whether it is known at all points.
    """

    __slots__ = ("_at", "_everywhere", "source")

    def __init__(self, source: str, at: Callable[[Array], Array], *, everywhere: bool = True) -> None:
        self.source, self._at, self._everywhere = source, at, everywhere

    @property
    @override
    def everywhere(self) -> bool:
        return self._everywhere

    @override
    def at(self, points: Array) -> Array:
        return self._at(points)


class Algebra(NamedTuple):
    """The operations a formula needs beyond Python's operators.

    Attributes:
        number: turns a literal into a value of the algebra.
        functions: by name, those of :data:`FUNCTIONS`.
        where: ``where(condition, if_true, if_false)``.
    """

    number: Callable[[float], Any]
    functions: Mapping[str, Callable[..., Any]]
    where: Callable[[Any, Any, Any], Any]


NUMPY = Algebra(np.float64, _NUMPY, np.where)


def ufl_algebra(number: Callable[[float], Any]) -> Algebra:
    """UFL's operations; ``number`` wraps a literal (a ``fem.Constant``, so that no value is compiled in)."""
    import ufl

    others = {"abs": abs, "log": ufl.ln, "min": ufl.min_value, "max": ufl.max_value}
    return Algebra(number, {name: others.get(name) or getattr(ufl, name) for name in FUNCTIONS}, ufl.conditional)


class Formula(SpatialValue):
    """A number or a checked formula in x, y, z (SI).

    Args:
        source: a finite number, or a formula such as ``"-1e6*(1 - 1.8*x)"``.

    Raises:
        InputError: not a finite number, not a formula, or a formula with anything but coordinates, numbers,
            ``pi``, the operators ``+ - * / **``, comparisons within ``a if c else b`` and :data:`FUNCTIONS`.
    """

    __slots__ = ("_tree", "source")

    def __init__(self, source: float | int | str) -> None:
        if isinstance(source, bool) or not isinstance(source, int | float | str):
            raise InputError(f"must be a number or a formula in x, y, z in quotes, not {_shown(source)}")
        self.source = source if isinstance(source, str) else _finite(source)
        self._tree = _parse(self.source if isinstance(self.source, str) else repr(self.source))
        if not any(isinstance(node, ast.Name) and node.id in COORDINATES for node in ast.walk(self._tree)):
            self._check_constant()

    def _check_constant(self) -> None:
        """Without coordinates the value is known now: ``1/0`` need not wait for the mesh."""
        with np.errstate(all="ignore"):
            value = self.render((), NUMPY)
        if not np.isfinite(value):
            raise InputError(f"{self.source!r} is {value}, not a finite number; give a finite one")

    def __repr__(self) -> str:
        return f"Formula({self.source!r})"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Formula) and other.source == self.source

    def __hash__(self) -> int:
        return hash(self.source)

    def render(self, x: Any, algebra: Algebra) -> Any:
        """The formula in another algebra.

        Args:
            x: the coordinates, by number; missing ones count as 0.
            algebra: its operations.
        """
        return _render(self._tree, x, algebra)

    @override
    def in_ufl(self, mesh: Any, number: Callable[[float], Any]) -> Any:
        """The formula in the coordinates of the mesh."""
        import ufl

        return self.render(ufl.SpatialCoordinate(mesh), ufl_algebra(number))

    @override
    def negative(self) -> Formula:
        """The formula, or the number, with the other sign."""
        return Formula(f"-({self.source})" if isinstance(self.source, str) else -self.source)

    @override
    def at(self, points: Array) -> Array:
        """Values at points of shape (n, 3), m; shape (n,). Not checked for finiteness."""
        with np.errstate(all="ignore"):
            value = self.render(points.T, NUMPY)
        return np.broadcast_to(np.asarray(value, dtype=np.float64), (points.shape[0],)).copy()


def _shown(value: object) -> str:
    return {True: "true", False: "false"}[value] if isinstance(value, bool) else f"a {type(value).__name__}"


def _finite(value: float | int) -> float:
    if not abs(value) <= sys.float_info.max:
        raise InputError(f"must be a finite number (is {value if isinstance(value, float) else math.inf})")
    return float(value)


def _parse(text: str) -> ast.expr:
    text = text.strip()
    if "#" in text:
        raise InputError(f"{text!r} has a comment in it; put it behind the formula's quotes")
    if len(text) > _LONGEST:
        raise InputError(f"the formula has {len(text)} characters; {_LONGEST} at most")
    try:
        with warnings.catch_warnings():  # Python's own about "1if x < 2 else 3" and the like
            warnings.simplefilter("ignore")
            tree = ast.parse(text, mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        raise InputError(f"{text!r} is not a formula: {getattr(error, 'msg', error)}") from None
    _check(tree, text, 0)
    return tree


def _source(node: ast.expr, text: str) -> str:
    """The part of the formula that a node was read from."""
    # Not ast.unparse: it recurses, and fails on the deep nesting that is to be refused.
    part = ast.get_source_segment(text, node) or text
    return repr(part if len(part) <= _LONGEST_SHOWN else part[:_LONGEST_SHOWN] + "...")


def _check(node: ast.expr, text: str, depth: int) -> None:
    if depth > _DEEPEST:
        raise InputError(f"the formula is nested more than {_DEEPEST} deep")
    match node:
        case ast.Constant(value=bool()) | ast.Constant(value=complex()):
            raise InputError(f"{_source(node, text)} in {text!r} is not a real number")
        case ast.Constant(value=int() | float() as value):
            if not abs(value) <= sys.float_info.max:
                raise InputError(f"a number in {text!r} is not finite")
            return
        case ast.Name(id=name):
            _check_name(name, text)
            return
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _BINARY:
            _check_power(op, right, text)
            children = [left, right]
        case ast.UnaryOp(op=ast.USub() | ast.UAdd(), operand=operand):
            children = [operand]
        case ast.Call(func=ast.Name(id=name), args=args, keywords=[]):
            _check_call(name, len(args), text)
            children = args
        case ast.IfExp(test=ast.Compare(left=a, ops=[op], comparators=[b]), body=yes, orelse=no) if (
            type(op) in COMPARISONS
        ):
            children = [a, b, yes, no]
        case _:
            raise InputError(
                f"{_source(node, text)} in {text!r} is not allowed; a formula has numbers, x, y, z, pi, "
                f"+ - * / **, 'a if x < 1 else b' and {', '.join(FUNCTIONS)}"
            )
    for child in children:
        _check(child, text, depth + 1)


def _check_name(name: str, text: str) -> None:
    if name in COORDINATES or name in CONSTANTS:
        return
    hint = "" if name not in FUNCTIONS else f"; {name} is a function: write {name}(...)"
    raise InputError(f"{name!r} in {text!r} is not known; a formula may use x, y, z and pi{hint}")


def _check_call(name: str, count: int, text: str) -> None:
    if name not in FUNCTIONS:
        close = closest(name, FUNCTIONS)
        hint = f"did you mean {close}? " if close else ""
        raise InputError(f"function {name!r} in {text!r} is not known; {hint}allowed: {', '.join(FUNCTIONS)}")
    wanted = 2 if name in _TWO_ARGUMENTS else 1
    if count != wanted:
        raise InputError(f"{name} in {text!r} takes {wanted} {'argument' if wanted == 1 else 'arguments'}, not {count}")


def _check_power(op: ast.operator, exponent: ast.expr, text: str) -> None:
    while isinstance(exponent, ast.UnaryOp):  # x**-2
        exponent = exponent.operand
    if not isinstance(op, ast.Pow) or not isinstance(exponent, ast.Constant):
        return
    if isinstance(exponent.value, int | float) and abs(exponent.value) > _LARGEST_POWER:
        power = _source(exponent, text)
        raise InputError(f"the power {power} in {text!r} is too large; {_LARGEST_POWER} at most")


def _render(node: ast.expr, x: Any, algebra: Algebra) -> Any:
    match node:
        case ast.Constant(value=value):
            return algebra.number(float(value))
        case ast.Name(id=name):
            return algebra.number(CONSTANTS[name]) if name in CONSTANTS else _coordinate(name, x, algebra)
        case ast.BinOp(left=left, op=ast.Pow(), right=ast.Constant(value=int() as power)):
            # An integer power stays one: UFL then multiplies, and a negative base is allowed.
            return _render(left, x, algebra) ** power
        case ast.BinOp(left=left, op=op, right=right):
            return _BINARY[type(op)](_render(left, x, algebra), _render(right, x, algebra))
        case ast.UnaryOp(op=op, operand=operand):
            value = _render(operand, x, algebra)
            return -value if isinstance(op, ast.USub) else value
        case ast.Call(func=ast.Name(id=name), args=args):
            return algebra.functions[name](*(_render(a, x, algebra) for a in args))
        case ast.IfExp(test=ast.Compare(left=a, ops=[op], comparators=[b]), body=yes, orelse=no):
            condition = COMPARISONS[type(op)](_render(a, x, algebra), _render(b, x, algebra))
            return algebra.where(condition, _render(yes, x, algebra), _render(no, x, algebra))
    raise AssertionError(f"unchecked node {ast.dump(node)}")  # _check has refused everything else


def _coordinate(name: str, x: Any, algebra: Algebra) -> Any:
    index = COORDINATES.index(name)
    return x[index] if index < len(x) else algebra.number(0.0)
