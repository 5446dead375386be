"""Estimated against true errors, scene by scene and on uniformly refined meshes.

    ./hvi exec python3 benchmarks/effectivity.py [--degree 2] [--levels 4] [--scenes NAME ...] [--picture FILE.png]

The true error is the distance in the energy norm from the solution on a mesh four times finer than the finest one
listed, solved without smoothing. That reference has an error too: on the finest mesh the true one comes out up to 3 %
too small where the order is 1, and the index as much too large.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from mpi4py import MPI

from hvi_fenicsx import Model, read_scene, read_tables
from hvi_fenicsx.certify.certificate import examine
from hvi_fenicsx.estimate.estimator import Estimate, estimate
from hvi_fenicsx.mesh import nodes, refinement
from hvi_fenicsx.problem.spaces import displacement_space
from hvi_fenicsx.runtime.cost import Timer
from hvi_fenicsx.solvers.nested_iteration import CoarseStart, LevelSolution, refined_levels, solve, solve_from_coarser
from hvi_fenicsx.system.system import System, assemble
from hvi_fenicsx.workflow import prepare

DEMOS = Path(__file__).resolve().parents[1] / "demos"
STEEL = {"model": "plane_stress", "youngs_modulus": 2.15e11, "poisson_ratio": 0.29}
EXACT = "solver={}"


@dataclass(frozen=True)
class Step:
    """One mesh of a hierarchy with its solution; ``refined`` is the refinement that made it (None for the first)."""

    solved: LevelSolution
    refined: refinement.Refinement | None

    @property
    def system(self) -> System:
        return self.solved.system

    @property
    def u(self) -> fem.Function:
        return self.solved.result.u


def steps(scene: Model, count: int) -> list[Step]:
    """A scene on its own mesh and on uniform refinements of it. Collective."""
    prepared = prepare(scene)
    task = prepared.task()
    found = [Step(solve(task, prepared.system), None)]
    for _ in range(count - 1):
        coarse = found[-1].solved
        refined = refinement.uniform(coarse.system.problem.domain)
        system = assemble(refined.domain, task.model, Timer())
        lift, levels = refined_levels(task, system, coarse.system, coarse.levels, refined.transfer)
        start = CoarseStart(system=coarse.system, result=coarse.result, prolongation=lift, levels=levels)
        found.append(Step(solve_from_coarser(task, system, start), refined))
    return found


def distance(step: Step, finer: Sequence[Step]) -> float:
    """|||u_h - u||| for u on the last of the finer meshes. Collective."""
    fine = finer[-1].system.problem
    away = _on_finest(step.u, step, finer)
    away.x.array[:] = finer[-1].u.x.array - away.x.array
    force = fem.assemble_scalar(fem.form(fine.bulk.between(away, away)))
    pressures = zip(
        fine.bulk.averaged,
        step.system.problem.bulk.pressures(step.u),
        fine.bulk.pressures(finer[-1].u),
        strict=True,
    )
    for part, coarse, exact in pressures:
        exact.x.array[:] -= _on_finest(_padded(coarse), step, finer).x.array[:: fine.scales.dimension]
        (scalar,) = part.volume.arguments()
        force += fem.assemble_scalar(fem.form(ufl.replace(part.volume, {scalar: exact * exact}))) / part.modulus
    return float(np.sqrt(MPI.COMM_WORLD.allreduce(force)))


def _padded(scalar: fem.Function) -> fem.Function:
    """A P1 scalar as the first component of a P1 vector field."""
    mesh = scalar.function_space.mesh
    field = fem.Function(displacement_space(mesh, 1))
    field.x.array[:: mesh.geometry.dim] = scalar.x.array
    return field


def _on_finest(u: fem.Function, step: Step, finer: Sequence[Step]) -> fem.Function:
    """A field of P1, or of the displacements' degree, on the last of the finer meshes."""
    x, coarse = u.x.petsc_vec, u.function_space
    for fine_step in finer:
        assert fine_step.refined is not None
        mesh, degree = fine_step.system.problem.space.mesh, nodes.degree(coarse)
        fine = displacement_space(mesh, degree)
        x = fine_step.refined.transfer.prolongation(fine, coarse) * x
        coarse = fine
    result = fem.Function(coarse)
    result.x.array[: x.local_size] = x.array_r
    result.x.scatter_forward()
    return result


@dataclass(frozen=True)
class Row:
    """One mesh of one scene: unknowns, true error (nondimensional), the estimate, whether the solution is certified."""

    dofs: int
    true: float
    estimate: Estimate
    certified: bool

    @property
    def index(self) -> float:
        """Estimated over true error."""
        return self.estimate.total / self.true


