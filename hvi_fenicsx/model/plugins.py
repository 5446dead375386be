"""``plugins = "my_laws.py"``: a scene's own laws, effects, methods and shapes, loaded before its tables are read."""

from __future__ import annotations

import contextlib
import importlib.util
import os
import sys
import traceback
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ..errors import HviError, InputError
from ..runtime import log
from ..schema import refusal, shown

_LOG = log.logger("model")
_PREFIX = "hvi_plugin_"


class PluginError(InputError):
    """A plugin's method failed, perhaps on one rank only."""

    everywhere = False


def load(names: Any, folder: str | os.PathLike[str]) -> tuple[str, ...]:
    """Load Python files, each once in a process; a file is announced before its code is run.

    Args:
        names: one file or a list of them, relative to the folder.
        folder: that of the scene file.

    Returns:
        Their absolute paths.

    Raises:
        PydanticCustomError: a file that is not there, no Python file, or raises an error of its own.
    """
    files = [names] if isinstance(names, str) else names
    if not isinstance(files, list | tuple) or not all(isinstance(n, str) and n.endswith(".py") for n in files):
        raise refusal(f'must name Python files, like "my_laws.py" (is {shown(names)})')
    return tuple(_load(name, Path(folder)) for name in files)


def _load(name: str, folder: Path) -> str:
    path = Path(os.path.abspath(folder / name))
    if not path.is_file():
        raise refusal(f"{path} does not exist; it is looked for beside the scene file")
    module = f"{_PREFIX}{path.stem}"
    known = sys.modules.get(module)
    if known is None:
        _execute(module, path)
    elif known.__file__ != str(path):
        raise refusal(f"{path}: another file of this name is loaded already, {known.__file__}; rename one of them")
    return str(path)


def _execute(module: str, path: Path) -> None:
    spec = importlib.util.spec_from_file_location(module, path)
    assert spec is not None
    assert spec.loader is not None
    plugin = importlib.util.module_from_spec(spec)
    sys.modules[module] = plugin  # dataclasses and pydantic look their own module up
    _LOG.warning("plugin %s: its code is run", path)
    try:
        with contextlib.chdir(os.curdir):  # a plugin may leave it; results belong where the user asked for them
            spec.loader.exec_module(plugin)
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        del sys.modules[module]
        lines = [error.lineno] if isinstance(error, SyntaxError) else []
        lines += [line for file, line, _ in _frames(error) if file == str(path)]
        raise refusal(f"{path}{''.join(f':{line}' for line in lines[-1:])}: {_words(error)}") from None


@contextlib.contextmanager
def named() -> Iterator[None]:
    """An error that arises in a plugin's method, perhaps on one rank only, is told with its file, line and name."""
    try:
        yield
    except (HviError, KeyboardInterrupt):
        raise
    except BaseException as error:
        loaded = {module.__file__ for name, module in sys.modules.items() if name.startswith(_PREFIX)}
        found = [f"{file}:{line}: {name}" for file, line, name in _frames(error) if file in loaded]
        if not found:
            raise
        raise PluginError(f"{found[-1]} raises {_words(error)}") from error


def _frames(error: BaseException) -> list[tuple[str, int, str]]:
    """File, line and function of all that an error passed through."""
    frames = traceback.walk_tb(error.__traceback__)
    return [(frame.f_code.co_filename, line, frame.f_code.co_qualname) for frame, line in frames]


def _words(error: BaseException) -> str:
    """The kind of an error and what it says, if it can: a plugin's own kind may fail at that too."""
    with contextlib.suppress(Exception):
        return f"{type(error).__name__}: {error}"
    return type(error).__name__
