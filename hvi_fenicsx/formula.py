"""Numbers at each point of space; formulas in x, y, z, parsed by Python's own ``ast`` through a whitelist.

A formula is checked once, when the scene is read: a tree is made anew of what is allowed alone. It is then evaluated in
whatever algebra is at hand (UFL for the forms, NumPy for values at vertices): see :data:`Algebra`.
"""

from __future__ import annotations

import ast
import math
import operator
import sys
import warnings
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from typing_extensions import override

from .class_registry import hint
from .errors import InputError
from .typing import Array

COORDINATES = ("x", "y", "z")
CONSTANTS = {"pi": math.pi}
Algebra = Mapping[str, Callable[..., Any]]
"""What a formula needs beyond Python's operators, by name: :data:`FUNCTIONS`, ``number``, which turns a literal into a
value of the algebra, and ``where(condition, if_true, if_false)``."""
_OF_ONE = ("abs", "sqrt", "exp", "log", "sin", "cos", "tan", "sinh", "cosh", "tanh")
_OF_TWO = ("min", "max")
FUNCTIONS = (*_OF_ONE, *_OF_TWO)
NUMPY: Algebra = {
    **{name: getattr(np, name) for name in (*_OF_ONE, "where")},
    "min": np.minimum,
    "max": np.maximum,
    "number": np.float64,
}
_OPERATORS = (ast.Add, ast.Sub, ast.Mult, ast.Div, ast.Pow)
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
        everywhere: whether it is known at all points; else it belongs to a mesh, and on others is known at its
            vertices only.
    """

    source: float | str
    everywhere = True

    @property
    def is_number(self) -> bool:
        """Whether it is a plain number."""
        return isinstance(self.source, float)

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

    def __init__(self, source: str, at: Callable[[Array], Array], *, everywhere: bool = True) -> None:
        self.source, self._at, self.everywhere = source, at, everywhere

    @override
    def at(self, points: Array) -> Array:
        return self._at(points)


def ufl_algebra(number: Callable[[float], Any]) -> Algebra:
    """UFL's operations; ``number`` wraps a literal (a ``fem.Constant``, so that no value is compiled in)."""
    import ufl

    alike = {name: getattr(ufl, name) for name in _OF_ONE if name not in ("abs", "log")}
    others = {"abs": abs, "log": ufl.ln, "min": ufl.min_value, "max": ufl.max_value, "where": ufl.conditional}
    return {**alike, **others, "number": number}


class Formula(SpatialValue):
    """A number or a checked formula in x, y, z (SI).

    Args:
        source: a finite number, or a formula such as ``"-1e6*(1 - 1.8*x)"``.

    Raises:
        InputError: not a finite number, not a formula, or a formula with anything but coordinates, numbers,
            ``pi``, the operators ``+ - * / **``, comparisons within ``a if c else b`` and :data:`FUNCTIONS`.
    """

    def __init__(self, source: float | int | str) -> None:
        if isinstance(source, bool) or not isinstance(source, int | float | str):
            raise InputError(f"must be a number or a formula in x, y, z in quotes, not {_shown(source)}")
        self.source = source if isinstance(source, str) else _finite(source)
        text = self.source.strip() if isinstance(self.source, str) else repr(self.source)
        self._tree = ast.fix_missing_locations(ast.Expression(_checked(parsed(text), text)))
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
        missing = dict.fromkeys(COORDINATES[len(x) :], algebra["number"](0.0))
        names = {"__builtins__": {}, **algebra, **dict(zip(COORDINATES, x, strict=False)), **missing}
        return eval(compile(self._tree, "formula", "eval"), names)

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


