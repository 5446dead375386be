"""Degree 2: the rule on Γc in space, the pressure, what it saves, penetration between nodes, iterations towards ν = ½.

    ./hvi exec python3 benchmarks/degree_two.py rules|pressure|block|strip|hertz|dips|rubber|starts|factors

Energies decide: the square root of the relative error of the energy is the relative error in the energy norm, but for
what the rule on Γc adds to the energy.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from mpi4py import MPI

import hvi_fenicsx as hvi
from hvi_fenicsx.mesh.thresholds import Thresholds
from hvi_fenicsx.problem import contact_surface, spaces
from hvi_fenicsx.runtime.timing import Timer
from hvi_fenicsx.scene_model import model_of, options_of
from hvi_fenicsx.solvers import nested_iteration
from hvi_fenicsx.solvers.active_set import ActiveSetSolver
from hvi_fenicsx.solvers.closed_start import resting_start
from hvi_fenicsx.solvers.context import RunControl
from hvi_fenicsx.solvers.thresholds import Thresholds as SolverThresholds
from hvi_fenicsx.system import factor_counts
from hvi_fenicsx.system.assemble import assemble
from hvi_fenicsx.system.factorisation import FactorForm, Factorisation, SaddlePointForm
from hvi_fenicsx.system.linear_settings import LinearSettings
from hvi_fenicsx.system.thresholds import Thresholds as LinearThresholds
from hvi_fenicsx.workflow import Thresholds as RunThresholds

SHARES = (0.02, 0.05, 0.1, 0.125, 0.2, 0.25)
OWN = spaces.EDGE_SHARE[3]
_make_surface = contact_surface.make_surface
STEEL = {"model": "plane_stress", "youngs_modulus": 2.15e11, "poisson_ratio": 0.29}
RUBBER = {"model": "three_dimensional", "youngs_modulus": 1e7, "poisson_ratio": 0.3}
SPRING = {"law": "graph", "points": [[0, 0], [1.0, 1e8]]}


def _untransformed(part: str, space: Any, *data: Any) -> Any:
    """The surface with the lumped areas of the once refined facets (1/12 and 1/4), in Lagrange's basis."""
    if space.dofmap.list.shape[1] == 4:
        return _make_surface(part, space, *data)
    with_share(0.125)
    like = spaces.displacement_space(space.mesh, 2)
    with_share(0.0)
    return _make_surface(part, like, *data)


def with_share(share: float) -> None:
    """The transformed basis with another share."""
    spaces._transformed.cache_clear()
    spaces.EDGE_SHARE[3] = share


def with_rule(name: str | float) -> None:
    """A rule on Γc in space: the share of an edge's function, or ``lagrange``."""
    with_share(0.0 if isinstance(name, str) else name)
    contact_surface.make_surface = _untransformed if isinstance(name, str) else _make_surface


def box(
    cells: Sequence[int], height: float, top: Any, floor: dict[str, Any], *, closed: bool = False
) -> dict[str, Any]:
    """A block between planes of symmetry; closed: on four sides."""
    sides = {"left": 0, "front": 1} | ({"right": 0, "back": 1} if closed else {})
    held = {
        side: {"on": side, "displacement": [0.0 if i == axis else "free" for i in range(3)]}
        for side, axis in sides.items()
    }
    return {
        "domain": {"shape": "box", "size": [1.0, 1.0, height], "cells": list(cells)},
        "material": RUBBER,
        "boundary": held | {"top": {"on": "top", "traction": [0.0, 0.0, top]}, "floor": {"on": "bottom", **floor}},
    }


def solved(table: dict[str, Any], degree: int) -> hvi.ModelSolution:
    """The solution, certified."""
    found = hvi.solve(hvi.Scene.model_validate(table), degree=degree, estimate=False)
    assert found.converged
    return found


def ball(cells: Sequence[int], height: float, *, closed: bool) -> dict[str, Any]:
    """The quarter of a block above a paraboloid."""
    return box(cells, height, -5e4, {"contact": {"gap": "(x*x + y*y)/20"}}, closed=closed)


