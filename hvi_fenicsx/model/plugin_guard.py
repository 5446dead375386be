"""Guards around a plugin's methods: what they raise, or return in a wrong form, is told with their file and name."""

from __future__ import annotations

import functools
import types
import typing
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import HviError, InputError

Function = Callable[..., Any]


class PluginError(InputError):
    """A plugin's method failed, perhaps on one rank only."""

    everywhere = False


def guard(plugin: types.ModuleType, path: Path) -> None:
    """Guard all methods and properties of a plugin's classes.

    Args:
        plugin: the module, executed.
        path: its file.
    """
    classes = [c for c in vars(plugin).values() if isinstance(c, type) and c.__module__ == plugin.__name__]
    for cls in classes:
        for name, attribute in list(vars(cls).items()):
            if not name.startswith("__") and (guarded := _guarded_attribute(cls, name, attribute, path)) is not None:
                setattr(cls, name, guarded)


def line_of(error: BaseException, path: Path) -> str:
    """The last line of a file that an error passed through, as ``:12``; nothing where it did not.

    Args:
        error: with its traceback.
        path: the file.
    """
    lines = [error.lineno] if isinstance(error, SyntaxError) else []
    trace = error.__traceback__
    while trace is not None:
        if trace.tb_frame.f_code.co_filename == str(path):
            lines.append(trace.tb_lineno)
        trace = trace.tb_next
    return f":{lines[-1]}" if lines else ""


def words_of(error: BaseException) -> str:
    """The kind of an error and what it says, if it can: a plugin's own kind may fail at that too.

    Args:
        error: of any kind.
    """
    try:
        return f"{type(error).__name__}: {error}"
    except Exception:
        return type(error).__name__


def _guarded_attribute(cls: type, name: str, attribute: Any, path: Path) -> Any:
    """The method or property with its guard; None for what is neither."""
    expected = _expected(cls, name)
    if isinstance(attribute, types.FunctionType):
        return _guarded(attribute, expected, path)
    if isinstance(attribute, property) and attribute.fget is not None:
        return property(_guarded(attribute.fget, expected, path), attribute.fset, attribute.fdel, attribute.__doc__)
    if isinstance(attribute, functools.cached_property):
        cached = functools.cached_property(_guarded(attribute.func, expected, path))
        cached.__set_name__(cls, name)
        return cached
    return None


def _expected(cls: type, name: str) -> Any:
    """What the base class says that it returns; ``Any`` where it says nothing."""
    for base in cls.__mro__[1:]:
        attribute = vars(base).get(name)
        function = getattr(attribute, "fget", None) or getattr(attribute, "func", None) or attribute
        if isinstance(function, types.FunctionType):
            try:
                return typing.get_type_hints(function).get("return", Any)
            except NameError:  # a name that only type checkers import
                return Any
    return Any


def _guarded(function: Function, expected: Any, path: Path) -> Function:
    @functools.wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        try:
            result = function(*args, **kwargs)
        except (HviError, KeyboardInterrupt):
            raise
        except BaseException as error:
            place = f"{path}{line_of(error, path)}: {function.__qualname__}"
            raise PluginError(f"{place} raises {words_of(error)}") from error
        if not _fits(expected, result, args):
            place = f"{path}:{function.__code__.co_firstlineno}: {function.__qualname__}"
            raise PluginError(f"{place} returns {_shown(result)}; it must return {_named(expected)}")
        return result

    return call


def _fits(expected: Any, value: Any, args: Sequence[Any]) -> bool:
    """Whether a value has the form that a type asks for; of types that are not known here, whether it is not None."""
    origin, inner = typing.get_origin(expected), typing.get_args(expected)
    if expected is Any or expected is type(None):
        return expected is Any or value is None
    if origin in (types.UnionType, typing.Union):
        return any(_fits(one, value, args) for one in inner)
    if origin is np.ndarray:
        return _is_array(value, args)
    if origin is tuple and Ellipsis not in inner:
        whole = isinstance(value, tuple) and len(value) == len(inner)
        return whole and all(_fits(one, part, args) for one, part in zip(inner, value, strict=True))
    if expected in (float, int, bool):
        return np.ndim(value) == 0 and np.asarray(value).dtype.kind in "fiub"
    kind = (Sequence, np.ndarray) if origin is Sequence else origin or expected
    return isinstance(value, kind) if isinstance(kind, type | tuple) else value is not None


def _is_array(value: Any, args: Sequence[Any]) -> bool:
    """Whether these are numbers, one for each entry of the array that was given, or one for all."""
    try:
        shape = np.asarray(value, dtype=float).shape
    except (TypeError, ValueError):
        return False
    wanted = next((np.shape(a) for a in args if isinstance(a, np.ndarray)), shape)
    return value is not None and shape in ((), wanted)


def _shown(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return f"an array of shape {value.shape} and type {value.dtype}"
    return "None" if value is None else f"{type(value).__name__} {value!r:.60}"


def _named(expected: Any) -> str:
    if typing.get_origin(expected) is np.ndarray:
        return "numbers, one for each that it is given"
    if isinstance(expected, type) and not typing.get_args(expected):
        return expected.__name__
    return str(expected).replace("collections.abc.", "")
