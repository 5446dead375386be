"""What the benchmarks share: runs in processes of their own, the machine, medians with spread, tables, documents."""

from __future__ import annotations

import argparse
import json
import os
import platform
import shlex
import statistics
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("Agg")
import numpy as np

ROOT = Path(__file__).parents[1]
DEMOS = ROOT / "demos"
Figures = dict[str, Any]
LIFTING = ['boundary.press.traction=[0.0, "-1e6*(1 - 1.5*x)"]']
FLOOR = (
    'boundary.floor={on="bottom", contact={gap=0.0}, '
    'friction={law="quadratic_linear", gamma1=4e5, gamma2=2e5, delta=1e-5}}'
)
SCENES: Mapping[str, tuple[str, list[str]]] = {
    "frictionless": ("wall_left", ["solver={}", 'boundary.floor={on="bottom", contact={gap=0.0}}']),
    "paper": ("wall_left", []),
    "strong law": ("lift_off", []),
    "lift-off": ("strong_law", LIFTING),
    "block": ("block_3d", []),
    "lifted block": (
        "block_3d",
        ["boundary={}", FLOOR, 'boundary.press={on="top", traction=[5e4, 0.0, "-1e6*(1 - 1.9*x*y)"]}'],
    ),
}
"""Demo and overrides. The strong law has P = 6e6, γ1 = 3e6 N/m²; in the lift-off the press turns into a pull."""


def parser(text: str | None) -> argparse.ArgumentParser:
    """Options of all benchmarks."""
    made = argparse.ArgumentParser(description=text, formatter_class=argparse.RawDescriptionHelpFormatter)
    made.add_argument("--repeats", type=int, default=3)
    made.add_argument("--cpu", action="store_true", help="processor time instead of wall time: on a busy machine")
    made.add_argument("--limit", type=float, default=300.0, metavar="S", help="seconds after which a run is given up")
    return made


def run(scene: str, solver: str, overrides: Sequence[str], options: argparse.Namespace, **more: Any) -> Figures | None:
    """One run in a process of its own (``more``: of the task, and ``ranks``); None when it fails or takes too long."""
    ranks = more.pop("ranks", 1)
    name, own = SCENES.get(scene, (scene, []))
    task = {"scene": str(DEMOS / f"{name}.toml"), "overrides": [*own, *overrides], "solver": solver, **more}
    task["clock"] = "cpu" if options.cpu else "wall"
    words = [sys.executable, *(["-m", "mpi4py"] if ranks > 1 else []), str(ROOT / "benchmarks/one_run.py")]
    words = (["mpirun", "-n", str(ranks)] if ranks > 1 else []) + [*words, json.dumps(task)]
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    try:
        done = subprocess.run(
            words, capture_output=True, text=True, check=False, timeout=options.limit, env=environment, cwd=ROOT
        )
        figures: Figures = json.loads(done.stdout.splitlines()[-1])
    except (subprocess.TimeoutExpired, ValueError, IndexError):
        return None
    return figures


def repeated(
    wanted: Mapping[str, tuple[str, str, Sequence[str]]], options: argparse.Namespace, **more: Any
) -> dict[str, list[Figures]]:
    """Several runs (scene, solver, overrides) by name, in turn, as often as asked for; a run that fails is left out."""
    found: dict[str, list[Figures]] = {name: [] for name in wanted}
    for _ in range(options.repeats):
        for name, (scene, solver, overrides) in wanted.items():
            figures = run(scene, solver, overrides, options, **more)
            say(f"{name}: {'given up' if figures is None else f'{work(figures):.2f} s'}")
            if figures is not None:
                found[name].append(figures)
    return found


def square(cells: int) -> list[str]:
    """Override for a square of so many cells a side."""
    return [f"domain.cells=[{cells}, {cells}]"]


def work(figures: Figures) -> float:
    """Assembly, setup and solve on all levels, forms included; without mesh and certificate."""
    return float(figures["jit"] + figures["assembly"] + figures["setup"] + figures["solve"])


def median(runs: Sequence[Figures], measure: Any = work) -> float:
    """Median of a measure over the runs; NaN without runs."""
    return statistics.median([measure(r) for r in runs]) if runs else float("nan")


def spread(runs: Sequence[Figures], measure: Any = work) -> str:
    """Median with the range, as in 1.52 (1.50 to 1.60)."""
    if not runs:
        return "given up"
    values = [measure(r) for r in runs]
    return f"{statistics.median(values):.2f} ({min(values):.2f} to {max(values):.2f})"


def certified(runs: Sequence[Figures]) -> str:
    """Whether all runs were."""
    return "yes" if runs and all(r["certified"] for r in runs) else "**no**"


def exponent(sizes: Sequence[float], values: Sequence[float]) -> float:
    """Slope of the fitted line in double logarithmic scale."""
    return float(np.polyfit(np.log(sizes), np.log(values), 1)[0])


def machine() -> str:
    """The machine in one line."""
    lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    model = next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), platform.machine())
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    import dolfinx
    from petsc4py import PETSc

    version = ".".join(map(str, PETSc.Sys.getVersion()))
    return f"{model}, {os.cpu_count()} cores, {memory:.0f} GiB; dolfinx {dolfinx.__version__}, PETSc {version}."


def table(head: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """Markdown."""
    lines = ["| " + " | ".join(map(str, row)) + " |" for row in [head, ["---"] * len(head), *rows]]
    return "\n".join(lines)


def document(name: str, title: str, parts: Sequence[str], options: argparse.Namespace) -> None:
    """Write docs/benchmarks/NAME.md with the command as it was given, its picture being docs/images/NAME.png."""
    command = shlex.join(["./hvi", "exec", "python3", f"benchmarks/{Path(sys.argv[0]).name}", *sys.argv[1:]])
    clock = "Processor time, since other programs used the machine too." if options.cpu else "Wall time."
    text = [f"# {title}", f"    {command}", f"{machine()} {clock}", f"![{title}](../images/{name}.png)", *parts]
    path = ROOT / "docs" / "benchmarks" / f"{name}.md"
    path.parent.mkdir(exist_ok=True)
    path.write_text("\n\n".join(text) + "\n", encoding="utf-8")
    say(f"wrote {path}")


def insert(page: Path, name: str, found: str) -> None:
    """Put a table in the place of the one after the page's <!-- name -->."""
    mark = f"<!-- {name} -->\n\n"
    before, after = page.read_text(encoding="utf-8").split(mark)
    rest = after[after.index("\n\n") :] if "\n\n" in after else "\n"
    page.write_text(before + mark + found + rest, encoding="utf-8")


def picture(name: str, figure: Any) -> None:
    """Save docs/images/NAME.png."""
    figure.tight_layout()
    figure.savefig(ROOT / "docs" / "images" / f"{name}.png", dpi=120)


def say(line: str) -> None:
    """Progress."""
    print(line, file=sys.stderr, flush=True)
