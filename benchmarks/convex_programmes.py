"""The convex programmes of proofs of the lowest energy, by our active set method and by quadratic solvers of others.

    ./hvi exec python3 benchmarks/convex_programmes.py write programmes.npz     some programmes of each scene
    python3 -m venv qp; qp/bin/pip install daqp piqp osqp highspy numpy scipy   anywhere
    qp/bin/python benchmarks/convex_programmes.py solve programmes.npz          by the others

A chain of arcs is given to these solvers as one bounded variable for each arc, of which the unknown is the sum.
Columns: scene, solver, programmes, unknowns, variables, processor time of one programme in ms, largest difference of
the values relative to the sum of their parts, programmes that failed.
"""

from __future__ import annotations

import argparse
import importlib
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

SCENES = (("drop", 16), ("drop", 64), ("teeth", 32), ("lift-off", 64))
MOST = 40
"""Programmes of each scene."""


def write(path: Path) -> None:
    """Programmes as they come up, with our value and time."""
    import lowest_energies as families

    import hvi_fenicsx as hvi
    from hvi_fenicsx.stationary_points import relaxation
    from hvi_fenicsx.stationary_points.condensed_form import scalar_problem
    from hvi_fenicsx.stationary_points.lowest import LowestSearch
    from hvi_fenicsx.system.condensation import Condensation

    ours, rows = relaxation.minimise, []

    def recorded(a: Any, b: Any, chains: Any, start: Any, *further: Any) -> Any:
        begin = time.process_time()
        found = ours(a, b, chains, start, *further)
        seconds, x = time.process_time() - begin, found.x
        rows.append((a, b, chains, 0.5 * x @ a @ x - b @ x + chains.energy(x).sum(), seconds))
        return found

    relaxation.minimise = recorded
    arrays: dict[str, Any] = {}
    for family, cells in SCENES:
        rows.clear()
        scene = hvi.Scene.model_validate(families.square(cells, *families.FAMILIES[family]))
        search = LowestSearch(problem=scalar_problem(Condensation(hvi.prepare(scene).system).problem), gap=1e-8)
        search.start()
        search.run(lambda: len(rows) >= MOST, lambda _: None)
        for k, (a, b, chains, value, seconds) in enumerate(rows[:MOST]):
            name = f"{family} {cells}/{k}"
            arrays |= {f"{name}/a": a, f"{name}/b": b, f"{name}/ours": np.array([value, seconds])}
            arrays[f"{name}/arcs"] = np.array(list(_arcs(chains)))
    np.savez_compressed(path, **arrays)


def _arcs(chains: Any) -> Any:
    """Unknown, begin, end, energy, traction and slope at the begin, of each arc."""
    for i, k in np.ndindex(*chains.slopes.shape):
        low, high = chains.ends[i, k], chains.ends[i, k + 1]
        if np.isfinite(low) and np.isfinite(high):
            d = low - chains.anchors[i, k]
            traction = chains.tractions[i, k] + chains.slopes[i, k] * d
            energy = chains.values[i, k] + 0.5 * (chains.tractions[i, k] + traction) * d
            yield i, low, high, energy, traction, chains.slopes[i, k]


def _programme(a: Any, b: Any, arcs: Any) -> tuple[Any, Any, Any, float, float]:
    """Hessian, linear part and upper bounds of the variables, a constant, and the sum of the sizes of its parts."""
    owner = arcs[:, 0].astype(int)
    first = np.unique(owner, return_index=True)[1]
    start = arcs[first, 1]
    hessian = a[np.ix_(owner, owner)] + np.diag(arcs[:, 5])
    linear = (a @ start - b)[owner] + arcs[:, 4]
    constant = 0.5 * start @ a @ start - b @ start + arcs[first, 3].sum()
    size = 0.5 * np.abs(start) @ np.abs(a) @ np.abs(start) + np.abs(b) @ np.abs(start) + np.abs(arcs[first, 3]).sum()
    return hessian, linear, arcs[:, 2] - arcs[:, 1], float(constant), float(size)


def _by_daqp(h: Any, f: Any, upper: Any) -> Any:
    daqp = importlib.import_module("daqp")
    n = len(f)
    options = {"eps_prox": 1e-6 * float(np.trace(h)) / n}  # the Hessian is singular
    found = daqp.solve(h, f, np.empty((0, n)), upper, np.zeros(n), np.zeros(n, dtype=np.int32), **options)
    return found[0] if found[2] > 0 else None