def rows(scene: Model, levels: int, extra: int = 2) -> list[Row]:
    """Estimates on refined meshes against the unsmoothed solution ``extra`` refinements further up. Collective."""
    exact = steps(_exact(scene), levels + extra)
    found = exact if scene.solver.smoothing is None else steps(scene, levels)
    return [_row(step, exact[k + 1 :], scene) for k, step in enumerate(found[:levels])]


def _row(step: Step, finer: Sequence[Step], scene: Model) -> Row:
    problem, u = step.system.problem, step.u
    examination = examine(problem, u, scene.solver.tolerance)
    found = estimate(step.system, step.solved.levels, u, examination)
    return Row(step.system.dofs, distance(step, finer), found, examination.certificate.passed)


def _exact(scene: Model) -> Model:
    return scene.with_solver(smoothing=None, epsilon=None, epsilon_absolute=None)


def l_shape() -> dict[str, Any]:
    """A bracket with a re-entrant corner, on a floor."""
    return {
        "domain": {"shape": "l_shape", "size": [1.0, 1.0], "cut": [0.5, 0.5], "mesh_size": 0.12},
        "material": dict(STEEL),
        "boundary": {
            "pull": {"on": "right", "traction": [1e6, 0.0]},
            "wall": {"on": "left", "displacement": [0.0, "free"]},
            "floor": {"on": "bottom", "contact": {"gap": 0.0}},
            "press": {"on": "top", "traction": [0.0, -1e6]},
        },
    }


def rubber(poisson_ratio: float = 0.499) -> dict[str, Any]:
    """A nearly incompressible block on a floor, clamped at its left."""
    return {
        "domain": {"shape": "rectangle", "size": [1.0, 1.0], "cells": [8, 8]},
        "material": {"model": "plane_strain", "youngs_modulus": 1.0e9, "poisson_ratio": poisson_ratio},
        "boundary": {
            "wall": {"on": "left", "displacement": [0.0, 0.0]},
            "press": {"on": "top", "traction": [0.0, "-1e6*(1 + 4*x*(1 - x))"]},
            "floor": {"on": "bottom", "contact": {"gap": 0.0}},
        },
    }


def glued_plate() -> dict[str, Any]:
    """A plate in space, clamped at a side and glued to its base; it is pulled off, and the glue drops."""
    glue = {"law": "graph", "points": [[0, 0], [2e-6, 1e6], [2e-6, 0.4e6]], "one_sided": True}
    return {
        "domain": {"shape": "box", "size": [0.2, 0.2, 0.1], "cells": [2, 2, 1]},
        "material": {"model": "three_dimensional", "youngs_modulus": 2.1e10, "poisson_ratio": 0.3},
        "boundary": {
            "clamp": {"on": "left", "displacement": [0.0, 0.0, 0.0]},
            "pull": {"on": "top", "traction": [0.0, 0.0, 1.2e6]},
            "base": {"on": "bottom", "contact": {"gap": 0.0}, "adhesion": glue},
        },
    }


def waves(cells: list[int], number: float) -> dict[str, Any]:
    """A clamped square in plane strain at ν = 0.44 under a traction in waves shorter than a facet."""
    return {
        "domain": {"shape": "rectangle", "size": [1.0, 1.0], "cells": cells},
        "material": {"model": "plane_strain", "youngs_modulus": 2.15e11, "poisson_ratio": 0.44},
        "boundary": {
            "clamp": {"on": "bottom", "displacement": [0.0, 0.0]},
            "press": {"on": "top", "traction": [0.0, f"-1e6*cos({number}*x)"]},
        },
    }


def square(
    cells: int, pull: float = 0.0, press: str = "-1e6", gap: str = "0", friction: dict[str, Any] | None = None
) -> dict[str, Any]:
    """A square with a wall at its left, on a floor, with one of the data that coarse meshes do not see."""
    floor = {"on": "bottom", "contact": {"gap": gap}} | ({"friction": friction} if friction else {})
    return {
        "domain": {"shape": "rectangle", "size": [1.0, 1.0], "cells": [cells, cells]},
        "material": dict(STEEL),
        "boundary": {
            "wall": {"on": "left", "displacement": [0.0, "free"]},
            "pull": {"on": "right", "traction": [pull, 0.0]},
            "press": {"on": "top", "traction": [0.0, press]},
            "floor": floor,
        },
    }


DEEP_DROP = {"law": "graph", "points": [[0, 0], [9e-6, 3e6], [9e-6, 2e5]]}


def _demo(name: str, *overrides: str) -> Model:
    return read_scene(DEMOS / f"{name}.toml", overrides)


