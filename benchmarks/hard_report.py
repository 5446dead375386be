"""The document of the hard-case matrix: docs/hard-cases.md and its picture, from the results alone."""

from __future__ import annotations

import re
import statistics
from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from covering import Case, Table
from matplotlib.colors import BoundaryNorm, ListedColormap

Record = dict[str, Any]
REFUSAL = "InputError"
"""So begins the reason of a method that does not take a law with kinks, or several processes."""
QUICK = 10.0
"""Seconds of processor time within which all methods are compared."""
SOLVED = ("certified", "no_equilibrium")
COMMAND = "./hvi exec python3 benchmarks/hard_cases.py"
COLUMNS = 3
TITLES = {
    "strength": "law's peak / press",
    "delta": "slip at first drop",
    "margin": "distance from limit",
    "side": "side of limit",
    "epsilon": "relative epsilon",
    "cells": "cells a side",
    "stretch": "width / height",
    "modulus": "E, N/m²",
    "linear": "linear solver",
}
"""Of axes whose names say too little in a picture."""
LEVELS = [0, 25, 50, 75, 90, 100, 101]
"""Shares that look alike; all of them solved is a colour of its own."""
COLOURS = ["#a50026", "#d73027", "#f46d43", "#fdae61", "#fee8a8", "#4575b4"]


class Results:
    """The last record of each case and method, and what it is worth beside the other methods' and an enumeration.

    ``enumerated``: stationary points there are, by key, of the small ones in which no method found any; None where
    they are too many to try.
    """

    def __init__(self, table: Table, listed: Sequence[Case], records: Iterable[Record]) -> None:
        keys = {c.key: c for c in listed}
        ended = [r for r in records if r["outcome"] != "begun" and r["key"] in keys]
        self.cases = keys
        self.of: dict[str, dict[str, Record]] = defaultdict(dict)
        for record in ended:
            self.of[record["method"]][record["key"]] = record
        self.found = {r["key"] for r in ended if r["outcome"] == "certified"}
        without = {r["key"] for r in ended if r["outcome"] == "no_equilibrium"}
        self.enumerated = _enumerated(table, [c for c in listed if c.key in without - self.found])
        self.found |= {key for key, number in self.enumerated.items() if number}

    @property
    def methods(self) -> list[str]:
        """``auto`` first."""
        return sorted(self.of, key=lambda m: (m != "auto", m))

    def taken(self, method: str) -> list[Record]:
        """The cases that the method was asked and did not refuse; that none exists is told before any is asked."""
        return [r for r in self.of[method].values() if self.outcome(r) not in ("refused", "escapes")]

    def outcome(self, record: Record) -> str:
        """That no equilibrium was found counts only where no other method and no enumeration found one either."""
        if record["reason"].startswith(REFUSAL):
            return "refused"
        missed = record["outcome"] == "no_equilibrium" and record["key"] in self.found
        return "missed" if missed else str(record["outcome"])

    def solved(self, record: Record) -> bool:
        """Certified, or undecided with nobody knowing better."""
        return self.outcome(record) in SOLVED

    def unsolved(self, method: str) -> list[Record]:
        """In the order of the list."""
        open_ones = [r for r in self.taken(method) if not self.solved(r)]
        return sorted(open_ones, key=lambda r: self.cases[r["key"]].number)


def write(table: Table, listed: Sequence[Case], records: Iterable[Record], folder: Path) -> None:
    """Both files."""
    results = Results(table, listed, records)
    parts = [
        _head(table, listed),
        _counts(results),
        _iterations(results),
        _without(results),
        *(_open(results, m) for m in results.methods),
    ]
    (folder / "hard-cases.md").write_text("\n\n".join(parts) + "\n", encoding="utf-8")
    _draw(table, results, folder / "hard-cases.png")


