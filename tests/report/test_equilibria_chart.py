"""The picture of all equilibria, from a folder alone."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
from matplotlib.colors import to_rgb

from hvi_fenicsx.report.pictures import charts
from hvi_fenicsx.report.pictures.style import BLUE, ORANGE, VERMILION
from hvi_fenicsx.report.reader import EquilibriaResult


def search(folder: Path, energies: list[float]) -> EquilibriaResult:
    """Equilibria that are alike, of four vertices with two laws each: unbroken, one broken, both, one on its kink."""
    branches = [(0, 0), (0, 1), (1, 1), (-1, 0)]
    (folder / "1").mkdir()
    with (folder / "1" / "contact.csv").open("w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, ["branch_t", "branch_n", "contact"])
        table.writeheader()
        table.writerows({"branch_t": t, "branch_n": n, "contact": 1} for t, n in branches)
    (folder / "1" / "summary.json").write_text(json.dumps({"resultants": {"base": [0.0, 0.0, 0.0]}}), encoding="utf-8")
    kinds = ["minimiser", *["saddle"] * (len(energies) - 1)]
    rows = [
        {"index": str(k + 1), "energy": repr(energy), "kind": kind, "folder": "1", "broken": "3"}
        for k, (energy, kind) in enumerate(zip(energies, kinds, strict=True))
    ]
    summary = {"equilibria": {"complete": True, "proven": True}}
    return EquilibriaResult(folder=folder, scene={"title": "t"}, summary=summary, rows=rows)


def test_a_vertex_has_the_colour_of_the_law_that_is_broken(tmp_path: Path) -> None:
    """It had that of the law along the contact part, whatever the one across it was on."""
    fig = charts.equilibria_chart(search(tmp_path, [-2.0]))
    bars = sorted((bar for one in fig.axes[1].containers for bar in one), key=lambda bar: bar.get_x())  # type: ignore
    colours = [bar.get_facecolor()[:3] for bar in bars]
    assert np.allclose(colours, [to_rgb(c) for c in (BLUE, ORANGE, ORANGE, VERMILION)])
