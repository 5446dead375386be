"""The lowest energies of small scenes by SCIP, a solver of mixed-integer nonlinear programmes by others.

    ./hvi exec python3 benchmarks/scip_referee.py write problems.npz     the condensed problems, and what is proven
    python3 -m venv scip; scip/bin/pip install pyscipopt numpy           anywhere; it is in no Debian release
    scip/bin/python benchmarks/scip_referee.py solve problems.npz        by SCIP; exit code 1 if energies differ

The scenes are those of `lowest_energies.py` on 2, 4, 6 and 8 cells, and the composite at two loads on 8. SCIP is given
a binary variable for each piece of each law, and an upper bound of the energy, the sum of all quadratic parts.
"""

from __future__ import annotations

import argparse
import importlib
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

CELLS = (2, 4, 6, 8)
GAP = 1e-7
FAR = 100.0
"""Displacements in SCIP's problem, relative to the largest at the lowest point or joint."""


def write(path: Path) -> None:
    """The problems and our lowest energies."""
    import lowest_energies

    import hvi_fenicsx as hvi
    from hvi_fenicsx.stationary_points.condensed_form import scalar_problem
    from hvi_fenicsx.stationary_points.lowest import LowestSearch
    from hvi_fenicsx.system.condensation import Condensation

    arrays: dict[str, Any] = {}
    names: list[str] = []
    for name, table in _scenes(lowest_energies):
        scene = hvi.Scene.model_validate(table)
        problem = scalar_problem(Condensation(hvi.prepare(scene).system).problem)
        search = LowestSearch(problem=problem)
        search.start()
        assert search.run(lambda: False, lambda _: None), name
        names.append(name)
        chains = [(i, *arc) for i, chain in enumerate(problem.chains) for arc in chain]
        arrays |= {f"{name}/{key}": getattr(problem, key) for key in ("stiffness", "force", "lower", "upper")}
        arrays |= {f"{name}/chains": np.array(chains), f"{name}/x": search.x}
        arrays[f"{name}/energy"] = np.array(search.upper - problem.constant)
    np.savez(path, names=np.array(names), **arrays)


def _scenes(families: Any) -> list[tuple[str, dict[str, Any]]]:
    found = [
        (f"{name} {n}", families.square(n, *family))
        for n in CELLS
        for name, family in families.FAMILIES.items()
        if name != "block"  # it tips: there is no lowest energy
    ]
    for pull in (22, 26.2):
        table = families.composite(1e6 * pull)
        table["domain"]["cells"] = [8, 2]
        found.append((f"composite {pull}", table))
    return found


def solve(path: Path, limit: float) -> int:
    """All problems by SCIP; 1 if an energy differs."""
    with np.load(path) as arrays:
        stored = {key: arrays[key] for key in arrays.files}
    differ = 0
    for name in stored["names"]:
        one = {key.rpartition("/")[2]: value for key, value in stored.items() if key.rpartition("/")[0] == name}
        start, ours = time.perf_counter(), float(one["energy"])
        energy, bound = _by_scip(one, limit)
        words = _verdict(ours, energy, bound)
        differ += words == "DIFFERS"
        sizes = (f"{ours:.10g}", f"{energy:.10g}", f"{(energy - bound) / abs(ours):.1e}")
        print(name, len(one["x"]), *sizes, f"{time.perf_counter() - start:.1f}", words, sep="\t", flush=True)
    print(f"{differ} of {len(stored['names'])} differ", file=sys.stderr)
    return int(differ > 0)


def _verdict(ours: float, energy: float, bound: float) -> str:
    """SCIP's point may break its constraints by 1e-9, so its energy may be a little too low."""
    near = 10 * GAP * abs(ours)
    if energy < ours - near or bound > ours + near:
        return "DIFFERS"
    return "agrees" if energy <= ours + near and energy - bound <= near else "open: SCIP's time was over"


def _by_scip(one: dict[str, Any], limit: float) -> tuple[float, float]:
    """The lowest energy and its bound."""
    scip = importlib.import_module("pyscipopt")
    model = scip.Model()
    model.hideOutput()
    model.setParam("limits/gap", GAP)
    model.setParam("timing/clocktype", 1)  # processor time
    model.setParam("limits/time", limit)
    model.setParam("numerics/feastol", 1e-9)
    joints = one["chains"][:, 1:3]
    far = FAR * max(1.0, np.abs(one["x"]).max(), np.abs(joints[np.isfinite(joints)]).max(initial=0.0))
    n = len(one["x"])
    low, high = np.maximum(one["lower"], -far), np.minimum(one["upper"], far)
    x = [model.addVar(lb=float(low[i]), ub=float(high[i])) for i in range(n)]
    s, f = one["stiffness"], one["force"]
    total = scip.quicksum(0.5 * s[i, j] * x[i] * x[j] for i in range(n) for j in range(n))
    total -= scip.quicksum(f[i] * x[i] for i in range(n))
    for i in range(n):
        total += _law(model, scip, x[i], one["chains"][one["chains"][:, 0] == i, 1:], (low[i], high[i]))
    energy = model.addVar(lb=None)
    model.addCons(total <= energy)
    model.setObjective(energy)
    model.optimize()
    return float(model.getPrimalbound()), float(model.getDualbound())


def _law(model: Any, scip: Any, x: Any, arcs: Any, ends: tuple[float, float]) -> Any:
    """The energy of one unknown's law: its arcs with a binary and a displacement each, zero on the others."""
    if len(arcs) == 1 and not arcs[0, 3:].any():
        return 0.0
    inside = [a for a in arcs if a[0] < ends[1] and a[1] > ends[0]]
    chosen, parts, terms = [], [], []
    for low, high, anchor, value, traction, slope in inside:
        here, part = model.addVar(vtype="B"), model.addVar(lb=None)
        model.addCons(part >= (max(low, ends[0]) - anchor) * here)
        model.addCons(part <= (min(high, ends[1]) - anchor) * here)
        chosen.append(here)
        parts.append(part + anchor * here)
        terms.append(value * here + traction * part + 0.5 * slope * part * part)
    model.addCons(scip.quicksum(chosen) == 1)
    model.addCons(scip.quicksum(parts) == x)
    return scip.quicksum(terms)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("what", choices=("write", "solve"))
    parser.add_argument("file", type=Path)
    parser.add_argument("--limit", type=float, default=60.0, help="seconds of processor time for each problem")
    options = parser.parse_args()
    if options.what == "solve":
        return solve(options.file, options.limit)
    write(options.file)
    return 0


if __name__ == "__main__":
    sys.exit(main())