def parsed(text: str) -> ast.expr:
    """The tree of a text that is to be a formula, or formulas that are compared; nothing in it is checked.

    Args:
        text: without blanks around it.

    Raises:
        InputError: it is none.
    """
    if "#" in text:
        raise InputError(f"{text!r} has a comment in it; put it behind the formula's quotes")
    if len(text) > _LONGEST:
        raise InputError(f"the formula has {len(text)} characters; {_LONGEST} at most")
    try:
        with warnings.catch_warnings():  # Python's own about "1if x < 2 else 3" and the like
            warnings.simplefilter("ignore")
            return ast.parse(text, mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        raise InputError(f"{text!r} is not a formula: {getattr(error, 'msg', error)}") from None


def _source(node: ast.expr, text: str) -> str:
    """The part of the formula that a node was read from."""
    # Not ast.unparse: it recurses, and fails on the deep nesting that is to be refused.
    part = ast.get_source_segment(text, node) or text
    return repr(part if len(part) <= _LONGEST_SHOWN else part[:_LONGEST_SHOWN] + "...")


def _checked(node: ast.expr, text: str, depth: int = 0) -> ast.expr:
    """A formula made of what is allowed alone, anew: a number is ``number(...)``, a choice ``where(...)``."""
    if depth > _DEEPEST:
        raise InputError(f"the formula is nested more than {_DEEPEST} deep")

    def inner(*nodes: ast.expr) -> list[ast.expr]:
        return [_checked(one, text, depth + 1) for one in nodes]

    match node:
        case ast.Constant(value=bool()) | ast.Constant(value=complex()):
            raise InputError(f"{_source(node, text)} in {text!r} is not a real number")
        case ast.Constant(value=int() | float() as value):
            if not abs(value) <= sys.float_info.max:
                raise InputError(f"a number in {text!r} is not finite")
            return _call("number", [ast.Constant(float(value))])
        case ast.Name(id=name) if name in CONSTANTS:
            return _call("number", [ast.Constant(CONSTANTS[name])])
        case ast.Name(id=name) if name in COORDINATES:
            return node
        case ast.Name(id=name):
            call = f"; {name} is a function: write {name}(...)" if name in FUNCTIONS else ""
            raise InputError(f"{name!r} in {text!r} is not known; a formula may use x, y, z and pi{call}")
        case ast.BinOp(left=left, op=op, right=right) if isinstance(op, _OPERATORS):
            one, other = inner(left, right)
            return ast.BinOp(one, op, _exponent(right, other, text) if isinstance(op, ast.Pow) else other)
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return ast.UnaryOp(ast.USub(), *inner(operand))
        case ast.UnaryOp(op=ast.UAdd(), operand=operand):
            return inner(operand)[0]
        case ast.Call(func=ast.Name(id=name), args=args, keywords=[]):
            _check_call(name, len(args), text)
            return _call(name, inner(*args))
        case ast.IfExp(test=ast.Compare(left=a, ops=[op], comparators=[b]), body=yes, orelse=no) if (
            type(op) in COMPARISONS
        ):
            one, other, *choices = inner(a, b, yes, no)
            return _call("where", [ast.Compare(one, [op], [other]), *choices])
    raise InputError(
        f"{_source(node, text)} in {text!r} is not allowed; a formula has numbers, x, y, z, pi, "
        f"+ - * / **, 'a if x < 1 else b' and {', '.join(FUNCTIONS)}"
    )


def _call(name: str, arguments: list[ast.expr]) -> ast.expr:
    return ast.Call(ast.Name(name, ast.Load()), arguments, [])


def _check_call(name: str, count: int, text: str) -> None:
    if name not in FUNCTIONS:
        known = f"is not known{hint(name, FUNCTIONS)}; allowed: {', '.join(FUNCTIONS)}"
        raise InputError(f"function {name!r} in {text!r} {known}")
    wanted = 2 if name in _OF_TWO else 1
    if count != wanted:
        raise InputError(f"{name} in {text!r} takes {wanted} {'argument' if wanted == 1 else 'arguments'}, not {count}")


def _exponent(given: ast.expr, checked: ast.expr, text: str) -> ast.expr:
    """A whole number stays one: UFL then multiplies, and a negative base is allowed."""
    number = given
    while isinstance(number, ast.UnaryOp):  # x**-2
        number = number.operand
    if not isinstance(number, ast.Constant):
        return checked
    if isinstance(number.value, int | float) and abs(number.value) > _LARGEST_POWER:
        raise InputError(f"the power {_source(number, text)} in {text!r} is too large; {_LARGEST_POWER} at most")
    return given if number is given and isinstance(number.value, int) else checked