def _enumerated(table: Table, listed: Sequence[Case]) -> dict[str, int | None]:
    """Numbers of stationary points of those cases that are small enough; None where there is too much to try."""
    if not listed:
        return {}
    import hard_enumeration  # it imports dolfinx, which a report without such cases does not need

    return {c.key: hard_enumeration.equilibria(c, table.data) for c in listed if hard_enumeration.fits(c)}


def _without(results: Results) -> str:
    """What brute force says of the cases that no method found an equilibrium of."""
    ended = {r["key"] for of in results.of.values() for r in of.values() if r["outcome"] == "no_equilibrium"}
    decided = {key: number for key, number in results.enumerated.items() if number is not None}
    confirmed = sum(not number for number in decided.values())
    rows = [[f"`{k}`", *_size(results.cases[k]), str(n)] for k, n in decided.items()]
    words = f"""## Cases without an equilibrium

In {len(ended - results.found)} metastable or borderline cases no method found an equilibrium. Is there none?
`benchmarks/hard_enumeration.py` tries all states of the floor's vertices by branch and bound. It can do so where the
tractions are piecewise linear (unsmoothed laws and the quadratic smoothing) and the floor is short: here in
{len(results.enumerated)} cases. In {len(decided)} of them it ended within its limit of linear programmes.
{confirmed} of these have no equilibrium."""
    return f"{words}\n\n{_markdown(['case', 'law', 'cells', 'equilibria there are'], rows)}" if rows else words


def _size(case: Case) -> list[str]:
    return [case["law"], str(case["cells"])]


def _head(table: Table, listed: Sequence[Case]) -> str:
    return f"""# Hard cases: which method solves what?

This page reports {len(listed)} difficult problems, solved with several methods. Only the certificate decides whether
a problem is solved. The problems combine everything that makes such a problem difficult: support, law, strength,
distance from the limit load, mesh, units, start and more. `benchmarks/hard_cases.toml` has these axes and their values.
They were committed before anything was run (the `later` values before anything was run with them). The list of cases
follows from the axes (`{COMMAND} list`): it has

- every value of an axis, in an otherwise plain case;
- every pair of values of two axes;
- every triple of values of these axes: {"; ".join(", ".join(t) for t in table.data["triples"])};
- a few combinations of many extreme values.

The commands are

    {COMMAND} run       # hours for all methods; `--method auto` is minutes; resumes where it stopped
    {COMMAND} report    # writes this document and its picture

A case counts as solved in three situations: its displacement is certified within
{table.data["tolerance"]:g}; or it is proved that no solution exists (state *escapes*); or its state is metastable or
borderline, and no method found an equilibrium. The time of one case and method is processor time.

![Share of the cases solved by each method, for each value of each axis](hard-cases.png)"""


def _counts(results: Results) -> str:
    words = [
        "method",
        "limit, s",
        "cases run",
        "no solution exists",
        "refused",
        "asked",
        "solved",
        "share of those asked",
    ]
    words += ["held: certified", "no equilibrium found", "missed", "failed"]
    quick = [f"`{m}` {_quick(results, m)}" for m in results.methods]
    return f"""## How many cases does each method solve?

{_markdown(words, (_count(results, m) for m in results.methods))}

There are {len(results.cases)} cases. The columns mean:

- *no solution exists*: the existence analysis proves it before any method is asked; not counted under
  *asked* and *solved*;
- *refused*: `tao` and `ssls` take no law with a kink (the paper's smoothing keeps one at zero slip); `condensed` runs
  in one process only;
- *asked*: the cases run, without these two;
- *held: certified*: of the cases in which the body is held, so that an equilibrium exists, those that are certified;
- *no equilibrium found*: the state is metastable or borderline, and no method or enumeration found an equilibrium;
- *missed*: the method found no equilibrium, but another method or the enumeration did;
- *failed*: all other cases.

`branch` was run on the unsmoothed laws only, because it is made for them.
Solved within {QUICK:g} s: {", ".join(quick)}."""


