"""The document of the hard-case matrix: docs/hard-cases.md and its picture, from the results alone."""

from __future__ import annotations

import statistics
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from covering import Case, Table
from matplotlib.colors import BoundaryNorm, ListedColormap

Record = dict[str, Any]
SOLVED = ("certified", "escapes", "no_equilibrium")
COMMAND = "./hvi exec python3 benchmarks/hard_cases.py"
COLUMNS = 3
LEVELS = [0, 25, 50, 75, 90, 100, 101]
"""Shares that look alike; all of them solved is a colour of its own."""
COLOURS = ["#a50026", "#d73027", "#f46d43", "#fdae61", "#fee8a8", "#4575b4"]


class Results:
    """The last record of each case and method, and what it is worth beside the other methods'."""

    def __init__(self, listed: Sequence[Case], records: Iterable[Record]) -> None:
        keys = {c.key: c for c in listed}
        ended = [r for r in records if r["outcome"] != "begun" and r["key"] in keys]
        self.cases = keys
        self.of: dict[str, dict[str, Record]] = defaultdict(dict)
        for record in ended:
            self.of[record["method"]][record["key"]] = record
        self.found = {r["key"] for r in ended if r["outcome"] == "certified"}

    @property
    def methods(self) -> list[str]:
        """``auto`` first."""
        return sorted(self.of, key=lambda m: (m != "auto", m))

    def outcome(self, record: Record) -> str:
        """That no equilibrium was found counts only where no other method found one either."""
        missed = record["outcome"] == "no_equilibrium" and record["key"] in self.found
        return "missed" if missed else str(record["outcome"])

    def solved(self, record: Record) -> bool:
        """Certified, or shown to have no solution, or undecided with nobody knowing better."""
        return self.outcome(record) in SOLVED

    def unsolved(self, method: str) -> list[Record]:
        """In the order of the list."""
        open_ones = [r for r in self.of[method].values() if not self.solved(r)]
        return sorted(open_ones, key=lambda r: self.cases[r["key"]].number)


def write(table: Table, listed: Sequence[Case], records: Iterable[Record], folder: Path) -> None:
    """Both files."""
    results = Results(listed, records)
    parts = [
        _head(table, listed),
        _counts(results),
        _iterations(results),
        *(_open(results, m) for m in results.methods),
    ]
    (folder / "hard-cases.md").write_text("\n\n".join(parts) + "\n", encoding="utf-8")
    _draw(table, results, folder / "hard-cases.png")


def _head(table: Table, listed: Sequence[Case]) -> str:
    pending = "; ".join(
        f"{axis} = {', '.join(map(str, p['values']))} (until there is {p['until']})"
        for axis, p in table.data["pending"].items()
    )
    return f"""# Hard cases

{len(listed)} combinations of everything that makes such a problem hard, each solved with each method and judged by the
certificate alone. The axes and their values are in `benchmarks/hard_cases.toml`, committed before anything was run; the
list of cases follows from it (`{COMMAND} list`): every value of an axis beside an otherwise plain case, every pair of
values of two axes, every triple of {" and of ".join(", ".join(t) for t in table.data["triples"])}, and a few corners.

    {COMMAND} run       # hours for all methods; `--method auto` is minutes; resumes where it stopped
    {COMMAND} report    # writes this document and its picture

A case counts as solved when its displacement is certified within {table.data["tolerance"]:g}, when it is proved that no
solution exists (state *escapes*), or when, the state being metastable or borderline, no equilibrium was found by any
method. One case with one method has {table.data["limit"]:g} s of processor time. Left out for now: {pending}.

![Share of cases solved, by value of each axis and method](hard-cases.png)"""


def _counts(results: Results) -> str:
    kinds = ["certified", "escapes", "no_equilibrium", "missed", "failed"]
    words = ["certified", "no solution exists", "no equilibrium found", "missed (another method found one)", "failed"]
    rows = []
    for method in results.methods:
        count = Counter(results.outcome(r) for r in results.of[method].values())
        total, solved = sum(count.values()), sum(count[k] for k in SOLVED)
        share = f"{100 * solved / total:.1f} %"
        rows.append([f"`{method}`", str(total), f"**{solved}**", share, *(str(count[k]) for k in kinds)])
    return "## Solved\n\n" + _markdown(["method", "cases", "solved", "share", *words], rows)


def _iterations(results: Results) -> str:
    entries = {"newton": "Newton", "linear": "linear", "branch": "convex steps", "cpu": "processor time, s"}
    rows = []
    for method in results.methods:
        ended = [r for r in results.of[method].values() if r["outcome"] == "certified"]
        rows.append([f"`{method}`", *(_spread([r[e] for r in ended if e in r]) for e in entries)])
    text = "## Iterations of the certified ones: median, maximum\n\n"
    return text + _markdown(["method", *entries.values()], rows)


