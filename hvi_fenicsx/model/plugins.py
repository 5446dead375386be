"""``plugins = "my_laws.py"``: a scene's own laws, effects, methods and shapes, loaded before its tables are read."""

from __future__ import annotations

import contextlib
import importlib.util
import os
import sys
from pathlib import Path
from typing import Any

from pydantic_core import PydanticCustomError

from ..runtime import log
from ..schema import refusal, shown
from . import plugin_guard

_LOG = log.logger("model")


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
    names = [names] if isinstance(names, str) else names
    if not isinstance(names, list | tuple):
        raise _named_wrongly(names)
    return tuple(_load(name, Path(folder)) for name in names)


def _load(name: Any, folder: Path) -> str:
    if not isinstance(name, str) or not name.endswith(".py"):
        raise _named_wrongly(name)
    path = Path(os.path.abspath(folder / name))
    if not path.is_file():
        raise refusal(f"{path} does not exist; it is looked for beside the scene file")
    module = f"hvi_plugin_{path.stem}"
    known = sys.modules.get(module)
    if known is None:
        _execute(module, path)
    elif known.__file__ != str(path):
        raise refusal(f"{path}: another file of this name is loaded already, {known.__file__}; rename one of them")
    return str(path)


def _execute(module: str, path: Path) -> None:
    spec = importlib.util.spec_from_file_location(module, path)
    if spec is None or spec.loader is None:
        raise refusal(f"{path} cannot be loaded")
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
        raise refusal(f"{path}{plugin_guard.line_of(error, path)}: {plugin_guard.words_of(error)}") from None
    plugin_guard.guard(plugin, path)


def _named_wrongly(value: Any) -> PydanticCustomError:
    return refusal(f'must name Python files, like "my_laws.py" (is {shown(value)})')
