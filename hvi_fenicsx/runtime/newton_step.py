"""One step of a Newton iteration, as progress callbacks get it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True, repr=False)
class NewtonStep:
    """One step of a Newton iteration; the same on all ranks.

    Attributes:
        method: the name of the method.
        epsilon: relative width of the smoothing; None for exact laws.
        iteration: counted from the start of the solve, 0 being its start value.
        residual: of the inequality, relative.
        contact: vertices in contact, of all ranks.
    """

    method: str
    epsilon: float | None
    iteration: int
    residual: float
    contact: int

    def __repr__(self) -> str:
        width = "" if self.epsilon is None else f", ε {self.epsilon:.3g}"
        at = f"iteration {self.iteration}, residual {self.residual:.2e}, {self.contact} vertices in contact"
        return f"{self.method}{width}, {at}"
