"""The joint limit (h, ε) → 0 of the paper's Theorem 2, measured along several couplings ε(h).

    ./hvi exec python3 benchmarks/joint_limit.py [--finest 64] [--out docs]

Each scene is solved with the smoothing on meshes of 4 to --finest cells a side, for ε = c·√h, c·h, c·h² and fixed; the
reference is the unsmoothed law on a mesh four times finer, measured as `hvi study` does. Writes joint-limit.md and
images/joint_limit.png.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from mpi4py import MPI

from hvi_fenicsx import read_scene, solve
from hvi_fenicsx.results.gathering import solution_arrays
from hvi_fenicsx.scene import Scene
from hvi_fenicsx.studies.error_norms import errors
from hvi_fenicsx.studies.reference_solution import ReferenceSolution
from hvi_fenicsx.studies.solution_fields import fields
from hvi_fenicsx.studies.stiffness import stiffness

DEMOS = Path(__file__).parents[1] / "demos"
COARSEST = 4
COUPLINGS: Mapping[str, Callable[[float], float]] = {
    "fixed": lambda h: 1.0,
    "√h": math.sqrt,
    "h": lambda h: h,
    "h²": lambda h: h * h,
    "exact law": lambda h: 0.0,
}
COLOURS = dict(zip(COUPLINGS, ("#D55E00", "#E69F00", "#0072B2", "#AA4499", "#009E73"), strict=True))
QUANTITIES = {"energy_norm": "energy norm", "u_t_l2": "uₜ (L2)", "friction_l1": "-σₜ (L1)"}
CASES = {
    "wall_left": ("paper", "wall left, the paper's S, which acts at zero slip for every ε"),
    "strong_law": ("chks", "strong law, chks, the slip passes the drop"),
}


@dataclass(frozen=True)
class Line:
    """One coupling: by mesh width h (coarse to fine) the width ε and the errors by quantity; None: not certified."""

    coupling: str
    points: tuple[tuple[float, float, Mapping[str, float | None] | None], ...]

    def errors(self, quantity: str) -> list[tuple[float, float]]:
        """(h, error) where there is one."""
        return [(h, e) for h, _, found in self.points if found and (e := found[quantity])]

    def order(self, quantity: str) -> float:
        """In h, over the two finest meshes."""
        (h0, e0), (h1, e1) = self.errors(quantity)[-2:]
        return math.log(e1 / e0) / math.log(h1 / h0)


def scene(name: str, cells: int, epsilon: float = 0.0) -> Scene:
    """A demo on the square with so many cells a side, its smoothing of relative width ε; 0 is the exact law."""
    width = f'{{ smoothing = "{CASES[name][0]}", epsilon = {epsilon!r} }}' if epsilon else "{}"
    return read_scene(DEMOS / f"{name}.toml", [f"domain.cells=[{cells}, {cells}]", f"solver={width}"])


def reference_of(name: str, cells: int) -> ReferenceSolution:
    """The exact law on a fine mesh."""
    solution = solve(scene(name, cells), MPI.COMM_SELF)
    found, matrix = solution_arrays(solution), stiffness(solution)
    if not solution.converged or found is None or matrix is None:
        raise SystemExit(f"{name}: the reference has no certified solution: {solution.reason}")
    return ReferenceSolution(fields(found), matrix)


def lines(name: str, finest: int) -> Iterator[Line]:
    """The couplings, with c such that all begin at ε = 1 on the coarsest mesh."""
    reference = reference_of(name, 4 * finest)
    meshes = [n for n in (2**k for k in range(2, 12)) if COARSEST <= n <= finest]
    for coupling, law in COUPLINGS.items():
        points = []
        for n in meshes:
            epsilon = law(1 / n) / (law(1 / COARSEST) or 1.0)
            solution = solve(scene(name, n, epsilon), MPI.COMM_SELF)
            found = solution_arrays(solution) if solution.converged else None
            points.append((1 / n, epsilon, errors(reference, reference.transfer(fields(found))) if found else None))
        yield Line(coupling, tuple(points))


def table(name: str, found: list[Line]) -> Iterator[str]:
    """Markdown: error on the finest mesh, and the order in h there."""
    yield f"\n## {name}: {CASES[name][1].partition(', ')[2]}\n"
    yield "| ε(h) | ε on the finest mesh | " + " | ".join(f"{q} | order" for q in QUANTITIES.values()) + " |"
    yield "|---" * (2 + 2 * len(QUANTITIES)) + "|"
    for line in found:
        epsilon = line.points[-1][1]
        cells = [f"{line.errors(q)[-1][1]:.1e} | {line.order(q):.2f}" for q in QUANTITIES]
        yield f"| {line.coupling} | {f'{epsilon:.3g}' if epsilon else '0'} | " + " | ".join(cells) + " |"


def draw(found: Mapping[str, list[Line]], path: Path) -> None:
    """A row a scene, a panel a quantity."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib.ticker import FuncFormatter

    figure, axes = plt.subplots(len(found), len(QUANTITIES), figsize=(12, 3.9 * len(found)), layout="constrained")
    for row, (name, all_lines) in zip(axes, found.items(), strict=True):
        for axis, (quantity, words) in zip(row, QUANTITIES.items(), strict=True):
            for line in all_lines:
                hs, errors = zip(*line.errors(quantity), strict=True)
                words_of = line.coupling if line.coupling in ("fixed", "exact law") else f"ε ~ {line.coupling}"
                axis.loglog(hs, errors, "o-", color=COLOURS[line.coupling], lw=2, ms=5, label=words_of)
            axis.set_xticks(hs, [f"1/{round(1 / h)}" for h in hs])
            axis.tick_params(axis="both", which="minor", length=0, labelbottom=False, labelleft=False)
            axis.tick_params(labelsize=10)
            axis.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"{100 * y:g} %"))
            axis.set_title(f"{name}: {words}", loc="left", size=12)
            axis.set_xlabel("h")
            axis.grid(alpha=0.3)
            axis.invert_xaxis()
    axes[0, 0].set_ylabel("relative error")
    axes[1, 0].set_ylabel("relative error")
    axes[0, -1].legend(fontsize=10)
    figure.savefig(path, dpi=110)


