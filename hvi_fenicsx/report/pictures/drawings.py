"""What there is to draw of a finished folder: its pictures, each with its file. A new one is a row of `PICTURES`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from matplotlib.figure import Figure

from .. import reader
from ..errors import PictureError
from ..reader import Result
from . import bodies, contact, equilibria
from . import path as path_picture


@dataclass(frozen=True)
class Drawing:
    """A picture of one result.

    Attributes:
        path: where it goes.
        caption: what a reader sees under it.
        make: draws it.
        rendered: whether VTK may draw for it.
    """

    path: Path
    caption: str
    make: Callable[[], Figure]
    rendered: bool = False


Kind = tuple[str, str, Callable[[Result], bool], Callable[[Result], Figure]]
PICTURES: list[Kind] = [
    (
        "body",
        "The deformed body, its displacements magnified, with what acts on it.",
        lambda result: result.body.displacement is not None,
        bodies.body,
    ),
    (
        "escape",
        "The rigid motion along which the load carries the body away.",
        lambda result: result.body.escape_mode is not None,
        bodies.escape,
    ),
    (
        "scene",
        "The scene: the undeformed body with its supports, loads and contact parts.",
        lambda result: bool(result.sides),
        bodies.scene,
    ),
    (
        "stress",
        "Stress in the body (von Mises), constant in each cell; the scale may end below a peak in a corner.",
        lambda result: result.body.von_mises is not None,
        bodies.stress,
    ),
]
"""The pictures of a body: name of the file, caption, whether a result has what is drawn, and what draws it."""


def drawings_of(folder: Path) -> list[Drawing]:
    """What there is to draw of a finished folder, of whatever kind it is.

    Raises:
        ResultError: the folder is damaged.
        PictureError: there is nothing to draw.
    """
    if (folder / "equilibria.csv").exists():
        search = reader.read_equilibria(folder)
        return [Drawing(folder / equilibria.NAME, equilibria.CAPTION, partial(equilibria.make, search))]
    if (folder / "path.csv").exists():
        path = reader.read_path(folder)
        drawn = path.driven is not None
        return [Drawing(folder / path_picture.NAME, path_picture.CAPTION, partial(path_picture.make, path))] * drawn
    result = reader.read(folder)
    arrays = result.arrays
    if arrays.displacement is None and arrays.escape_mode is None and not arrays.parts:
        raise PictureError(f"{folder}: there is nothing to draw, neither a displacement nor a part of Γc")
    _ = result.body.boundary  # which pictures need: once, for all processes that draw
    return list(drawings(result))


def drawings(result: Result) -> Iterator[Drawing]:
    """What there is to draw of a result."""
    alone = len(result.parts) == 1
    for name, caption, wanted, make in PICTURES:
        if wanted(result):
            yield Drawing(result.folder / f"{name}.png", caption, partial(make, result), result.body.dimension == 3)
    for part in result.parts:
        name, words = ("contact", "the contact part") if alone else (f"contact_{part.name}", f"“{part.name}”")
        caption = f"Along {words}: displacement, friction and pressure."
        yield Drawing(result.folder / f"{name}.png", caption, partial(contact.contact, result, part))