_WIDER = [
    f"domain.{body}.{key}={2 ** (body == 'lower') * size}"
    for body in ("lower", "upper")
    for key, size in (("mesh_size", 0.01), ("mesh_size_below", 5e-4))
]


def scenes() -> dict[str, Model]:
    """By name; meshes are the coarsest of their mesh hierarchies."""
    plane = "domain.cells=[8, 8]"
    return {
        "wall_left": _demo("wall_left", plane, EXACT),
        "wall_left, the paper's S": _demo("wall_left", plane),
        "strong_law": _demo("strong_law", plane),
        "lift_off": _demo("lift_off", plane),
        "pushed_block": _demo("pushed_block", plane),
        "tipping_tower": _demo("tipping_tower", "domain.cells=[4, 16]"),
        "peeling": _demo("peeling", "domain.cells=[75, 3]"),
        "hertz": _demo("hertz", "domain.mesh_size=0.02", "domain.mesh_size_below=2e-3"),
        "thermal_bar": _demo("thermal_bar"),
        "L-shape": read_tables(l_shape()),
        "two_cylinders": _demo("two_cylinders", *_WIDER),
        "single_lap": _demo("single_lap", "domain.lower.cells=[50, 2]", "domain.upper.cells=[64, 2]"),
        "rubber, ν = 0.499": read_tables(rubber()),
        "rubber, ν = 0.4999": read_tables(rubber(0.4999)),
        "deep drop": read_tables(square(16, pull=6e6, friction=DEEP_DROP)),
        "gap 2e-6 sin(25 x)": read_tables(square(4, gap="2e-6*sin(25*x)")),
        "traction 1 + 2 sin(40 x)": read_tables(square(4, press="-1e6*(1 + 2*sin(40*x))")),
        "traction cos(90 x), flat cells": read_tables(waves([4, 16], 90)),
        "traction cos(90 x), tall cells": read_tables(waves([8, 2], 90)),
        "block_3d": _demo("block_3d", "domain.cells=[4, 4, 4]"),
        "anchor_3d": _demo("anchor_3d", "domain.cells=[4, 4, 2]"),
        "glued plate 3D": read_tables(glued_plate()),
    }


def _affordable(scene: Model) -> int:
    """How many levels fit beside their reference, which is two refinements finer."""
    cells, degree = math.prod(getattr(scene.domain, "cells", [1])), scene.solver.degree or 1
    return 5 - degree if scene.dimension == 2 else (3 if cells < 32 else 2 if cells * degree < 100 else 1)


def lines(name: str, found: Sequence[Row]) -> Iterator[str]:
    """Markdown."""
    before: Row | None = None
    for row in found:
        norm = row.estimate.energy_norm
        order = "" if before is None else f"{np.log2(before.true / row.true):.2f}"
        parts = [f"{100 * v / norm:.3g}" for v in (row.true, row.estimate.total, row.estimate.smoothing)]
        mark = "" if row.certified else " (not certified)"
        yield f"| {name}{mark} | {row.dofs} | {' | '.join(parts)} | **{row.index:.2f}** | {order} |"
        before = row


def draw(path: Path, found: dict[str, list[Row]]) -> None:
    """The index against the unknowns."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(8, 4.5), layout="constrained")
    for number, (name, rows_of_scene) in enumerate(found.items()):
        style = {"marker": "osD^vP*"[number % 7], "linestyle": "-" if number < 7 else "--"}
        axes.semilogx([r.dofs for r in rows_of_scene], [r.index for r in rows_of_scene], label=name, **style)
    axes.axhline(1.0, color="black", linewidth=0.8)
    axes.set(xlabel="unknowns", ylabel="estimated over true error", ylim=(0.6, 1.4))
    axes.grid(alpha=0.3)
    figure.legend(loc="outside right center", frameon=False, fontsize=9)
    figure.savefig(path, dpi=120)


def main() -> None:
    """Print the table, draw the picture if one is wanted."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--levels", type=int, default=4)
    parser.add_argument("--scenes", nargs="*", default=list(scenes()))
    parser.add_argument("--degree", type=int, default=1, choices=(1, 2))
    parser.add_argument("--picture", type=Path)
    options = parser.parse_args()
    print("| scene | unknowns | true / % | estimated / % | of it smoothing / % | index | order |")
    print("|---|---|---|---|---|---|---|", flush=True)
    found: dict[str, list[Row]] = {}
    for name in options.scenes:
        scene = scenes()[name].with_solver(degree=options.degree)
        found[name] = rows(scene, min(options.levels, _affordable(scene)))
        print("\n".join(lines(name, found[name])), flush=True)
    if options.picture is not None:
        draw(options.picture, found)


if __name__ == "__main__":
    main()