INTRODUCTION = """# The joint limit (h, ε) → 0: how must ε depend on h?

    ./hvi exec python3 benchmarks/joint_limit.py

In the paper's Theorem 2, h and ε tend to 0 together, without any relation between them. This page compares
couplings ε(h) by measurement: ε ~ √h, ε ~ h and ε ~ h², each with ε = 1 at h = 1/4 (relative to the law's energy);
ε = 1 fixed; and the exact law. The tables show relative errors. The reference is the exact law on a mesh four times
finer than the finest. The order in h is that of the two finest meshes. It is an observation, not a bound.

![Errors against h along the couplings](images/joint_limit.png)

On wall_left, the error of -σₜ has the order of the coupling: 0 for a fixed ε, ½ for √h, 1 for h. With h², no vertex is
left in the smoothed band from h = 1/16 on; the solution is then that of the exact law, to all digits shown. On
strong_law, every coupling slower than h² costs accuracy in uₜ and -σₜ, and √h also costs accuracy in the energy norm.
The exact law needs no coupling.
"""


def main() -> None:
    """Write the table and the picture."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--finest", type=int, default=64)
    parser.add_argument("--out", type=Path, default=Path("docs"))
    options = parser.parse_args()
    found = {name: list(lines(name, options.finest)) for name in CASES}
    text = "\n".join([INTRODUCTION.rstrip(), *(line for n, ls in found.items() for line in table(n, ls))])
    (options.out / "images").mkdir(parents=True, exist_ok=True)
    (options.out / "joint-limit.md").write_text(text + "\n", encoding="utf-8")
    draw(found, options.out / "images" / "joint_limit.png")
    print(text)


if __name__ == "__main__":
    main()
