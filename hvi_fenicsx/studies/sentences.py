"""What a study says in sentences that a person can act on, all derived from its rows."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

from ..errors import ExitCode
from ..runtime.terminal import percent
from .certainty import Certainty
from .error_norms import ERROR_NORMS
from .table import Row, claimed_error, front
from .thresholds import DEFAULT, Thresholds

TARGETS = (0.1, 0.01, 0.001)
"""The relative errors whose cost is named."""
_HEADLINES = ("energy_norm", "u_t_l2", "friction_l1", "pressure_l1")
"""The quantities that sentences and pictures may show."""
_NEARLY, _MOSTLY = 0.9, 0.65
"""Parts of an error from which on it is called nearly all of it, most of it."""
NEGLIGIBLE = 1e-9
"""Relative errors below this are no errors of h or ε."""
Certain = Mapping[str, Certainty]
"""How well the reference is known, by quantity."""


def headlines(rows: Sequence[Row]) -> list[str]:
    """The quantities that are shown: energy norm, slip, and -σ_t (-σ_n where there is no friction)."""
    known = [q for q in _HEADLINES if any(r.error(q) is not None for r in rows)]
    return [q for q in known if q != "pressure_l1" or "friction_l1" not in known]


def main_quantity(quantities: Sequence[str]) -> str:
    """The quantity that a study is most about: the traction on Γc, where there is one."""
    return quantities[-1] if quantities else "energy_norm"


def sentences(
    rows: Sequence[Row], own: Row, exact: Row, certain: Certain, thresholds: Thresholds = DEFAULT
) -> list[str]:
    """What a study says, the most useful first.

    Args:
        rows: all points.
        own: the scene's own setting.
        exact: the exact law on the same mesh.
        certain: how well the reference is known, by quantity.
        thresholds: which errors and gains count.
    """
    quantities = headlines(rows)
    return [
        own_setting(own, exact, main_quantity(quantities)),
        *(targets(rows, q, certain, thresholds) for q in reversed(quantities)),
        *_orders(rows, own, quantities, certain, thresholds),
        *adaptive_meshes(rows, certain),
        *methods(rows, own),
        *failures(rows),
    ]


def own_setting(own: Row, exact: Row, quantity: str) -> str:
    """What the scene's own setting costs, how far off it is, and by what.

    Args:
        own: the scene's own setting.
        exact: the exact law on the same mesh.
        quantity: key of the error norm.
    """
    setting = f"The scene's own setting ({own.text})"
    error = own.error(quantity)
    if error is None:
        return f"{setting} was not measured: {own.reason}."
    text = f"{setting} takes {seconds(own.seconds)} and is {of_error(error)} off in {ERROR_NORMS[quantity].name}"
    bare = exact.error(quantity)
    if own.smoothing is None or bare is None:
        return f"{text}."
    share = share_of_epsilon(own, exact, quantity)
    text += f", {_how_much(share)}" if share is not None else ""
    return f"{text}. The exact law on the same mesh takes {seconds(exact.seconds)} and is {of_error(bare)} off."


def share_of_epsilon(own: Row, exact: Row, quantity: str) -> float | None:
    """ε's part of the error: the distance from the exact law on the same mesh, beside that law's error in h.

    Args:
        own: the scene's own setting.
        exact: the exact law on the same mesh.
        quantity: key of the error norm.

    Returns:
        0 to 1; None where it is not known.
    """
    part, bare = (own.epsilon_part or {}).get(quantity), exact.error(quantity)
    if part is None or bare is None or part + bare < NEGLIGIBLE:
        return None
    return part / (part + bare)


def _how_much(share: float) -> str:
    for limit, words in ((_NEARLY, "nearly all of it ε"), (_MOSTLY, "most of it ε"), (1 - _MOSTLY, "half of it ε")):
        if share > limit:
            return words
    return "most of it h" if share > 1 - _NEARLY else "nearly all of it h"


def targets(rows: Sequence[Row], quantity: str, certain: Certain, thresholds: Thresholds = DEFAULT) -> str:
    """What each accuracy costs.

    Args:
        rows: all points.
        quantity: key of the error norm.
        certain: how well the reference is known, by quantity.
        thresholds: which gain in accuracy counts.
    """
    best = front(rows, quantity, certain, thresholds)
    reached: dict[str, tuple[Row, list[str]]] = {}
    missed = []
    for target in TARGETS:
        cheapest = next((r for r in best if (claimed_error(r, quantity, certain) or 0.0) <= target), None)
        if cheapest is None:
            missed = [_missed(rows, quantity, target, certain)]
            break
        reached.setdefault(cheapest.point, (cheapest, []))[1].append(of_error(target))
    parts = [f"{', '.join(t)} for {seconds(r.seconds)} ({r.text})" for r, t in reached.values()]
    return f"In {ERROR_NORMS[quantity].name}: {'; '.join([*parts, *missed])}."


def _missed(rows: Sequence[Row], quantity: str, target: float, certain: Certain) -> str:
    own = certain[quantity].error
    if own is not None and own > target:
        return f"{of_error(target)} cannot be claimed: the reference itself is uncertain by {of_error(own)}"
    errors = [(r.error(quantity), r) for r in rows]
    best, at = min(((e, r) for e, r in errors if e is not None), key=lambda pair: pair[0])
    return f"{of_error(target)} is not reached here: the best is {of_error(best)} for {seconds(at.seconds)} ({at.text})"


def slope(points: Sequence[tuple[float, float]]) -> float | None:
    """The order p of y = C xᵖ through the two points (x, y) of smallest x; None where there are no two positive y."""
    known = sorted((x, y) for x, y in points if x > 0.0 and y > NEGLIGIBLE)
    if len(known) < 2 or known[0][0] == known[1][0]:
        return None
    (x0, y0), (x1, y1) = known[:2]
    return math.log(y1 / y0) / math.log(x1 / x0)


def over_h(
    rows: Sequence[Row], own: Row, quantity: str, *, law: str = "exact law", degree: int | None = None
) -> list[tuple[float, float]]:
    """(h, error) of the points with the scene's own method, coarse to fine.

    Args:
        rows: all points.
        own: the scene's own setting.
        quantity: key of the error norm.
        law: that the points have.
        degree: that they have; without it, the scene's own.
    """
    found: dict[float, float] = {}
    for r in rows:
        error = r.error(quantity)
        same = (r.method, r.tolerance, r.linear_solver) == (own.method, own.tolerance, own.linear_solver)
        alike = (r.law, r.degree) == (law, degree or own.degree)
        if same and alike and r.h is not None and error is not None:
            found[r.h] = error
    return sorted(found.items(), reverse=True)


def order(
    rows: Sequence[Row],
    own: Row,
    quantity: str,
    certain: Certain,
    thresholds: Thresholds = DEFAULT,
    *,
    degree: int | None = None,
) -> float | None:
    """The order in h of the exact law's error, from the two finest meshes whose error the reference resolves.

    Args:
        rows: all points.
        own: the scene's own setting.
        quantity: key of the error norm.
        certain: how well the reference is known, by quantity.
        thresholds: which errors it resolves.
        degree: of the elements; without it, the scene's own.
    """
    least = thresholds.resolved * (certain[quantity].error or 0.0)
    return slope([(h, error) for h, error in over_h(rows, own, quantity, degree=degree) if error >= least])


def _orders(
    rows: Sequence[Row], own: Row, quantities: Sequence[str], certain: Certain, thresholds: Thresholds
) -> Iterator[str]:
    which = "two finest meshes whose errors the reference resolves"
    there = degrees(rows)
    for degree in there:
        found = [(q, order(rows, own, q, certain, thresholds, degree=degree)) for q in quantities]
        parts = [f"h^{value:.2f} in {ERROR_NORMS[q].name}" for q, value in found if value is not None]
        at = f" at degree {degree}" if len(there) > 1 else ""
        if parts:
            yield f"With the exact law the error{at} falls as {', '.join(parts)} ({which})."


def degrees(rows: Sequence[Row]) -> list[int]:
    """The degrees of the certified points, ascending."""
    return sorted({r.degree for r in rows if r.converged})


def adaptive_meshes(rows: Sequence[Row], certain: Certain) -> Iterator[str]:
    """What the adaptive meshes reached, as far as it can be claimed, and which uniform one does as well.

    Args:
        rows: all points.
        certain: how well the reference is known, by quantity.
    """
    exact = [(claimed_error(r, "energy_norm", certain), r) for r in rows if r.law == "exact law"]
    known = [(e, r) for e, r in exact if e is not None]
    found = sorted(((e, r) for e, r in known if r.adaptive), key=lambda pair: -pair[0])
    if not found:
        return
    parts = [f"{of_error(e)} with {_unknowns(r)}" for e, r in found]
    best = found[-1][0]
    uniform = [r for e, r in known if not r.adaptive and e <= best]
    fewest = min(uniform, key=lambda r: (r.dofs or 0, r.seconds or 0.0), default=None)
    like = _unknowns(fewest) if fewest else "more unknowns than any measured here has"
    yield f"Adaptive meshes: {', '.join(parts)} in the energy norm; a uniform mesh needs {like} for {of_error(best)}."


def _unknowns(found: Row) -> str:
    degree = "degree 2, " if found.degree == 2 else ""
    return f"{found.dofs:,} unknowns ({degree}{seconds(found.seconds)})"


def methods(rows: Sequence[Row], own: Row) -> Iterator[str]:
    """What each method costs at the scene's own setting.

    Args:
        rows: all points.
        own: the scene's own setting.
    """

    def rest(r: Row) -> tuple[object, ...]:
        return (r.mesh, r.degree, r.law, r.tolerance, r.linear_solver)

    same = [r for r in rows if rest(r) == rest(own)]
    if len({r.method for r in same}) > 1:
        ordered = sorted(same, key=lambda r: (not r.converged, r.seconds or math.inf))
        tried = [r for r in ordered if r.exit_code != ExitCode.BAD_INPUT]
        parts = [f"{r.method} {seconds(r.seconds) if r.converged else 'not certified'}" for r in tried]
        refused = [r.method for r in ordered if r.exit_code == ExitCode.BAD_INPUT]
        rest_of_them = f"; {', '.join(refused)} not for this scene" if refused else ""
        yield f"Methods, at the scene's own setting: {', '.join(parts)}{rest_of_them}."


def failures(rows: Sequence[Row]) -> Iterator[str]:
    """How many points failed."""
    bad = [r for r in rows if not r.converged and r.exit_code != ExitCode.BAD_INPUT]
    if bad:
        yield f"{len(bad)} of {len(rows)} points ended without a certified solution; study.csv says why."


def of_error(value: float) -> str:
    """A relative error as a percentage, to two digits."""
    return "below 0.001 %" if value < 1e-5 else percent(value)


def seconds(value: float | None) -> str:
    """A time, to two digits."""
    if value is None:
        return "an unknown time"
    if value < 0.0995:  # which would be 1e+02 ms
        return f"{1e3 * value:.2g} ms"
    return f"{value:.2g} s" if value < 9.95 else f"{value:.0f} s"
