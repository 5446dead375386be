"""Mixed-mode bending by `hvi path`, against the load at which fracture mechanics have the crack grow."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from runs import ROOT, hvi, summary

LEVER, HALF_SPAN, WIDTH = 92.9, 50.4, 25.4
"""mm."""


@pytest.mark.long
def test_the_crack_grows_at_the_load_of_fracture_mechanics(tmp_path: Path) -> None:
    """Krueger, NASA/CR-2012-217562: 128.5 N and 1.64 mm at the lever's load point; every state is certified."""
    out = tmp_path / "bending"
    done = hvi("path", ROOT / "demos" / "mixed_mode_bending.toml", "--out", out, "--no-pictures")
    assert done.returncode == 0, done.stderr
    with (out / "path.csv").open(encoding="utf-8") as stream:
        rows = [tuple(float(row[key]) for key in ("factor", "end.uy", "middle.uy")) for row in csv.DictReader(stream)]
    factors, end, middle = np.array(rows).T
    turns = [i for i in range(1, len(factors) - 1) if factors[i - 1] <= factors[i] > factors[i + 1]]
    peak = max(turns, key=lambda i: float(factors[i]))
    assert WIDTH * factors[peak] == pytest.approx(128.5, rel=0.03)
    way = -middle[peak] + LEVER / HALF_SPAN * (end[peak] - middle[peak])
    assert 1e3 * way == pytest.approx(1.64, rel=0.03)
    assert summary(out)["path"]["uncertified"] == 0
