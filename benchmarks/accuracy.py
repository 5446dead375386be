"""Requested against true error of `hvi run --accuracy`, and its cost.

    ./hvi exec python3 benchmarks/accuracy.py [--only NAME] [--quantity NAME] [--accuracy X] [--again] [--write]

The true error is the distance to a solution on the same meshes, refined on until its own estimated error is a third of
what was requested (or the mesh has the largest number of unknowns); that error is added in quadrature and stated.
CPU times are of one rank. Each row is stored in docs/benchmarks/accuracy.json as soon as it is known; what is there
already is not measured again. ``--write`` puts the table and the picture of all stored rows into docs/accuracy.md.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import common
import numpy as np
from dolfinx import fem
from mpi4py import MPI

from hvi_fenicsx import Model, read_scene
from hvi_fenicsx.accuracy import adaptive, control, quantities
from hvi_fenicsx.accuracy.adaptive import AdaptiveLevel, AdaptiveSolver
from hvi_fenicsx.accuracy.control import AccuracyResult, Goal
from hvi_fenicsx.accuracy.quantity_base import Observable, contact_norm, prolong
from hvi_fenicsx.certify import contact_state
from hvi_fenicsx.runtime.cost import Timer

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "accuracy.md"
STORE = ROOT / "docs" / "benchmarks" / "accuracy.json"
READABLE = ("energy", "u_t", "sigma_t")
Key = tuple[str, str, float]
PLANE, SOLID = (1e-1, 1e-2, 1e-3), (1e-1, 3e-2)
"""Accuracies asked for in the plane and in space."""
REQUESTS: dict[str, dict[str, Sequence[float]]] = {
    "wall_left": {"energy": PLANE, "u_t": PLANE, "sigma_t": PLANE},
    "strong_law": {"energy": PLANE, "u_t": PLANE, "sigma_t": PLANE},
    "lift_off": {"energy": PLANE, "u_t": PLANE, "sigma_t": PLANE},
    "hertz": {"energy": PLANE, "u_t": PLANE},
    "peeling": {"energy": PLANE, "u_t": PLANE},
    "block_3d": {"energy": SOLID, "u_t": SOLID, "sigma_t": SOLID},
    "anchor_3d": {"energy": SOLID, "u_t": SOLID, "sigma_t": SOLID},
}


@dataclass(frozen=True)
class Row:
    """One request: what was asked, estimated and true, and what it cost."""

    scene: str
    quantity: str
    requested: float
    estimated: float
    true: float | None
    reference: float | None
    dofs: int
    meshes: int
    seconds: float
    coarsest: bool
    why: str | None

    @property
    def key(self) -> Key:
        return self.scene, self.quantity, self.requested

    @property
    def overshoot(self) -> float:
        return self.requested / self.true if self.true else np.inf

    def __str__(self) -> str:
        start = f"| {self.scene} | {self.quantity} | {self.requested:g} | {self.estimated:.1e} |"
        if self.why is not None:
            return f"{start} – | – | {self.dofs:,} | {self.meshes} | {self.seconds:.1f} | refused: {self.why} |"
        if self.true is None:
            cost = f"{self.dofs:,} | {self.meshes} | {self.seconds:.1f}"
            return f"{start} – | {self.reference:.0e} | {cost} | no reference |"
        verdict = "yes" if self.true <= self.requested else "**no**"
        if self.coarsest:
            verdict += ", coarsest"
        shown = f"{start} {self.true:.1e} | {self.reference:.0e} | {self.dofs:,} | {self.meshes} | {self.seconds:.1f} |"
        return f"{shown} {verdict} ({self.overshoot:.1f}) |"


HEAD = (
    "| scene | quantity | requested | estimated | true | reference | unknowns | meshes | CPU / s | met (overshoot) |\n"
    "|---|---|---|---|---|---|---|---|---|---|"
)


def solver() -> AdaptiveSolver:
    return AdaptiveSolver(timer=Timer())


def measured(name: str, quantity: str, requested: float, largest: int) -> Row:
    """One request, carried out and checked."""
    scene = read_scene(ROOT / "demos" / f"{name}.toml").with_solver(degree=1)
    start = time.process_time()
    reached = control.solve_to_goal(scene, MPI.COMM_WORLD, Goal(requested, quantity), solver(), lambda line: None)
    seconds, last = time.process_time() - start, reached.steps[-1]
    true = reference = None
    if reached.why is None:
        true, reference = true_error(reached, exact(scene), requested, largest)
    meshes, coarsest = len({s.dofs for s in reached.steps}), last.dofs == reached.steps[0].dofs
    return Row(
        name, quantity, requested, last.error, true, reference, last.dofs, meshes, seconds, coarsest, reached.why
    )


def exact(scene: Model) -> Model:
    """The scene for the reference: the unsmoothed law, a tight tolerance."""
    return scene.with_solver(smoothing=None, epsilon=None, epsilon_absolute=None, tolerance=1e-8)


def true_error(reached: AccuracyResult, scene: Model, requested: float, largest: int) -> tuple[float | None, float]:
    """The relative error, and the reference's own estimated one (energy norm)."""
    level, quantity = reached.level, reached.goal.quantity
    field = reader(quantity)(level)
    wanted = min(requested, level.solution.estimate.relative) / 3  # type: ignore[union-attr]
    go = solver()
    while level.solution.estimate.relative > wanted and level.dofs < largest:  # type: ignore[union-attr]
        coarser, level = level, go.refine(level, adaptive.refined(level, 0.75), scene, ahead(level, quantity))
        field = prolong(field, level, coarser)
    own = level.solution.estimate.relative  # type: ignore[union-attr]
    if own > 0.7 * reached.level.solution.estimate.relative:  # type: ignore[union-attr]
        return None, own  # no reference worth the name within the largest number of unknowns
    apart = distance(level, field, quantity)
    return (float(np.hypot(apart, own)) if quantity == "energy" else apart), own