def _spread(values: Sequence[float]) -> str:
    return f"{statistics.median(values):.3g}, {max(values):.3g}" if values else ""


def _open(results: Results, method: str) -> str:
    found = results.unsolved(method)
    if not found:
        return f"## Unsolved by `{method}`\n\nNone."
    rows = [_row(results.cases[r["key"]], r, results) for r in found]
    listing = _markdown(["case", "what is not plain about it", "state", "outcome", "reason"], rows)
    reasons = Counter(r["reason"] for r in found).most_common()
    summary = "\n".join(f"- {number} × {reason}" for reason, number in reasons)
    return f"## Unsolved by `{method}`\n\n{summary}\n\n<details><summary>The list</summary>\n\n{listing}\n\n</details>"


def _row(case: Case, record: Record, results: Results) -> list[str]:
    plain = next(iter(results.cases.values())).values
    special = ", ".join(f"{a} {v}" for a, v in case.values.items() if v != plain[a])
    return [f"`{case.key}`", special, record.get("state", ""), results.outcome(record), record["reason"]]


def _markdown(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(cell.replace('|', '/') for cell in line)} |" for line in lines)


def _draw(table: Table, results: Results, path: Path) -> None:
    """A column of blocks for each third of the axes' values; in a block a row for each value, a column a method."""
    columns = _split(list(table.axes.items()), COLUMNS)
    tallest = max(sum(len(v) + 1 for _, v in c) for c in columns)
    figure, axes = plt.subplots(1, COLUMNS, figsize=(3.2 + 3.0 * COLUMNS, 0.6 + 0.24 * tallest), layout="constrained")
    image = None
    for axis, column in zip(axes, columns, strict=True):
        image = _block(axis, column, results, tallest)
    bar = figure.colorbar(image, ax=axes, shrink=0.4, label="cases solved, %", ticks=LEVELS[:-1])
    bar.ax.text(1.4, 100.5, "all", transform=bar.ax.get_yaxis_transform(), va="center", fontsize=9)
    figure.suptitle("Hard cases: share solved, by value of each axis and method")
    figure.savefig(path, dpi=130)
    plt.close(figure)


def _split(items: list[tuple[str, Sequence[Any]]], parts: int) -> list[list[tuple[str, Sequence[Any]]]]:
    """In order, about equally long."""
    whole, columns, used = sum(len(v) + 1 for _, v in items), [[] for _ in range(parts)], 0
    for item in items:
        columns[min(parts - 1, used * parts // whole)].append(item)  # type: ignore[attr-defined]
        used += len(item[1]) + 1
    return columns  # type: ignore[return-value]


def _block(axis: Any, column: Sequence[tuple[str, Sequence[Any]]], results: Results, height: int) -> Any:
    labels: list[str] = []
    rows: list[list[float]] = []
    for name, values in column:
        ordered = _ordered(values)
        labels += [name.upper(), *(v if isinstance(v, str) else f"{v:g}" for v in ordered)]
        rows += [[np.nan] * len(results.methods), *(_shares(results, name, v) for v in ordered)]
    shares = np.array(rows + [[np.nan] * len(results.methods)] * (height - len(rows)))
    norm = BoundaryNorm(LEVELS, len(COLOURS))
    image = axis.imshow(shares, norm=norm, cmap=ListedColormap(COLOURS), aspect="auto")
    axis.set_yticks(range(len(labels)), labels, fontsize=8)
    axis.set_xticks(range(len(results.methods)), results.methods, fontsize=8, rotation=30)
    axis.xaxis.tick_top()
    axis.tick_params(length=0)
    _decorate(axis, shares, labels, [name.upper() for name, _ in column])
    return image


def _ordered(values: Sequence[Any]) -> list[Any]:
    """The table has the plain value first; a reader wants numbers in order."""
    return sorted(values, key=lambda v: (not isinstance(v, str), 0.0 if isinstance(v, str) else v))


def _decorate(axis: Any, shares: Any, labels: Sequence[str], heads: Sequence[str]) -> None:
    for tick, label in zip(axis.get_yticklabels(), labels, strict=True):
        tick.set_fontweight("bold" if label in heads else "normal")
    for spine in axis.spines.values():
        spine.set_visible(False)
    for (row, column), share in np.ndenumerate(shares):
        if np.isfinite(share):
            colour = "white" if share < 50 or share == 100 else "black"
            axis.text(column, row, f"{share:.0f}", ha="center", va="center", fontsize=7, color=colour)


def _shares(results: Results, axis: str, value: Any) -> list[float]:
    return [_share(results, results.of[m], axis, value) for m in results.methods]


def _share(results: Results, records: Mapping[str, Record], axis: str, value: Any) -> float:
    """Rounded down, so that 100 means all."""
    solved = [results.solved(r) for key, r in records.items() if results.cases[key][axis] == value]
    return float(np.floor(100.0 * np.mean(solved))) if solved else float("nan")