def _by_piqp(h: Any, f: Any, upper: Any) -> Any:
    piqp = importlib.import_module("piqp")
    solver = piqp.DenseSolver()
    solver.settings.eps_abs, solver.settings.eps_rel = 1e-10, 1e-12
    solver.setup(h, f, x_l=np.zeros(len(f)), x_u=upper)
    return np.clip(solver.result.x, 0.0, upper) if solver.solve() == piqp.PIQP_SOLVED else None


def _by_osqp(h: Any, f: Any, upper: Any) -> Any:
    osqp, sparse = importlib.import_module("osqp"), importlib.import_module("scipy.sparse")
    solver = osqp.OSQP()
    eye = sparse.eye(len(f), format="csc")
    limits = {"eps_abs": 1e-9, "eps_rel": 1e-9, "max_iter": 20_000, "verbose": False, "polishing": True}
    solver.setup(sparse.csc_matrix(np.triu(h)), f, eye, np.zeros(len(f)), upper, **limits)
    found = solver.solve()
    return np.clip(found.x, 0.0, upper) if found.info.status == "solved" else None


def _by_highs(h: Any, f: Any, upper: Any) -> Any:
    highs = importlib.import_module("highspy")
    model, n = highs.Highs(), len(f)
    model.setOptionValue("output_flag", False)
    for k in range(n):
        model.addVar(0.0, float(upper[k]))
        model.changeColCost(k, float(f[k]))
    values = [(i, h[i, k]) for k in range(n) for i in range(k, n)]
    begins = np.concatenate([[0], np.cumsum(np.arange(n, 0, -1))])[:-1].astype(np.int32)
    rows, entries = np.array([i for i, _ in values], dtype=np.int32), np.array([v for _, v in values])
    model.passHessian(n, len(values), 1, begins, rows, entries)
    model.setOptionValue("time_limit", 10.0)
    model.run()
    solved = model.getModelStatus() == highs.HighsModelStatus.kOptimal
    return np.clip(model.getSolution().col_value, 0.0, upper) if solved else None


OTHERS: dict[str, Callable[[Any, Any, Any], Any]] = {
    "DAQP": _by_daqp,
    "PIQP": _by_piqp,
    "OSQP": _by_osqp,
    "HiGHS": _by_highs,
}


def solve(path: Path) -> None:
    """One line for each scene and solver."""
    with np.load(path) as arrays:
        stored = {key: arrays[key] for key in arrays.files}
    for scene in dict.fromkeys(key.split("/")[0] for key in stored):
        numbers = sorted({int(key.split("/")[1]) for key in stored if key.startswith(f"{scene}/")})
        cases = [{k: stored[f"{scene}/{i}/{k}"] for k in ("a", "b", "arcs", "ours")} for i in numbers]
        sizes = (len(cases[0]["b"]), max(len(c["arcs"]) for c in cases))
        print(scene, "ours", len(cases), *sizes, f"{1e3 * np.mean([c['ours'][1] for c in cases]):.3f}", 0, 0, sep="\t")
        for name, solver in OTHERS.items():
            print(scene, name, len(cases), *sizes, *_measured(solver, cases), sep="\t", flush=True)


def _measured(solver: Callable[[Any, Any, Any], Any], cases: list[dict[str, Any]]) -> tuple[str, str, int]:
    """Milliseconds of one programme, the largest difference, and the number of failures."""
    spent, worst, failed = 0.0, 0.0, 0
    for case in cases:
        h, f, upper, constant, size = _programme(case["a"], case["b"], case["arcs"])
        begin = time.process_time()
        y = solver(h, f, upper)
        spent += time.process_time() - begin
        if y is None:
            failed += 1
            continue
        y = np.asarray(y)
        value = 0.5 * y @ h @ y + f @ y + constant
        worst = max(worst, abs(float(value - case["ours"][0])) / (size + abs(float(f @ y))))
    return f"{1e3 * spent / len(cases):.3f}", f"{worst:.1e}", failed


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("what", choices=("write", "solve"))
    parser.add_argument("file", type=Path)
    options = parser.parse_args()
    (write if options.what == "write" else solve)(options.file)


if __name__ == "__main__":
    main()
