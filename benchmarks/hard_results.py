"""The results of the hard-case matrix: the last record of each case and method, and how it counts."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from typing import Any

from covering import Case, Table

Record = dict[str, Any]
REFUSAL = "InputError"
"""So begins the reason of a method that does not take a law with kinks, or several processes."""
SOLVED = ("certified", "no_equilibrium")


class Results:
    """The last record of each case and method, judged beside those of other methods and a search with a proof.

    Attributes:
        cases: by key.
        of: records by method and key.
        found: keys of the cases that have an equilibrium.
        enumerated: number of stationary points, by key, of small cases in which no method found any; None where that
            is not proven.
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
        """The cases that the method was asked and did not refuse; none is asked where no solution exists."""
        return [r for r in self.of[method].values() if self.outcome(r) not in ("refused", "escapes")]

    def outcome(self, record: Record) -> str:
        """That no equilibrium was found counts only where no other method and no search found one either."""
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


def _enumerated(table: Table, listed: Sequence[Case]) -> dict[str, int | None]:
    """Numbers of stationary points of those cases that are small enough; None where that is not proven."""
    if not listed:
        return {}
    import hard_equilibria  # it imports dolfinx, which a report without such cases does not need

    small = [c for c in listed if c["cells"] <= hard_equilibria.LARGEST]
    return {c.key: hard_equilibria.number_of_equilibria(c, table.data) for c in small}
