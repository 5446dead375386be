"""What contact costs over one linear solve of the same mesh: time and memory, each run in a process of its own.

    ./hvi exec python3 benchmarks/cost.py [--cells 512 1024] [--boxes] [--unstructured] [--algebraic gamg hypre mumps]
    ./hvi exec python3 benchmarks/cost.py --degree 2 --cells 128 256 --boxes 28

The linear solve has contact closed and the laws at rest; algebraic ones on the one mesh, the geometric one with the
hierarchy's coarser meshes. All to 1e-8, in turn, medians of the repeats.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
from common import (
    SCENES,
    Figures,
    certified,
    document,
    median,
    parser,
    picture,
    repeated,
    say,
    spread,
    square,
    table,
)

PLANE = ("frictionless", "paper", "strong law", "lift-off")
HEAD = (
    "scene", "dofs", "contact / s", "with mesh / s", "best algebraic / s", "ratio", "geometric / s", "ratio",
    "peak memory / MB", "over the algebraic one", "certified",
)  # fmt: skip
COUNTS = ("scene", "dofs", "levels", "branch", "Newton", "linear (all levels)")
Runs = Mapping[str, list[Figures]]


def measured(scene: str, overrides: Sequence[str], kinds: Sequence[str], options: argparse.Namespace) -> Runs:
    return repeated({kind: (scene, kind, overrides) for kind in ("contact", *kinds)}, options)


def row(scene: str, runs: Runs) -> list[object]:
    own = runs["contact"]
    algebraic = {k: v for k, v in runs.items() if k not in ("contact", "mg") and v}
    best = min(algebraic, key=lambda k: median(algebraic[k]))
    geometric = runs.get("mg", [])
    peak = median(own, lambda r: r["peak_mb"])
    return [
        scene,
        own[0]["dofs"],
        spread(own),
        spread(own, lambda r: r["total"]),
        f"{spread(algebraic[best])}, {best}",
        f"**{median(own) / median(algebraic[best]):.2f}**",
        spread(geometric) if geometric else "",
        f"**{median(own) / median(geometric):.2f}**" if geometric else "",
        f"{peak:.0f}",
        f"{peak / median(algebraic[best], lambda r: r['peak_mb']):.2f}",
        certified(own),
    ]


def counts(scene: str, run: Figures) -> list[object]:
    return [scene, *(run[k] for k in ("dofs", "levels", "branch", "newton", "linear"))]


def draw(page: str, rows: Sequence[Sequence[object]]) -> None:
    figure, axes = plt.subplots(figsize=(8, 0.45 * len(rows) + 1.5))
    names = [f"{r[0]}, {float(str(r[1])) / 1e3:,.0f}k dofs" for r in rows]
    for shift, column, label in ((-0.2, 5, "best algebraic linear solve"), (0.2, 7, "geometric multigrid solve")):
        values = [float(str(r[column]).strip("*") or "nan") for r in rows]
        axes.barh([i + shift for i in range(len(rows))], values, 0.38, label=f"over the {label}")
    axes.axvline(1.0, color="black", lw=0.8)
    axes.set_yticks(range(len(rows)), names)
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_xlabel("time of the contact problem over that of a linear solve")
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncol=2, frameon=False)
    picture(page, figure)


@contextmanager
def drawn(file: Path, size: float, dimension: int) -> Iterator[Any]:
    """Gmsh, whose model of the block is meshed with cells of this size into a file when it has been drawn."""
    import gmsh

    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)
    yield gmsh
    gmsh.model.mesh.generate(dimension)
    gmsh.write(str(file))
    gmsh.finalize()


def plate(folder: Path, size: float, refinements: int = 0) -> list[str]:
    """Overrides for the unit square as an unstructured gmsh mesh of this cell size, refined so often."""
    file = folder / f"plate_{size}.msh"
    with drawn(file, size, 2) as gmsh:
        gmsh.model.occ.addRectangle(0, 0, 0, 1, 1)
        gmsh.model.occ.synchronize()
        for tag, name in ((1, "bottom"), (2, "right"), (3, "top"), (4, "left")):
            gmsh.model.addPhysicalGroup(1, [tag], name=name)
        gmsh.model.addPhysicalGroup(2, [1], name="plate")
    return [f'domain={{shape="file", file="{file}", refinements={refinements}}}']


def bored(folder: Path, size: float) -> list[str]:
    """Overrides for the unit cube with a bore as an unstructured gmsh mesh of this cell size."""
    file = folder / f"bored_{size}.msh"
    with drawn(file, size, 3) as gmsh:
        occ, model = gmsh.model.occ, gmsh.model
        occ.cut([(3, occ.addBox(0, 0, 0, 1, 1, 1))], [(3, occ.addCylinder(0.5, -0.1, 0.6, 0, 1.2, 0, 0.2))])
        occ.synchronize()
        for name, z in (("bottom", 0.0), ("top", 1.0)):
            found = model.getEntitiesInBoundingBox(-0.1, -0.1, z - 1e-3, 1.1, 1.1, z + 1e-3, 2)
            model.addPhysicalGroup(2, [tag for _, tag in found], name=name)
        model.addPhysicalGroup(3, [tag for _, tag in model.getEntities(3)], name="block")
        gmsh.option.setNumber("Mesh.MeshSizeMin", size)
    return [f'domain={{shape="file", file="{file}"}}']


def command_line() -> argparse.Namespace:
    made = parser(__doc__)
    made.add_argument("--cells", type=int, nargs="*", default=[512], help="a side: 128, 256, 512, 1024 in full")
    made.add_argument("--algebraic", nargs="*", default=["gamg"], help="of gamg, hypre, mumps")
    made.add_argument("--boxes", type=int, nargs="*", default=[], help="cells a side in 3D: 32, 52, 68 in full")
    made.add_argument("--unstructured", type=float, nargs="*", default=[], help="cell sizes of gmsh meshes: 0.004")
    made.add_argument("--refined", type=float, nargs="*", default=[], help="such sizes, refined four times: 0.064")
    made.add_argument("--bored", type=float, nargs="*", default=[], help="cell sizes of gmsh meshes in 3D: 0.028")
    made.add_argument("--degree", type=int, default=1, choices=(1, 2), help="of the elements: twice the cells a side")
    made.add_argument("--scenes", nargs="*", choices=[*SCENES], default=[*PLANE])
    return made.parse_args()


def cases(options: argparse.Namespace, folder: Path) -> Iterator[tuple[str, str, list[str], list[str]]]:
    """Name, scene, overrides and linear solvers of each case."""
    algebraic, both = options.algebraic, [*options.algebraic, "mg"]
    for n in options.cells:
        yield from ((s, s, square(n), both) for s in options.scenes)
    for n in options.boxes:
        yield "block", "block", [f"domain.cells=[{n}, {n}, {n}]"], both
    for h in options.unstructured:
        yield from ((f"{s}, gmsh", s, plate(folder, h), algebraic) for s in options.scenes)
    for h in options.refined:
        yield from ((f"{s}, gmsh refined", s, plate(folder, h, refinements=4), both) for s in options.scenes)
    for h in options.bored:
        yield "lifted block, gmsh", "lifted block", bored(folder, h), algebraic


def main() -> None:
    options = command_line()
    rows, counted = [], []
    with tempfile.TemporaryDirectory() as folder:
        for name, scene, overrides, kinds in cases(options, Path(folder)):
            runs = measured(scene, [*overrides, f"solver.degree={options.degree}"], kinds, options)
            if not runs["contact"] or not any(runs[kind] for kind in options.algebraic):
                say(f"{name}, {overrides[0]}: left out, since its runs failed")
                continue
            rows.append(row(name, runs))
            counted.append(counts(name, runs["contact"][0]))
    page = "cost" if options.degree == 1 else "cost-degree-2"
    draw(page, rows)
    text = (
        '"Contact" is the time of assembly (forms included), setup and solve on all levels; "with mesh" adds the '
        f"mesh. Times are medians of {options.repeats} with their range. Each ratio is the time of the contact problem "
        "over that of one linear solve."
    )
    title = "The cost of contact" if options.degree == 1 else "The cost of contact at degree 2"
    document(page, title, [text, table(HEAD, rows), table(COUNTS, counted)], options)


if __name__ == "__main__":
    main()