def rules() -> None:
    """Patch tests by contact and by a law, and energies of a bonded and of a touching block in space, by rule."""
    for name in ("lagrange", *SHARES):
        with_rule(name)
        found = [
            solved(box([3, 3, 3], 1.0, sign * 1e5, floor), 2).contact["floor"].pressure
            for sign, floor in ((-1, {"contact": {"gap": 0.0}}), (1, {"adhesion": SPRING}))
        ]
        print(f"{name}: spread of a uniform pressure {', '.join(f'{np.ptp(p) / 1e5:.1e}' for p in found)}", flush=True)
    scenes: dict[str, Callable[[int], dict[str, Any]]] = {
        "bond": lambda n: box([n, n, n // 2], 0.5, "1e5*cos(3*x)*cos(2*y)", {"adhesion": SPRING}),
        "ball": lambda n: ball([n, n, n // 2], 0.5, closed=False),
    }
    for scene, table in scenes.items():
        with_rule(0.05)
        fine = solved(table(16), 2).energy
        for name in ("lagrange", *SHARES):
            with_rule(name)
            print(f"{scene}, {name}: {_errors([solved(table(n), 2).energy for n in (2, 4, 8)], fine)}", flush=True)


def _errors(energies: Sequence[float], fine: float) -> str:
    return " ".join(f"{np.sqrt(abs(e / fine - 1)):.2e}" for e in energies)


def from_ellipse(points: Any, p: Any) -> Any:
    """How far pressures (m,) at points (m, 3) are from the best a √(1 - r²/b²) (1 + c r²), over a, within 0.75 b."""
    from scipy.optimize import least_squares

    r = np.hypot(points[:, 0], points[:, 1])
    radius = r[p > 0.05 * p.max()].max()
    near = r < 0.75 * radius

    def away(q: Any) -> Any:
        return q[0] * np.sqrt(np.maximum(1 - (r[near] / q[1]) ** 2, 0)) * (1 + q[2] * r[near] ** 2) - p[near]

    scales = [p.max(), radius, 1.0]
    fit = least_squares(away, [p.max(), radius, 0.0], x_scale=scales).x
    return away(fit) / fit[0]


def pressure() -> None:
    """The pressure under a ball in space beside the best ellipse, with the same unknowns."""
    for degree, name, cells in [(1, OWN, 20), (2, "lagrange", 10), *((2, share, 10) for share in SHARES)]:
        with_rule(name)
        part = solved(ball([cells] * 3, 1.0, closed=True), degree).contact["floor"]
        away = from_ellipse(part.x, part.pressure)
        rms = np.sqrt(np.mean(away**2))
        print(f"degree {degree}, {name}: away from the ellipse {rms:.2e}, at most {abs(away).max():.2e}", flush=True)
    with_rule(OWN)


def lifting(cells: int) -> dict[str, Any]:
    """A square that lifts off."""
    return {
        "domain": {"shape": "rectangle", "size": [1.0, 1.0], "cells": [cells, cells]},
        "material": STEEL,
        "boundary": {
            "wall": {"on": "left", "displacement": [0.0, "free"]},
            "pull": {"on": "right", "traction": [1e6, 0.0]},
            "press": {"on": "top", "traction": [0.0, "-1e6*(1 - 1.8*x)"]},
            "floor": {"on": "bottom", "contact": {"gap": 0.0}},
        },
    }


def block() -> None:
    """The square that lifts off: error by unknowns."""
    fine = solved(lifting(256), 2).energy
    for degree, meshes in ((1, (16, 32, 64, 128)), (2, (8, 16, 32, 64))):
        found = [solved(lifting(n), degree) for n in meshes]
        print(f"degree {degree}: unknowns {[s.dofs for s in found]}, {_errors([s.energy for s in found], fine)}")


def strip_of(cells: tuple[int, int], degree: int) -> hvi.ModelSolution:
    """An adhesive strip, its arm free over 90 mm, on a linear bond."""
    scene = hvi.read_scene("benchmarks/strip.toml", [f"domain.cells={list(cells)}", f"solver.degree={degree}"])
    return hvi.solve(scene, estimate=False)


def strip() -> None:
    """The strip: error by unknowns."""
    fine = strip_of((600, 20), 2).energy
    print(f"energy {fine:.10g}")
    for degree, meshes in ((1, ((150, 6), (300, 12), (600, 24))), (2, ((50, 2), (100, 3), (150, 4), (300, 8)))):
        found = [strip_of(cells, degree) for cells in meshes]
        print(f"degree {degree}: unknowns {[s.dofs for s in found]}, {_errors([s.energy for s in found], fine)}")


def hertz() -> None:
    """Hertz' half-disk: the pressure away from the best half ellipse, and its largest value, by degree."""
    for degree, size in ((1, 0.25e-3), (2, 0.5e-3), (1, 0.5e-3)):
        scene = hvi.read_scene("demos/hertz.toml", [f"domain.mesh_size_below={size}", f"solver.degree={degree}"])
        found = hvi.solve(scene, estimate=False)
        part = found.contact["floor"]
        x, p = part.x[:, 0] - 0.0, part.pressure
        inside = p > 0.3 * p.max()
        (a, b), *_ = np.linalg.lstsq(
            np.column_stack([np.ones(inside.sum()), x[inside] ** 2]), p[inside] ** 2, rcond=None
        )
        away = p[inside] / np.sqrt(np.maximum(a + b * x[inside] ** 2, 0)) - 1
        print(
            f"degree {degree}, {found.dofs} unknowns: largest of the ellipse {np.sqrt(a) / 1e3:.4g} kPa, half-width "
            f"{np.sqrt(-a / b) * 1e3:.4g} mm, away from it {np.sqrt(np.mean(away**2)):.1e}, at most "
            f"{abs(away).max():.1e}"
        )


def dips() -> None:
    """The largest penetration between nodes over the largest displacement, by mesh."""
    scenes: dict[str, tuple[Callable[[int], dict[str, Any]], Sequence[int]]] = {
        "square": (lifting, (8, 16, 32, 64, 128)),
        "ball": (lambda n: ball([n] * 3, 1.0, closed=True), (4, 8, 12)),
    }
    for name, (table, meshes) in scenes.items():
        for cells in meshes:
            found = solved(table(cells), 2)
            assert found.solve_result is not None
            assert found.examination is not None
            most = np.abs(found.solve_result.u.x.array).max()
            print(f"{name}, {cells} cells: {(found.examination.between_nodes or 0.0) / most:.1e}", flush=True)


def rubber() -> None:
    """Iterations of a linear solve to 1e-8, contact closed, by Poisson's ratio; CPU time of it and of a factorisation.

    Multigrid for displacements (mg), for displacements and pressures (mixed), and algebraic multigrid (gamg).
    """
    every = ((2, 1, 64), (2, 1, 128), (2, 1, 256), (3, 1, 16), (3, 1, 24))
    for dimension, degree, cells in (*every, (2, 2, 32), (2, 2, 64), (2, 2, 128), (3, 2, 8), (3, 2, 12)):
        small = cells in (32, 64)
        ratios = (0.3, 0.45, 0.49) if degree == 1 else (0.3, 0.499, 0.4999, 0.499999)
        for nu in (0.3, 0.45, 0.49, 0.499, 0.4999, 0.499999) if small else ratios:
            scene = hvi.Scene.model_validate(pressed(dimension, degree, cells, nu))
            kinds = [kind for kind in ("gamg", "mg", "mixed", "lu") if suits(kind, nu, degree, small=small)]
            found = ", ".join("{} {} ({:.2g} s)".format(kind, *iterations(scene, kind)) for kind in kinds)
            print(f"{dimension}D, degree {degree}, {cells} cells a side, ν = {nu}: {found}", flush=True)


def starts() -> None:
    """A contact problem at ν = 0.4999 from a start of degree 1: solved directly, or that of a softer body."""
    for dimension, cells in ((2, 64), (2, 128), (3, 16), (3, 20)):
        scene = hvi.Scene.model_validate(pressed(dimension, 2, cells, 0.4999))
        for name, largest in (("direct", 10**9), ("softer", 0)):
            linear = LinearThresholds(largest_rubber=dict.fromkeys((2, 3), largest))
            thresholds, begun = RunThresholds(solvers=SolverThresholds(linear=linear)), time.process_time()
            found = hvi.solve(scene, thresholds=thresholds, estimate=False)
            seconds, result = time.process_time() - begun, found.solve_result
            assert result is not None
            assert found.examination is not None
            print(
                f"{dimension}D, {found.dofs} unknowns, {name} start: {result.counts.linear} linear iterations, "
                f"{seconds:.1f} s, energy {found.examination.energy:.10g}",
                flush=True,
            )


def factors() -> None:
    """Factors at ν = 0.4999 with averaged pressures as unknowns over those of the displacements' matrix."""
    for dimension, degree, cells in ((2, 1, 64), (3, 1, 12), (2, 2, 64), (2, 2, 128), (3, 2, 8)):
        scene = hvi.Scene.model_validate(pressed(dimension, degree, cells, 0.4999))
        domain = scene.domain.build_hierarchy(MPI.COMM_WORLD, scene.dimension, Thresholds())
        system = assemble(domain, model_of(scene), Timer())
        counts, seconds = zip(*(_factorised(form(system)) for form in (SaddlePointForm, FactorForm)), strict=True)
        print(
            f"{dimension}D, degree {degree}, {system.dofs:,} unknowns: {counts[0]:.3g} numbers instead of "
            f"{counts[1]:.3g}, CPU {seconds[0]:.2g} s instead of {seconds[1]:.2g} s",
            flush=True,
        )


def _factorised(form: FactorForm) -> tuple[float, float]:
    """Numbers in the factors, and CPU seconds of the factorisation."""
    made = Factorisation(form, form.matrix())
    begun = time.process_time()
    made.factorise(form.system.jacobian.rows.dofs)
    return factor_counts.entries(made.pc), time.process_time() - begun


def suits(kind: str, nu: float, degree: int, *, small: bool) -> bool:
    """Whether a solver is measured: what takes minutes is left out."""
    if degree == 1 and not small:
        return kind == "mg"
    if kind == "mixed":
        return nu > 0.45
    return kind == "mg" if nu <= 0.45 and not small else nu < 0.49995 and (small or kind == "lu")


def pressed(dimension: int, degree: int, cells: int, nu: float) -> dict[str, Any]:
    """A square or cube between smooth walls, pressed askew onto a floor."""
    free: list[Any] = ["free"] * dimension
    walls = {
        side: [*free[:axis], 0.0, *free[axis + 1 :]] for axis, side in enumerate(("left", "front")[: dimension - 1])
    }
    return {
        "domain": {
            "shape": ("rectangle", "box")[dimension - 2],
            "size": [1.0] * dimension,
            "cells": [cells] * dimension,
        },
        "material": {
            "model": ("plane_strain", "three_dimensional")[dimension - 2],
            "youngs_modulus": 1e9,
            "poisson_ratio": nu,
        },
        "boundary": {
            **{side: {"on": side, "displacement": held} for side, held in walls.items()},
            "press": {"on": "top", "traction": ["1e5*x", *[0.0] * (dimension - 2), "-1e6*(1.2 - 0.8*x)"]},
            "floor": {"on": "bottom", "contact": {"gap": 0.0}},
        },
        "solver": {"degree": degree},
    }


def iterations(scene: hvi.Scene, kind: Any) -> tuple[int, float]:
    """The linear iterations, contact closed, and the CPU time."""
    timer = Timer()
    domain = scene.domain.build_hierarchy(MPI.COMM_WORLD, scene.dimension, Thresholds())
    system, options = assemble(domain, model_of(scene), timer), options_of(scene.solver)
    levels = nested_iteration.coarser_levels(model_of(scene), system, options, RunControl(timer=timer))
    begun = time.process_time()
    solver = ActiveSetSolver(system, levels if kind in ("mg", "mixed") else (), LinearSettings(kind), timer)
    return resting_start(solver, [], 1e-8)[1], time.process_time() - begun


if __name__ == "__main__":
    {f.__name__: f for f in (rules, pressure, block, strip, hertz, dips, rubber, starts, factors)}[sys.argv[1]]()
