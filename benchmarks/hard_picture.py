"""The picture of the hard-case matrix: the share of cases solved, by method and value of each axis."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from covering import Table
from hard_results import Record, Results
from matplotlib.colors import BoundaryNorm, ListedColormap

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
"""Titles of axes whose names say too little in a picture."""
LEVELS = [0, 25, 50, 75, 90, 100, 101]
"""Limits of the colours, %; all cases solved has a colour of its own."""
COLOURS = ["#a50026", "#d73027", "#f46d43", "#fdae61", "#fee8a8", "#4575b4"]


def draw(table: Table, results: Results, path: Path) -> None:
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
