"""Force over displacement: a block is pushed along a floor whose friction drops, step by step.

The left side is moved, the block is pressed onto the floor, and the friction drops from 1 to 0.5 MPa where the slip is
larger than 9 µm. The force rises, falls as the drop passes along the floor, and stays at half of the peak traction when
all of the floor has broken: 0.5e6 N/m² on 1 m. It is not zero at the start, since the pressed block spreads.

    ./hvi exec python3 demos/load_loop.py [FOLDER]

The picture force.png goes to FOLDER (results/load_loop by default).
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure
from mpi4py import MPI

import hvi_fenicsx as hvi

LAW = hvi.laws.QuadraticLinear(gamma1=1e6, gamma2=5e5, delta=9e-6)  # N/m², N/m², m
STEPS = np.linspace(0.0, 24e-6, 17)  # m


def forces(cells: int = 16) -> npt.NDArray[np.float64]:
    """The force on the left side at each step, N/m."""
    pushed = hvi.Model(
        hvi.Body.rectangle([1.0, 1.0], [cells, cells]),
        [
            hvi.Isotropic(youngs_modulus=7e10, poisson_ratio=0.3),
            hvi.Displacement("left", [0.0, None]),
            hvi.Traction("top", [0.0, -1e6]),
            hvi.Contact("bottom"),
            hvi.Friction("bottom", LAW),
        ],
    )
    found = []
    last = None
    for step in STEPS:
        last = hvi.solve(pushed.replace(hvi.Displacement("left", [step, None])), start=last, estimate=False)
        found.append(last.resultant("left")[0])
    return np.array(found)


def draw(force: npt.NDArray[np.float64], file: Path) -> None:
    figure = Figure(figsize=(6, 4), layout="constrained")
    axes = figure.add_subplot(xlabel="displacement of the left side in µm", ylabel="force in kN/m")
    axes.plot(1e6 * STEPS, 1e-3 * force, marker=".")
    axes.axhline(1e-3 * LAW.gamma2, color="0.6", linestyle="--", label="all of the floor has broken")
    axes.legend()
    file.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(file, dpi=100)


def main(folder: Path) -> npt.NDArray[np.float64]:
    force = forces()
    if MPI.COMM_WORLD.rank == 0:
        draw(force, folder / "force.png")
        print(f"peak {force.max():.4g} N/m at {1e6 * STEPS[force.argmax()]:.3g} µm; at the end {force[-1]:.6g} N/m")
    np.testing.assert_allclose(force[-1], LAW.gamma2, rtol=1e-6)
    return force


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "results/load_loop"))
