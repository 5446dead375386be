"""The price of an effect: what each adds to assembly, solve and memory; and that an absent one adds nothing.

    ./hvi exec python3 benchmarks/price_of_effects.py [--cells 512] [--repeats 3] [--cpu]

Every scene but the first two differs from the base by the effects in its name only. They take the solver that a user
gets (multigrid on the mesh hierarchy from a few thousand unknowns). The base by MUMPS stands beside the same work
"by hand": mesh, forms, conditions and solver in plain dolfinx, nothing of this program. Each run has a process of its
own (its peak memory is then its own), after a small one that loads the libraries and fills the JIT cache.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any

import common

LAW = {"law": "quadratic_linear", "gamma1": 1.0e3, "gamma2": 0.5e3, "delta": 9.0e-6}
SPRING = {"law": "linear_spring", "stiffness": 1.0e12}
HAND, DIRECT, BASE = "base by hand, MUMPS", "base, MUMPS", "base"
CASES: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    # what acts on the bottom, and in the body
    DIRECT: ({}, {}),
    BASE: ({}, {}),
    "+ body force": ({}, {"force": [0.0, -1.0e5]}),
    "+ thermal strain": ({}, {"temperature": 20.0}),
    "+ elastic support": ({"support": SPRING}, {}),
    "+ friction": ({"friction": LAW}, {}),
    "+ contact": ({"contact": {"gap": 0.0}}, {}),
    "+ contact, friction": ({"contact": {"gap": 0.0}, "friction": LAW}, {}),
    "+ contact, friction, adhesion": ({"contact": {"gap": 0.0}, "friction": LAW, "adhesion": LAW}, {}),
}


def scene(name: str, cells: int) -> dict[str, Any]:
    """A square clamped at its left, pulled and pressed."""
    floor, body = CASES[name]
    material = {"model": "plane_stress", "youngs_modulus": 2.15e11, "poisson_ratio": 0.29, "thermal_expansion": 1e-5}
    return {
        "domain": {"shape": "rectangle", "size": [1.0, 1.0], "cells": [cells, cells]},
        "material": material,
        "body": body,
        "boundary": {
            "wall": {"on": "left", "displacement": [0.0, 0.0]},
            "pull": {"on": "right", "traction": [1.0e6, 0.0]},
            "press": {"on": "top", "traction": [0.0, -1.0e6]},
        }
        | ({"floor": {"on": "bottom", **floor}} if floor else {}),
        "solver": {"linear_solver": "lu"} if name == DIRECT else {},
    }


def once(name: str, cells: int, clock: Callable[[], float]) -> dict[str, float]:
    """Compiled integrals, seconds of assembly and solve, and peak memory in MB, of one scene in this process."""
    solve = by_hand if name == HAND else by_program
    solve(name, min(cells, 16), clock)
    found = solve(name, cells, clock)
    return {**found, "memory": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**10}


def integrals(forms: list[Any]) -> int:
    """Those in the C code."""
    return sum(form.ufcx_form.form_integral_offsets[3] for form in forms)


def by_program(name: str, cells: int, clock: Callable[[], float]) -> dict[str, float]:
    """Assembly holds the composition of the forms, the solve its setup and the coarser levels."""
    import dolfinx
    from mpi4py import MPI

    from hvi_fenicsx import Scene
    from hvi_fenicsx.runtime.timing import Timer
    from hvi_fenicsx.scene_model import model_of, options_of
    from hvi_fenicsx.solvers import nested_iteration
    from hvi_fenicsx.solvers.context import RunControl
    from hvi_fenicsx.system import existence
    from hvi_fenicsx.system.assemble import assemble

    forms, make = [], dolfinx.fem.form

    def counted(*words: Any, **keys: Any) -> Any:
        forms.append(make(*words, **keys))
        return forms[-1]

    wanted = Scene.model_validate(scene(name, cells))
    body = wanted.domain.build(MPI.COMM_WORLD, wanted.dimension)
    dolfinx.fem.form = counted
    start = clock()
    model = model_of(wanted)
    system = assemble(body, model, Timer())
    assembled = clock()
    dolfinx.fem.form = make
    verdict, control = existence.solvability(system.problem, system.forces), RunControl(timer=Timer())
    found = nested_iteration.solve(model, system, verdict, options_of(wanted.solver), control).result
    if not found.converged:
        raise SystemExit(f"{name}: {found.reason}")
    return {"integrals": integrals(forms), "assembly": assembled - start, "solve": clock() - assembled}


def by_hand(_: str, cells: int, clock: Callable[[], float]) -> dict[str, float]:
    """The base as its user would write it."""
    import dolfinx
    import ufl
    from dolfinx import fem
    from mpi4py import MPI

    mesh = dolfinx.mesh.create_rectangle(MPI.COMM_WORLD, [[0, 0], [1, 1]], [cells, cells])
    start = clock()
    space = fem.functionspace(mesh, ("Lagrange", 1, (2,)))
    u, v = ufl.TrialFunction(space), ufl.TestFunction(space)
    strain, nu = ufl.sym(ufl.grad(u)), fem.Constant(mesh, 0.29)
    stress = (strain + nu / (1 - nu) * ufl.tr(strain) * ufl.Identity(2)) / (1 + nu)
    ds, load = ufl.Measure("ds", domain=mesh, subdomain_data=loaded_sides(mesh)), fem.Constant(mesh, 1.0)
    a = fem.form(ufl.inner(stress, ufl.sym(ufl.grad(v))) * ufl.dx)
    b = fem.form(load * v[0] * ds(0) - load * v[1] * ds(1))
    matrix, right = system_by_hand(space, a, b)
    assembled = clock()
    solve_by_hand(matrix, right)
    return {"integrals": integrals([a, b]), "assembly": assembled - start, "solve": clock() - assembled}


def side(mesh: Any, axis: int, at: float) -> Any:
    """Facets of the side x[axis] = at."""
    import dolfinx
    import numpy as np

    return dolfinx.mesh.locate_entities_boundary(mesh, 1, lambda x: np.isclose(x[axis], at))


def loaded_sides(mesh: Any) -> Any:
    """Tags: 0 on the right, 1 on the top."""
    import dolfinx
    import numpy as np

    facets = [side(mesh, 0, 1.0), side(mesh, 1, 1.0)]
    numbers = np.repeat(np.arange(2, dtype=np.int32), [len(f) for f in facets])
    return dolfinx.mesh.meshtags(mesh, 1, np.concatenate(facets), numbers)


def system_by_hand(space: Any, a: Any, b: Any) -> tuple[Any, Any]:
    """Matrix and right-hand side of a body that is held on the left."""
    import numpy as np
    from dolfinx import fem
    from dolfinx.fem import petsc

    left = fem.locate_dofs_topological(space, 1, side(space.mesh, 0, 0.0))
    held = [fem.dirichletbc(np.zeros(2), left, space)]
    matrix = petsc.assemble_matrix(a, held)
    matrix.assemble()
    right = petsc.assemble_vector(b)
    petsc.apply_lifting(right, [a], [held])
    petsc.set_bc(right, held)
    return matrix, right


def solve_by_hand(matrix: Any, right: Any) -> None:
    """Factorise by MUMPS and solve."""
    from petsc4py import PETSc

    ksp = PETSc.KSP().create(matrix.comm)
    matrix.setOption(PETSc.Mat.Option.SPD, True)
    ksp.setOperators(matrix)
    ksp.setType("preonly")
    ksp.getPC().setType("cholesky")
    ksp.getPC().setFactorSolverType("mumps")
    ksp.solve(right, matrix.createVecRight())


def measured(options: argparse.Namespace) -> dict[str, dict[str, float]]:
    """Medians by scene; the scenes in turn, so that a disturbance hits all of them."""
    runs: dict[str, list[dict[str, float]]] = {name: [] for name in (HAND, *CASES)}
    for _ in range(options.repeats):
        for name, found in runs.items():
            words = [sys.executable, __file__, "--one", name, "--cells", str(options.cells)]
            words += ["--cpu"] if options.cpu else []
            done = subprocess.run(words, check=True, capture_output=True, text=True, timeout=options.limit)
            found.append(json.loads(done.stdout.splitlines()[-1]))
            common.say(f"{name}: {found[-1]}")
    return {name: {k: common.median(r, lambda m, k=k: m[k]) for k in r[0]} for name, r in runs.items()}


def row(name: str, found: dict[str, float], less: dict[str, float]) -> list[str]:
    """Absolute figures; with + what is added to the base."""
    if not name.startswith("+"):
        less = dict.fromkeys(found, 0.0)
    form = {"integrals": ".0f", "assembly": ".2f", "solve": ".2f", "memory": ".0f"}
    return [name, *(f"{found[k] - less[k]:{'+' if name.startswith('+') else ''}{f}}" for k, f in form.items())]


def words(options: argparse.Namespace) -> str:
    """What the table shows."""
    return (
        f"{options.cells} × {options.cells} cells, one rank, medians of {options.repeats}. The base is a plane square, "
        "clamped at its left side, pulled and pressed:\nisotropic elasticity, two tractions, one prescribed "
        "displacement. A line with + shows what the named effects add to\nthe base, in the body or on its bottom. All "
        "use the solver "
        "that the program chooses by default. Assembly\nincludes composing the forms (with a filled cache of compiled "
        "forms), and the solve includes its setup and the coarser levels.\nMemory is the peak of the process."
    )


def absent(found: dict[str, dict[str, float]]) -> str:
    """The proof that what is not named costs nothing."""
    own, hand = found[DIRECT], found[HAND]
    total = [m["assembly"] + m["solve"] for m in (own, hand)]
    return (
        f"The base has no contact, no law and no body force. It compiles {own['integrals']:.0f} integrals, and the "
        f"script written by hand {hand['integrals']:.0f}:\nthe stiffness and the two tractions. With the same direct "
        f"solver the base takes {total[0]:.2f} s and the script {total[1]:.2f} s:\na ratio of "
        f"{total[0] / total[1]:.2f} "
        f"(assembly {own['assembly']:.2f} and {hand['assembly']:.2f} s, "
        f"solve {own['solve']:.2f} and {hand['solve']:.2f} s)."
    )


def draw(found: dict[str, dict[str, float]], options: argparse.Namespace) -> None:
    """Bars of assembly and, on top, solve; those of the direct solver are in the text."""
    from matplotlib import pyplot

    names = [name for name in found if name not in (HAND, DIRECT)][::-1]
    figure, axes = pyplot.subplots(figsize=(8, 3.6))
    assembly, solve = ([found[n][k] for n in names] for k in ("assembly", "solve"))
    axes.barh(names, assembly, color="#0072B2", label="assembly")
    axes.barh(names, solve, left=assembly, color="#E69F00", label="solve")
    axes.set_xlabel(f"{'processor' if options.cpu else 'wall'} time / s, {options.cells} × {options.cells} cells")
    axes.legend(frameon=False, loc="upper right")
    axes.spines[["top", "right"]].set_visible(False)
    common.picture("price-of-effects", figure)


def main() -> None:
    """Measure, print the table, write page and picture."""
    parser = common.parser(__doc__)
    parser.add_argument("--cells", type=int, default=512)
    parser.add_argument("--one", choices=[HAND, *CASES], help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        print(json.dumps(once(options.one, options.cells, time.process_time if options.cpu else time.perf_counter)))
        return
    found = measured(options)
    head = ["effects", "compiled integrals", "assembly / s", "solve / s", "memory / MB"]
    table = common.table(head, [row(name, m, found[BASE]) for name, m in found.items()])
    draw(found, options)
    title = "The price of an effect"
    common.document("price-of-effects", title, [words(options), table, absent(found)], options)


if __name__ == "__main__":
    main()