def _count(results: Results, method: str) -> list[str]:
    records, taken = results.of[method].values(), results.taken(method)
    count = Counter(results.outcome(r) for r in records)
    solved, held = sum(count[k] for k in SOLVED), [r for r in taken if r.get("state") == "held"]
    certified = sum(r["outcome"] == "certified" for r in held)
    limits = sorted({r["limit"] for r in records})
    share = f"{100 * solved / max(1, len(taken)):.1f} %"
    return [
        f"`{method}`",
        ", ".join(f"{t:g}" for t in limits),
        *map(str, (len(records), count["escapes"], count["refused"], len(taken))),
        f"**{solved}**",
        share,
        f"{certified} of {len(held)}",
        *(str(count[k]) for k in ("no_equilibrium", "missed", "failed")),
    ]


def _quick(results: Results, method: str) -> int:
    return sum(results.solved(r) and r.get("cpu", 0.0) <= QUICK for r in results.taken(method))


def _iterations(results: Results) -> str:
    entries = {"newton": "Newton", "linear": "linear", "branch": "convex steps", "cpu": "processor time, s"}
    rows = []
    for method in results.methods:
        ended = [r for r in results.of[method].values() if r["outcome"] == "certified"]
        rows.append([f"`{method}`", *(_spread([r[e] for r in ended if e in r]) for e in entries)])
    text = "## How many iterations do the certified cases take? Median, maximum\n\n"
    return text + _markdown(["method", *entries.values()], rows)


def _spread(values: Sequence[float]) -> str:
    return f"{statistics.median(values):.3g}, {max(values):.3g}" if values else ""


def _open(results: Results, method: str) -> str:
    """What is left, counted by reason; for ``auto`` case by case too."""
    found, head = results.unsolved(method), f"## Cases that `{method}` does not solve, by reason"
    if not found:
        return f"{head}\n\nNone."
    reasons = Counter(_reason(r) for r in found).most_common()
    summary = f"{head}\n\n" + "\n".join(f"- {number} × {reason}" for reason, number in reasons)
    if method != "auto":
        return summary
    rows = [_row(results.cases[r["key"]], r, results) for r in found]
    listing = _markdown(["case", "what is not plain about it", "state", "outcome", "reason"], rows)
    return f"{summary}\n\n<details><summary>The list</summary>\n\n{listing}\n\n</details>"


def _reason(record: Record) -> str:
    """Without the figures, by which no two are alike."""
    return re.split(r", (?:residual|merit)|: vertices|\d+\.\d", record["reason"])[0].strip()


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
    figure.suptitle("Share of cases solved, % of those that a method was asked; blank: it was asked none")
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
        labels += [TITLES.get(name, name).upper(), *(v if isinstance(v, str) else f"{v:g}" for v in ordered)]
        rows += [[np.nan] * len(results.methods), *(_shares(results, name, v) for v in ordered)]
    shares = np.array(rows + [[np.nan] * len(results.methods)] * (height - len(rows)))
    norm = BoundaryNorm(LEVELS, len(COLOURS))
    image = axis.imshow(shares, norm=norm, cmap=ListedColormap(COLOURS), aspect="auto")
    axis.set_yticks(range(len(labels)), labels, fontsize=8)
    axis.set_xticks(range(len(results.methods)), results.methods, fontsize=8, rotation=30)
    axis.xaxis.tick_top()
    axis.tick_params(length=0)
    _decorate(axis, shares, labels, [TITLES.get(name, name).upper() for name, _ in column])
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
    return [_share(results, results.taken(m), axis, value) for m in results.methods]


def _share(results: Results, records: Sequence[Record], axis: str, value: Any) -> float:
    """Rounded down, so that 100 means all; not a number where the method takes none."""
    taken = [r for r in records if results.cases[r["key"]][axis] == value]
    solved = [results.solved(r) for r in taken]
    return float(np.floor(100.0 * np.mean(solved))) if solved else float("nan")