def ahead(level: AdaptiveLevel, quantity: str) -> fem.Function | None:
    """What `hvi run --accuracy` would start the next mesh from."""
    found = quantities.find(quantity)()
    found.add(level)
    found.error()
    return found.ahead()


def reader(quantity: str) -> Callable[[AdaptiveLevel], Any]:
    found = quantities.find(quantity)()
    return found.value if isinstance(found, Observable) else displacement


def displacement(level: AdaptiveLevel) -> fem.Function:
    """The displacement, m."""
    field = fem.Function(level.prepared.problem.space)
    field.x.array[:] = level.solution.solve_result.u.x.array * level.prepared.problem.scales.displacement  # type: ignore[union-attr]
    return field


def distance(level: AdaptiveLevel, field: fem.Function, quantity: str) -> float:
    """Relative distance of a field from the one on this level."""
    own, found = reader(quantity)(level), quantities.find(quantity)
    apart = field.x.array - own.x.array
    if issubclass(found, Observable):
        return contact_norm(level, apart, found.power) / contact_norm(level, own.x.array, found.power)
    return energy_norm(level, apart) / energy_norm(level, own.x.array)


def energy_norm(level: AdaptiveLevel, values: Any) -> float:
    field = fem.Function(level.prepared.problem.space)
    field.x.array[:] = values
    forces = contact_state.forces(level.prepared.problem, field)
    internal = (forces.reaction + forces.load).ravel()
    return float(np.sqrt(values[: internal.size] @ internal))


def draw_requests(path: Path, rows: Sequence[Row]) -> None:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    names = {"energy": "energy norm", "u_t": "slip, L2", "sigma_t": "-σ_t, L1"}
    figure, axes = plt.subplots(1, 3, figsize=(12, 4), sharey=True, layout="constrained")
    ends = np.array([5e-4, 2e-1])
    for ax, (quantity, title) in zip(axes, names.items(), strict=True):
        ax.fill_between(ends, ends / 5, ends, color="0.9", label="met, overshoot up to 5")
        ax.loglog(ends, ends, "k-", linewidth=1)
        for i, scene in enumerate(dict.fromkeys(r.scene for r in rows)):
            found = [r for r in rows if (r.scene, r.quantity) == (scene, quantity) and r.true is not None]
            look = {"marker": "osD^v<>"[i % 7], "color": f"C{i}"}
            ax.loglog([], [], linestyle="", label=scene, **look)
            for r in found:
                ax.loglog(r.requested, r.true, fillstyle="none" if r.coarsest else "full", **look)
        ax.set(title=title, xlabel="requested", xlim=ends)
        ax.grid(True, which="major", alpha=0.3)
    axes[0].set_ylabel("true relative error")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside right center", frameon=False, title="hollow: the coarsest mesh")
    figure.savefig(path, dpi=120)


def stored() -> dict[Key, Row]:
    """The rows measured so far, by request."""
    if not STORE.exists():
        return {}
    rows = [Row(**row) for row in json.loads(STORE.read_text(encoding="utf-8"))]
    return {row.key: row for row in rows}


def store(rows: Mapping[Key, Row]) -> None:
    """Keep the rows, in the order of the requests: one line each."""
    kept = [rows[key] for key in requests() if key in rows]
    lines = ",\n".join(json.dumps(asdict(row)) for row in kept)
    aside = STORE.with_suffix(".part")
    aside.write_text(f"[\n{lines}\n]\n", encoding="utf-8")
    aside.replace(STORE)


def requests() -> list[Key]:
    """All that is asked for: scene, quantity, accuracy."""
    return [(name, quantity, r) for name, asked in REQUESTS.items() for quantity, few in asked.items() for r in few]


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--only", choices=REQUESTS, help="one scene")
    options.add_argument("--quantity", choices=READABLE, help="one quantity")
    options.add_argument("--accuracy", type=float, help="one accuracy")
    options.add_argument("--again", action="store_true", help="what is in the store too")
    options.add_argument("--largest", type=int, default=1_500_000, help="unknowns of a reference")
    options.add_argument("--write", action="store_true", help="table and picture into docs/, of all that is stored")
    given = options.parse_args()
    rows = stored()
    print(HEAD)
    for key in requests():
        chosen = (given.only, given.quantity, given.accuracy)
        if all(c in (None, k) for c, k in zip(chosen, key, strict=True)) and (given.again or key not in rows):
            found = measured(*key, given.largest)
            print(found, flush=True)
            store({**stored(), key: found})
    if given.write:
        shown = list(stored().values())
        common.insert(PAGE, "requests", "\n".join([HEAD, *map(str, shown)]))
        draw_requests(ROOT / "docs" / "images" / "accuracy.png", shown)


if __name__ == "__main__":
    main()
