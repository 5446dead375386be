"""The mesh axis of a study: cells of a built-in block, mesh size of a shape that gmsh meshes, refinements of a file."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from ..errors import InputError
from ..report.units import quantity
from ..scene import Box, Disk, HalfDisk, MeshFile, Rectangle, Scene
from ..scene.shapes import MOST_REFINEMENTS

_MOST_POINT = {2: 150_000, 3: 60_000}
_MOST_REFERENCE = {2: 400_000, 3: 250_000}
"""Unknowns of the finest point of a plan's own making, and of the reference, by dimension."""
_FEWEST_CELLS = 2
_AREA_OF_VERTEX = math.sqrt(3.0) / 2.0
"""Of a vertex in a mesh of equilateral triangles, over h²."""
_FILE = 5_000.0
_BELOW, _ABOVE = 2, 1
"""Rungs of a plan's own making below and above the scene's mesh."""

Tables = dict[str, Any]
ADAPTIVE = "adaptive to "
"""How the words of an adaptive mesh begin."""


@dataclass(frozen=True)
class Setting:
    """What one point solves.

    Attributes:
        scene: the scene, on its own mesh.
        accuracy: instead of that mesh, one refined adaptively until the estimate is below this (`hvi run --accuracy`).
    """

    scene: Scene
    accuracy: float | None = None


def width(scene: Scene) -> float | None:
    """The mesh width h, m: the longest side of a block's cells, or the mesh size; None for a mesh file."""
    domain = scene.domain
    if isinstance(domain, Rectangle | Box):
        return max(s / n for s, n in zip(domain.size, domain.cells, strict=True))
    return None if isinstance(domain, MeshFile) else domain.mesh_size


def words(setting: Setting) -> str:
    """The mesh, as people name it."""
    domain = setting.scene.domain
    if setting.accuracy is not None:
        return f"{ADAPTIVE}{100 * setting.accuracy:g} %"
    if isinstance(domain, Rectangle | Box):
        return " × ".join(map(str, domain.cells)) + " cells"
    if isinstance(domain, MeshFile):
        often = domain.refinements
        return ("file, as it is", "file, refined once")[often] if often < 2 else f"file, refined {often} times"
    return f"mesh size {quantity(domain.mesh_size, 'm')}"


def unknowns(setting: Setting) -> float:
    """About how many there are; of a mesh file, which is not opened for it, a guess."""
    scene, domain = setting.scene, setting.scene.domain
    if isinstance(domain, Rectangle | Box):
        return float(scene.dimension * math.prod(n + 1 for n in domain.cells))
    if isinstance(domain, MeshFile):
        return _FILE * 2.0 ** (scene.dimension * domain.refinements)
    if isinstance(domain, Disk | HalfDisk):
        area = math.pi * domain.radius**2 / (1.0 if isinstance(domain, Disk) else 2.0)
        return 2.0 * _vertices(area, domain.mesh_size, domain.mesh_size_below or domain.mesh_size)
    return 2.0 * _vertices(domain.area(), domain.mesh_size, domain.mesh_size)


def _vertices(area: float, coarse: float, fine: float) -> float:
    """∫ of one vertex for √3/2 h² over half a disk, h growing evenly from its centre to its rim."""
    radius = math.sqrt(2.0 * area / math.pi)
    growth = (coarse - fine) / radius
    if growth <= 1e-3 * coarse / radius:
        return area / (_AREA_OF_VERTEX * coarse**2)
    whole = (math.log(coarse / fine) + fine / coarse - 1.0) / growth**2
    return math.pi * whole / _AREA_OF_VERTEX


