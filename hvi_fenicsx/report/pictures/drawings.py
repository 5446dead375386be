"""What there is to draw of a result: its pictures, each with its file."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from matplotlib.figure import Figure

from ..reader import Result
from . import kinds  # noqa: F401 (registers them)
from .registry import PICTURES, Picture


@dataclass(frozen=True)
class Drawing:
    """A picture of one result.

    Attributes:
        path: where it goes.
        caption: what a reader sees under it.
        rendered: whether VTK draws for it.
        make: draws it.
    """

    path: Path
    caption: str
    rendered: bool
    make: Callable[[], Figure]


def drawings(result: Result) -> Iterator[Drawing]:
    """What there is to draw of a result."""
    for kind in PICTURES:
        if kind.dimension == result.body.dimension and kind.wanted(result):
            yield from _of_parts(kind, result) if kind.of_part else [_drawing(kind, result)]


def _drawing(kind: Picture, result: Result) -> Drawing:
    return Drawing(result.folder / f"{kind.name}.png", kind.caption, kind.rendered, partial(kind.make, result))


def _of_parts(kind: Picture, result: Result) -> Iterator[Drawing]:
    for part in result.parts:
        alone = len(result.parts) == 1
        path = result.folder / f"{kind.name if alone else f'{kind.name}_{part.name}'}.png"
        caption = kind.caption.replace("{part}", "the contact part" if alone else f"“{part.name}”")
        yield Drawing(path, caption, kind.rendered, partial(kind.make, result, part))
