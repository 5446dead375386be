"""``report.html`` of a search of all equilibria: the answer in one line, its picture, and a row for each."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ..equilibria_reader import EquilibriaResult, read
from ..units import number, quantity
from . import scene_text
from .content import picture, pictures
from .render import page_of

MOST = 100
"""Equilibria in the table, those of lowest energy."""


def write(folder: Path) -> Path:
    """Write the page into the folder of a search; for rank 0 alone.

    Raises:
        ResultError: no search is there, or its files are damaged.
        NotWrittenError: the page cannot be written.
    """
    return page_of("equilibria.html.j2", _content(read(folder)), folder)


def _content(result: EquilibriaResult) -> dict[str, Any]:
    known, reason = result.known, str(result.summary["reason"])
    return {
        "title": result.title,
        "verdict": {"kind": "good" if known["proven"] else "limited", "words": f"{reason[:1].upper()}{reason[1:]}."},
        "pictures": [picture(path) for path in pictures(result.folder, ("equilibria",))],
        "numbers": list(_numbers(result)),
        "equilibria": list(_rows(result)),
        "left_out": max(len(result.rows) - MOST, 0),
        "body": list(scene_text.body_of(result.scene)),
        "parts": list(scene_text.parts_of(result.scene)),
    }


def _numbers(result: EquilibriaResult) -> Iterator[tuple[str, str]]:
    known = result.known
    yield "equilibria found", f"{known['count']}, {'all there are' if known['complete'] else 'there may be others'}"
    if known["lowest_energy"] is not None:
        yield "lowest energy found", f"{number(known['lowest_energy'], 10)} {result.unit}"
    if known["lower_bound"] is not None:
        yield "no displacement has an energy below", f"{number(known['lower_bound'], 10)} {result.unit}"
    if known["gap"] is not None:
        yield "gap between the two, relative", number(known["gap"], 2)
    yield "boxes that were bounded or tested", str(known["nodes"])
    if known["continua"]:
        yield "these stand for a continuum of equilibria", ", ".join(map(str, known["continua"]))
    if known["uncertified"]:
        yield "not certified", ", ".join(map(str, known["uncertified"]))
    yield "time", f"{result.summary['time']['total']:.1f} s"


def _rows(result: EquilibriaResult) -> Iterator[dict[str, str]]:
    for row in result.rows[:MOST]:
        above = float(row["energy"]) - result.energies[0]
        yield {
            "index": row["index"],
            "kind": row["kind"],
            "energy": number(float(row["energy"]), 10),
            "above": quantity(above, result.unit) if above > 0.0 else "–",
            "slip": quantity(float(row["max_slip"]), "m"),
            "opening": quantity(float(row["max_opening"]), "m"),
            "broken": row["broken"],
            "folder": row["folder"],
        }
