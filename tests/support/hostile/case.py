"""One hostile input: what is started where, and the scenes that all kinds begin with."""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import tomli_w
from scenes import Table, model, quadratic_linear

SCENE, OUT = "scene.toml", "out"
RUN = ("run", SCENE, "--out", OUT, "--no-pictures")
CHECK = ("check", SCENE)


@dataclass(frozen=True, kw_only=True)
class Case:
    """What is started in a folder of its own.

    Attributes:
        what: in words.
        words: arguments of the program.
        alone: whether it needs a process of its own.
        environment: variables that are changed, by name; None removes one.
        shell: how the shell starts the program, ``"$@"``.
        end_after: seconds after which the process is told to end.
        places: whether a refusal must name a file, an option or a part of the scene.
        ours: beginnings of the names of files that the program wrote and may remove.
    """

    what: str
    words: Sequence[str] = RUN
    alone: bool = False
    environment: Mapping[str, str | None] = field(default_factory=dict)
    shell: str = '"$@"'
    end_after: float | None = None
    places: bool = False
    ours: tuple[str, ...] = ()

    def told(self, done: str) -> Case:
        """The same, with what was done to its files."""
        return replace(self, what=f"{done}: {self.what}")


Kind = Callable[[random.Random, Path], Case]
"""Writes a case into an empty folder."""


def table() -> Table:
    """A small sound scene."""
    return model(2, friction=quadratic_linear(1e3))


def write(folder: Path, content: Table | str | None = None) -> None:
    """Write a scene file; the sound one if nothing else is given."""
    found = table() if content is None else content
    text = found if isinstance(found, str) else tomli_w.dumps(found)
    (folder / SCENE).write_bytes(text.encode("utf-8", "surrogateescape"))
