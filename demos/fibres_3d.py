"""A block of fibre composite on a floor, with an elastic energy of your own, in 3D.

The fibres lie flat, at 30 degrees to the x-axis. The energy is that of a transversely isotropic material, in UFL:
a quadratic form of the strain ε and the fibres' direction a:

    λ/2 tr(ε)² + μ_T |ε|² + α (a·εa) tr(ε) + 2 (μ_L - μ_T) |εa|² + β/2 (a·εa)²

The block is pressed down. It spreads across its fibres, and the friction on the floor breaks where it slips far enough.

    ./hvi exec python3 demos/fibres_3d.py [FOLDER]

The picture block.png goes to FOLDER (results/fibres_3d by default).
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import ufl

import hvi_fenicsx as hvi

LAMBDA, MU_T, MU_L, ALPHA, BETA = 5.6e9, 2.5e9, 5.7e9, -1.3e9, 2.2e11  # N/m², carbon fibres in epoxy (Spencer)
ANGLE = np.radians(30.0)
FIBRES, ACROSS = np.array([np.cos(ANGLE), np.sin(ANGLE), 0.0]), np.array([-np.sin(ANGLE), np.cos(ANGLE), 0.0])
PRESS = 2e7  # N/m²
SIZE, CELLS = (0.1, 0.1, 0.02), (6, 6, 2)  # m
LAW = hvi.laws.Graph([(0.0, 0.0), (2e-5, 4e6), (2e-5, 1e6)])  # slip in m, traction in N/m²


def stress(strain: Any, a: Any) -> Any:
    """The derivative of the energy with respect to the strain."""
    along, whole = ufl.inner(a, strain * a), ufl.Identity(3)
    mixed = ufl.outer(strain * a, a) + ufl.outer(a, strain * a)
    return (
        (LAMBDA * ufl.tr(strain) + ALPHA * along) * whole
        + 2 * MU_T * strain
        + (ALPHA * ufl.tr(strain) + BETA * along) * ufl.outer(a, a)
        + 2 * (MU_L - MU_T) * mixed
    )


def energy(u: Any, v: Any) -> Any:
    a = ufl.as_vector([float(component) for component in FIBRES])
    return ufl.inner(stress(ufl.sym(ufl.grad(u)), a), ufl.sym(ufl.grad(v))) * ufl.dx


def block(*more: Any) -> hvi.Model:
    """The block pressed onto the floor, with what else acts on it."""
    pressed = [hvi.Energy(energy), hvi.Traction("top", [0.0, 0.0, -PRESS]), hvi.Contact("bottom")]
    return hvi.Model(hvi.Body.box(SIZE, CELLS), [*pressed, *more], title="A block of fibre composite")


def spread(solution: hvi.Solution, way: npt.NDArray[np.float64]) -> float:
    """The mean stretch of the floor along a direction."""
    floor = solution.contact["bottom"]
    slip = np.einsum("mk,mkd->md", floor.slip, floor.tangents)
    return float(np.polyfit(floor.x @ way, slip @ way, 1)[0])


def main(folder: Path) -> tuple[hvi.Solution, npt.NDArray[np.float64]]:
    solution = hvi.solve(block(hvi.Friction("bottom", LAW)))
    picture = solution.plot("body")
    stretches = np.array([spread(solution, FIBRES), spread(solution, ACROSS)])
    broken = np.count_nonzero(solution.contact["bottom"].branch == 1)
    if picture is not None:  # rank 0
        folder.mkdir(parents=True, exist_ok=True)
        picture.savefig(folder / "block.png", dpi=100)
        print(solution)
        print(f"the floor stretches by {stretches[0]:.3g} along the fibres, by {stretches[1]:.3g} across them")
        print(f"{broken} vertices of the floor have broken")
    np.testing.assert_allclose(solution.resultant("bottom"), [0.0, 0.0, PRESS * SIZE[0] * SIZE[1]], atol=1e-3)
    return solution, stretches


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "results/fibres_3d"))
