"""``equilibria.png``: the energies of all equilibria, and beside each its state along Γc; drawn by a child process.

The child, ``python3 -m hvi_fenicsx.report.pictures.equilibria FOLDER``, knows the folder alone, and no MPI.
"""

from __future__ import annotations

import csv
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from ...runtime import processes
from ..errors import PictureError

NAME = "equilibria.png"
MOST = 24
"""Equilibria in the picture, those of lowest energy."""
TIMEOUT = 60.0
"""Seconds after which the child is ended."""
_CELLS = {"-1": "#D55E00", "0": "#0072B2"}
_FURTHER = ("#E69F00", "#AA4499", "#009E73", "#6b6b6b")


def draw(folder: Path) -> None:
    """Draw the picture of a folder of ``hvi equilibria`` that is being written. Rank 0 only.

    Args:
        folder: with ``equilibria.csv`` and the folders it names.

    Raises:
        PictureError: the child failed.
    """
    command = [*processes.PYTHON, "-m", __name__, os.path.abspath(folder)]
    try:
        done = subprocess.run(
            command, env=processes.environment(), cwd=folder, capture_output=True, text=True, timeout=TIMEOUT
        )
    except subprocess.TimeoutExpired:
        raise PictureError(f"{NAME}: not drawn within {TIMEOUT:g} s") from None
    if done.returncode != 0:
        raise PictureError(f"{NAME}: {(done.stderr.strip() or '?').splitlines()[-1]}")


def _rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def _unit(folder: Path) -> str:
    """The unit of energy: J in space, where contact.csv has a z."""
    rows = _rows(folder / _rows(folder / "equilibria.csv")[0]["folder"] / "contact.csv")
    return "J" if rows and rows[0]["z"] else "J/m"


def _colour(branch: str) -> str:
    return _CELLS.get(branch) or _FURTHER[(int(branch) - 1) % len(_FURTHER)]


def main(folder: Path) -> None:
    """Draw the picture.

    Args:
        folder: with ``equilibria.csv``.
    """
    from matplotlib.figure import Figure
    from matplotlib.ticker import MaxNLocator

    rows = _rows(folder / "equilibria.csv")[:MOST]
    fig = Figure(figsize=(8.0, 1.8 + 0.45 * len(rows)), dpi=150)
    energies, states = fig.subplots(1, 2, sharey=True, width_ratios=(1, 2))
    values = [float(r["energy"]) for r in rows]
    marks = {"minimiser": "o", "saddle": "^"}
    for i, (row, value) in enumerate(zip(rows, values, strict=True)):
        face = "#222222" if row["kind"] == "minimiser" else "none"
        energies.plot(value - values[0], i, marks.get(row["kind"], "s"), color="#222222", mfc=face, ms=8)
        _state(states, i, _rows(folder / row["folder"] / "contact.csv"))
    energies.set_yticks(range(len(rows)), [r["index"] for r in rows])
    energies.set_ylim(len(rows) - 0.4, -0.7)
    spread = values[-1] - values[0]
    energies.set_xlim(-0.08 * spread if spread else -1.0, 1.08 * spread if spread else 1.0)
    energies.xaxis.set_major_locator(MaxNLocator(3))
    states.xaxis.set_major_locator(MaxNLocator(integer=True))
    energies.set_xlabel(f"energy above {values[0]:.6g} ({_unit(folder)})")
    energies.set_ylabel("equilibrium")
    energies.set_title("● minimiser  △ saddle", fontsize=10)
    states.set_xlabel("vertices along the parts")
    states.set_title("first piece of the law: blue; further: orange ...; on a kink: red; bar above: lifted", fontsize=9)
    for axes in (energies, states):
        axes.spines[["top", "right"]].set_visible(False)
    fig.tight_layout()
    fig.savefig(folder / NAME)


def _state(axes: object, y: int, vertices: Sequence[dict[str, str]]) -> None:
    """A row of squares: the piece of the law at each vertex, and a bar above where it has lifted off."""
    for k, vertex in enumerate(vertices):
        branch = vertex["branch_t"] or vertex["branch_n"]
        if branch:
            axes.plot(k, y, "s", color=_colour(branch), ms=6, mec="none")  # type: ignore[attr-defined]
        if vertex["contact"] in ("0", "false", "False"):
            axes.plot(k, y - 0.36, "_", color="#222222", ms=7, mew=1.5)  # type: ignore[attr-defined]


if __name__ == "__main__":
    main(Path(sys.argv[1]))
