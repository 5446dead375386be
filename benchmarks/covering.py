"""A list of cases that covers a table of axes: every value, every pair, chosen groups of axes, and corners.

Greedy (AETG; Cohen et al. 1997): each case starts from an uncovered tuple, and each of its other axes takes the value
that covers most of what is left. Deterministic: the table's seed decides what the coverage leaves open.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import random
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

Values = dict[str, Any]
Tuple = frozenset[tuple[str, Any]]


@dataclass(frozen=True)
class Case:
    """One combination. ``number`` counts from 1; ``key`` is made of the values, so it outlives a change of the list.

    ``fixed`` has the values of the axes that the table does not vary; they are no part of the key.
    """

    number: int
    values: Values
    fixed: Values = field(default_factory=dict)

    @property
    def key(self) -> str:
        text = json.dumps(self.values, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:10]

    def __getitem__(self, axis: str) -> Any:
        return self.values[axis] if axis in self.values else self.fixed[axis]


@dataclass
class Table:
    """The axes as they stand in the file."""

    data: dict[str, Any]
    random: random.Random = field(init=False)

    def __post_init__(self) -> None:
        self.random = random.Random(self.data["seed"])

    def first(self) -> Table:
        """The table without the values that came later."""
        later = self.data.get("later", {})
        kept = {a: [v for v in values if v not in later.get(a, [])] for a, values in self.axes.items()}
        return Table({**self.data, "axes": kept, "later": {}})

    @classmethod
    def read(cls, path: Path) -> Table:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
        for axis, values in data.get("later", {}).items():
            data["axes"][axis] += values
        return cls(data)

    @property
    def axes(self) -> Mapping[str, Sequence[Any]]:
        return self.data["axes"]

    def allowed(self, values: Mapping[str, Any]) -> bool:
        """Whether no excluded combination is in it."""
        rules = self.data["excluded"]
        return not any(all(values.get(a, _NOTHING) in banned for a, banned in rule.items()) for rule in rules)

    def weight(self, axis: str, value: Any) -> float:
        return float(self.data["weights"].get(axis, {}).get(str(value), 1.0))

    def tuples(self) -> set[Tuple]:
        """What is to be covered."""
        groups = [*itertools.combinations(self.axes, 2), *map(tuple, self.data["groups"])]
        rows = (dict(zip(g, r, strict=True)) for g in groups for r in itertools.product(*(self.axes[a] for a in g)))
        return {frozenset(row.items()) for row in rows if self.allowed(row)}


_NOTHING = object()


def cases(table: Table) -> list[Case]:
    """The list, without repetition: singles, corners, coverage; then the same again with the values that came later."""
    found: list[Values] = []
    for context in (table.first(), table):
        found += [*_singles(context), *_corners(context)]
        left = context.tuples()
        for values in found:
            left -= _covered(values, context)
        found += _coverage(context, left)
    unique = {json.dumps(v, sort_keys=True): v for v in found}
    return [Case(i, v, table.data["fixed"]) for i, v in enumerate(unique.values(), start=1)]


def _singles(table: Table) -> Iterator[Values]:
    """Each value of each axis, everything else as plain as that value allows."""
    for axis, values in table.axes.items():
        for value in values:
            yield _plain(table, {axis: value})


def _corners(table: Table) -> Iterator[Values]:
    return (_plain(table, corner) for corner in table.data["corners"])


def _plain(table: Table, given: Values) -> Values:
    """The given values, all others the first that fits."""
    made = dict(given)
    for axis, values in table.axes.items():
        made.setdefault(axis, next(v for v in values if table.allowed({**made, axis: v})))
    return {axis: made[axis] for axis in table.axes}


def _coverage(table: Table, left: set[Tuple]) -> Iterator[Values]:
    while left:
        first = min(left, key=lambda t: (-len(t), sorted(map(str, t))))
        values = _filled(table, dict(sorted(first)), left)
        left -= _covered(values, table)
        yield values


def _filled(table: Table, given: Values, left: set[Tuple]) -> Values:
    open_axes = [axis for axis in table.axes if axis not in given]
    table.random.shuffle(open_axes)
    for axis in open_axes:
        given[axis] = _choice(table, given, axis, left)
    return {axis: given[axis] for axis in table.axes}


def _choice(table: Table, given: Values, axis: str, left: set[Tuple]) -> Any:
    """The value with the largest gain times weight; equal ones by lot."""
    fitting = [v for v in table.axes[axis] if table.allowed({**given, axis: v})]
    gains = [table.weight(axis, v) * _gain(given, (axis, v), table, left) for v in fitting]
    if max(gains) == 0.0:
        return table.random.choices(fitting, [table.weight(axis, v) for v in fitting])[0]
    return table.random.choice([v for v, g in zip(fitting, gains, strict=True) if g == max(gains)])


def _gain(given: Values, new: tuple[str, Any], table: Table, left: set[Tuple]) -> int:
    others = [(item,) for item in given.items()]
    groups = [tuple((a, given[a]) for a in t if a != new[0]) for t in _ready(table, given, new[0])]
    return sum(frozenset((new, *rest)) in left for rest in [*others, *groups])


def _ready(table: Table, given: Values, axis: str) -> list[list[str]]:
    """The groups with this axis whose other axes are given."""
    return [t for t in table.data["groups"] if axis in t and all(a in given for a in t if a != axis)]


def _covered(values: Values, table: Table) -> set[Tuple]:
    groups = [*itertools.combinations(table.axes, 2), *map(tuple, table.data["groups"])]
    return {frozenset((a, values[a]) for a in group) for group in groups}
