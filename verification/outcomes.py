"""A case as it ran, beside what was expected of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """One expectation (a table of `cases.toml`) and the number that was found; None where the command failed."""

    expected: Mapping[str, Any]
    found: float | None

    @property
    def agrees(self) -> bool:
        """Whether the number is within the tolerance that was written down, relative to the expected one."""
        wanted: float = self.expected["value"]
        return self.found is not None and abs(self.found - wanted) <= self.expected["tolerance"] * abs(wanted)


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """A case (a table of `cases.toml`), its result folder, the numbers found, the exit code and the seconds it took."""

    case: Mapping[str, Any]
    folder: Path
    found: Sequence[float | None]
    code: int
    seconds: float

    def comparisons(self) -> Iterator[Comparison]:
        for expected, found in zip(self.case["expected"], self.found, strict=True):
            yield Comparison(expected=expected, found=found)
