"""What contact between two bodies costs over one linear solve of the same bodies, glued together, by mesh.

    ./hvi exec python3 benchmarks/joint_cost.py --cpu --repeats 1

Two blocks with friction between them, whose meshes do not match (`two_blocks.toml`, `two_blocks_3d.toml`): pressed
askew and pushed, so that they part at one end. The linear solve is CG with GAMG, to 1e-8. Each run in a process of its
own.
"""

from __future__ import annotations

from common import Figures, certified, median, parser, repeated, say, table

TIED = 'interface.seam={between=["upper.bottom", "lower.top"], tied=true}'
PLANE, SPACE = "../benchmarks/two_blocks", "../benchmarks/two_blocks_3d"
HEAD = (
    "blocks",
    "unknowns",
    "levels",
    "Newton",
    "linear",
    "glued: linear",
    "contact / s",
    "glued / s",
    "ratio",
    "certified",
)
COARSE = {PLANE: ([16, 8], [15, 8]), SPACE: ([4, 4, 4], [5, 5, 5])}
"""Cells of the lower and of the upper block on the coarsest mesh."""


def cells(scene: str, times: int) -> list[str]:
    """Overrides for so many times the cells of the coarsest mesh."""
    lower, upper = ([times * n for n in block] for block in COARSE[scene])
    return [f"domain.lower.cells={lower}", f"domain.upper.cells={upper}"]


def row(name: str, own: list[Figures], glued: list[Figures]) -> list[object]:
    counts = [own[0][key] for key in ("dofs", "levels", "newton", "linear")]
    times = [median(own), median(glued)]
    ratio = f"**{times[0] / times[1]:.2f}**"
    return [name, *counts, glued[0]["linear"], *(f"{t:.2f}" for t in times), ratio, certified(own)]


def main() -> None:
    made = parser(__doc__)
    made.add_argument("--plane", type=int, nargs="*", default=[4, 8, 16, 32], help="how often the coarsest mesh")
    made.add_argument("--space", type=int, nargs="*", default=[2, 4, 8], help="the same of the blocks in space")
    options = made.parse_args()
    rows = []
    for name, scene, wanted in (("plane", PLANE, options.plane), ("space", SPACE, options.space)):
        for times in wanted:
            mesh = cells(scene, times)
            kinds = {"contact": (scene, "contact", mesh), "glued": (scene, "gamg", [*mesh, TIED])}
            found = repeated(kinds, options, warm=cells(scene, 1))
            if found["contact"] and found["glued"]:
                rows.append(row(name, found["contact"], found["glued"]))
    say(table(HEAD, rows))


if __name__ == "__main__":
    main()
