"""``report.html`` of a load path: the answer in one line, its picture, and what the numbers mean."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ..path_reader import PathResult, read
from ..rounding import unless_noise
from ..units import quantity
from . import scene_text
from .content import picture, pictures
from .render import page_of


def write(folder: Path) -> Path:
    """Write the page into the folder of a finished load path; for rank 0 alone.

    Raises:
        ResultError: no load path is there, or its files are damaged.
        NotWrittenError: the page cannot be written.
    """
    return page_of("path.html.j2", _content(read(folder)), folder)


def _content(result: PathResult) -> dict[str, Any]:
    good = result.summary["converged"]
    return {
        "title": result.title,
        "verdict": {"kind": "good" if good else "bad", "words": f"{_capital(str(result.summary['reason']))}."},
        "warnings": result.summary.get("warnings") or [],
        "pictures": [picture(path) for path in pictures(result.folder, ("path",))],
        "numbers": list(_numbers(result)),
        "forces": list(_forces(result)),
        "remarks": list(_remarks(result)),
        "body": list(scene_text.body_of(result.scene)),
        "parts": list(scene_text.parts_of(result.scene)),
    }


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _numbers(result: PathResult) -> Iterator[tuple[str, str]]:
    path, energy = result.path, "J" if len(result.axes) == 3 else "J/m"
    yield "what the factor multiplies", ", ".join(path["scaled"])
    yield "largest factor that is borne", f"{path['peak_factor']:.6g} (row {path['peak_row']})"
    yield "end", f"{path['end']}" + (f": {path['reason']}" if path["reason"] else "")
    yield "states", f"{path['rows']}, of these {path['unstable_rows']} unstable"
    yield "events", f"{path['events']} kinks, contacts and releases, {path['folds']} limit points"
    yield "jumps", ", ".join(_jump(one, energy) for one in path["jumps"][:8]) or "none"
    yield "work of loads and supports", quantity(path["work"], energy)
    yield "dissipated by bonds", quantity(path["dissipated"], energy)
    yield (
        "certified",
        f"{path['certified']} of {path['rows']} states, {path['whole_body_certificates']} of them with the whole body",
    )


def _jump(jump: dict[str, float], energy: str) -> str:
    return f"at the factor {jump['factor']:.5g}, {quantity(jump['released'], energy)} released"


def _forces(result: PathResult) -> Iterator[tuple[str, str]]:
    name, forces = "N" if len(result.axes) == 3 else "N/m", result.path["peak_forces"]
    largest = max((abs(f) for found in forces.values() for f in found["force"]), default=0.0)
    for part, found in forces.items():
        values = ", ".join(quantity(unless_noise(f, largest), name) for f in found["force"])
        yield f"largest force on “{part}”", f"({values}), row {found['row']}"


def _remarks(result: PathResult) -> Iterator[str]:
    table = result.scene.get("path") or {}
    if table.get("memory", True):
        yield "Bonds remember: they unload along the secant, and what is broken stays broken."
    else:
        yield "Bonds do not remember: on unloading a joint heals, and what was broken holds again."
    if table.get("follow", "stable") == "stable":
        yield (
            "At a limit point the path goes on to the next stable equilibrium at the same load, as a test does whose "
            "load is controlled; the energy between the two is released."
        )
    else:
        yield "The path is followed through limit points; a test reaches unstable stretches only if controlled."