def refined(tables: Mapping[str, Any], factor: Fraction) -> Tables | None:
    """The scene's tables with cells ``factor`` times finer each way; None where cells do not come out whole.

    Of a mesh file the factor is a power of two: so often it is refined.
    """
    domain = dict(tables["domain"])
    if "cells" in domain:
        cells = [n * factor for n in domain["cells"]]
        if any(n.denominator != 1 or n < _FEWEST_CELLS for n in cells):
            return None
        domain["cells"] = [int(n) for n in cells]
    elif "mesh_size" in domain:
        for key in ("mesh_size", "mesh_size_below"):
            if key in domain:
                domain[key] = float(domain[key] / factor)
    else:
        levels = domain.get("refinements", 0) + factor.numerator.bit_length() - factor.denominator.bit_length()
        if not 0 <= levels <= MOST_REFINEMENTS:
            return None
        domain["refinements"] = levels
    return {**tables, "domain": domain}


def at(tables: Mapping[str, Any], text: str) -> Tables:
    """The scene's tables with the mesh that a value of the axis names.

    Args:
        tables: the scene's. text: cells along the first side of a block, a mesh size in m, refinements of a file.

    Raises:
        InputError: no number, or cells that do not come out whole along the other sides.
    """
    domain = tables["domain"]
    if "cells" in domain:
        return _cells_at(tables, text)
    if "mesh_size" not in domain:
        if not text.isdigit() or int(text) > MOST_REFINEMENTS:
            raise InputError(f"--axis mesh: {text!r}: of a mesh file, 0 to {MOST_REFINEMENTS} refinements are wanted")
        return {**tables, "domain": {**domain, "refinements": int(text)}}
    try:
        size = float(text)
    except ValueError:
        size = 0.0
    if not (math.isfinite(size) and size > 0.0):
        raise InputError(f"--axis mesh: {text!r} is no mesh size in m, like {domain['mesh_size']}")
    return refined(tables, Fraction(domain["mesh_size"]) / Fraction(size)) or dict(tables)


def _cells_at(tables: Mapping[str, Any], text: str) -> Tables:
    cells = tables["domain"]["cells"]
    if not text.isdigit() or int(text) < _FEWEST_CELLS:
        raise InputError(f"--axis mesh: {text!r} is no number of cells along x ({_FEWEST_CELLS} or more)")
    found = refined(tables, Fraction(int(text), cells[0]))
    if found is None:
        possible = ", ".join(str(int(cells[0] * f)) for f in _factors(cells))
        raise InputError(
            f"--axis mesh: {text} cells along x instead of {cells[0]} leave no whole number along the other sides, "
            f"which have {', '.join(map(str, cells[1:]))}; possible: {possible}"
        )
    return found


def _factors(cells: list[int]) -> Iterator[Fraction]:
    common = math.gcd(*cells)
    for n in sorted({1, common // 4, common // 2, common, 2 * common, 4 * common} - {0}):
        if all(c // common * n >= _FEWEST_CELLS for c in cells):
            yield Fraction(n, common)


def ladder(tables: Mapping[str, Any], setting_of: Callable[[Tables], Setting]) -> list[Tables]:
    """The meshes of a plan's own making, coarse to fine: the scene's, halved and doubled as far as that goes."""
    steps = [refined(tables, Fraction(2) ** k) for k in range(-_BELOW, _ABOVE + 1)]
    found = [t for t in steps if t is not None and _affordable(setting_of(t), _MOST_POINT)]
    return found or [dict(tables)]


def reference(tables: Mapping[str, Any], setting_of: Callable[[Tables], Setting]) -> list[Tables]:
    """Three rungs from the reference down, for the finest mesh of a plan: it is four times finer, or twice."""
    finest = refined(tables, Fraction(4))
    if finest is None or not _affordable(setting_of(finest), _MOST_REFERENCE):
        finest = refined(tables, Fraction(2)) or dict(tables)
    below = [refined(finest, Fraction(1, n)) for n in (2, 4)]
    return [finest, *(t for t in below if t is not None)]


def _affordable(setting: Setting, most: Mapping[int, int]) -> bool:
    return unknowns(setting) <= most[setting.scene.dimension]
