"""A load path: the equilibria that were followed, row by row, in SI."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..errors import ExitCode
from ..typing import Array, magnitude
from .state import End, Event
from .thresholds import DEFAULT


@dataclass(frozen=True, kw_only=True)
class PathRow:
    """One state of a path; energies in J/m in 2D, J in 3D.

    Attributes:
        factor: λ.
        event: what happens here, a word of :class:`.Event`.
        part: where it happens; None where no vertex is meant.
        point: the vertex, m, (d,); None likewise.
        energy: potential energy.
        work: done by loads and supports since the start.
        dissipated: since the start.
        released: by a jump to this state.
        way: how a jump was found.
        unstable: number of unstable directions.
        forces: the resultant of what acts on the body, by part, N/m or N, (d,) each.
        displacements: the mean displacement, by part, m, (d,) each.
        certified: whether the state passed the certificate.
    """

    factor: float
    event: str
    part: str | None
    point: Array | None
    energy: float
    work: float
    dissipated: float
    released: float
    way: str
    unstable: int
    forces: Mapping[str, Array]
    displacements: Mapping[str, Array]
    certified: bool

    @property
    def stable(self) -> bool:
        """Whether no direction is unstable."""
        return self.unstable == 0


@dataclass(frozen=True, kw_only=True)
class LoadPath:
    """What a path was found to be.

    Attributes:
        dimension: of space.
        scaled: what the factor multiplies, by name.
        rows: the states, from the first to the last.
        end: how it ended, a word of :class:`.End`.
        reason: why it ended so; may be empty.
        examined: rows whose certificate is that of the whole body; the others' is that of Γc.
    """

    dimension: int
    scaled: tuple[str, ...]
    rows: tuple[PathRow, ...]
    end: str
    reason: str
    examined: int

    @property
    def parts(self) -> tuple[str, ...]:
        """The parts with a load or a prescribed displacement."""
        return tuple(self.rows[0].forces) if self.rows else ()

    @cached_property
    def factors(self) -> Array:
        """λ of all rows, (rows,)."""
        return np.array([row.factor for row in self.rows])

    @cached_property
    def peak(self) -> int:
        """The row of the largest factor that is borne, in the direction in which the path begins."""
        size = np.abs(self.factors)
        ahead = self.factors[np.flatnonzero(size > DEFAULT.none * np.max(size, initial=0.0))[:1]]
        return int(np.argmax(self.factors * np.sign(ahead))) if len(ahead) else 0

    @property
    def folds(self) -> tuple[int, ...]:
        """The rows at limit points."""
        return tuple(number for number, row in enumerate(self.rows) if row.event == Event.FOLD)

    @property
    def jumps(self) -> tuple[int, ...]:
        """The rows that a jump leads to."""
        return tuple(number for number, row in enumerate(self.rows) if row.event == Event.JUMP)

    @property
    def uncertified(self) -> int:
        """The number of rows that did not pass the certificate."""
        return sum(not row.certified for row in self.rows)

    @property
    def converged(self) -> bool:
        """Whether the path was followed to its end, and every row is certified."""
        return self.end in (End.REACHED, End.ESCAPES) and not self.uncertified

    @property
    def exit_code(self) -> int:
        """By the contract."""
        if self.end == End.INTERRUPTED:
            return ExitCode.INTERRUPTED
        return ExitCode.CERTIFIED if self.converged else ExitCode.NOT_CONVERGED

    @property
    def headline(self) -> str:
        """The largest factor that is borne, by which state, and what happens then, in one line."""
        if not self.rows:
            known = "is borne" if self.end == End.ESCAPES else "was found"
            return f"no state {known}: {self.reason or self.end}"
        row = self.rows[self.peak]
        kind = "limit point" if row.event == Event.FOLD else f"{'stable' if row.stable else 'unstable'} state"
        return f"largest factor that is borne: {self._shown(self.peak)} ({kind}, row {self.peak}); {self._then()}"

    def _then(self) -> str:
        """What happens after the largest factor."""
        if self.end in (End.LOST, End.INTERRUPTED):
            return f"the path is {self.end} at {self._shown(-1)}" + (f" ({self.reason})" if self.reason else "")
        peak = self.rows[self.peak].factor
        if any(n > self.peak and abs(self.rows[n].factor - peak) <= DEFAULT.none * abs(peak) for n in self.jumps):
            return f"there the body jumps to the next stable state, {self.ending}"
        return self.ending

    @property
    def ending(self) -> str:
        """How the path ends, in words."""
        if self.end == End.ESCAPES:
            return f"then the body comes off, at {self._shown(-1)}"
        return f"the path ends where it was to end, at {self._shown(-1)}"

    def _shown(self, number: int) -> str:
        """The factor of a row in digits; 0 where it is rounding."""
        factor = self.factors[number]
        return f"{factor:.6g}" if abs(factor) > DEFAULT.none * magnitude(self.factors) else "0"

    def strongest(self, part: str) -> int:
        """The row in which the resultant at a part is largest.

        Args:
            part: its name.
        """
        return int(np.argmax([np.linalg.norm(row.forces[part]) for row in self.rows]))

    def summary(self) -> dict[str, object]:
        """The entry ``path`` of ``summary.json``."""
        last, peak = (self.rows[-1], self.rows[self.peak]) if self.rows else (None, None)
        return {
            "rows": len(self.rows),
            "events": sum(row.event in (Event.KINK, Event.CONTACT, Event.RELEASE) for row in self.rows),
            "peak_factor": peak and peak.factor,
            "peak_row": peak and self.peak,
            "folds": len(self.folds),
            "jumps": [{key: getattr(self.rows[n], key) for key in ("factor", "released", "way")} for n in self.jumps],
            "work": last and last.work,
            "dissipated": last and last.dissipated,
            "end": self.end,
            "reason": self.reason,
            "certified": len(self.rows) - self.uncertified,
            "uncertified": self.uncertified,
            "whole_body_certificates": self.examined,
            "unstable_rows": sum(not row.stable for row in self.rows),
            "peak_forces": {p: {"row": self.strongest(p), "force": self._force(p)} for p in self.parts},
            "scaled": list(self.scaled),
        }

    def _force(self, part: str) -> list[float]:
        return [float(f) for f in self.rows[self.strongest(part)].forces[part]]
