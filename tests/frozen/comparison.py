"""Whether two records say the same, and where they do not."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

EXACT, CURVED = 1e-9, 1e-6
"""What rows of exact and of curved paths may differ by, relative to the largest number of their kind; energies and load
factors of single states are held to the first, too."""
LOOSER = {"columns": 1e-6, "estimate": 1e-6, "max_gap": 1e-6, "contact": 1e-6, "resultants": 1e-6, "mode_mixity": 1e-6}
"""What a solver's tolerance leaves open at single vertices."""


def differences(old: Any, new: Any, tolerance: float, *, searched: bool = False) -> list[str]:
    """One line for each entry that differs.

    Args:
        old: the golden record, or a part of it.
        new: the one now.
        tolerance: relative, for numbers.
        searched: whether only what was found before must be found again, without a claim that this is all.
    """
    if searched:
        missing = [p for p in old["points"] if not any(_same_point(p, q, tolerance) for q in new.get("points", ()))]
        return [f"not found any more: {energy:.12g} ({kind})" for energy, kind in missing]
    return list(_differences("", _of_all_parts(old), _of_all_parts(new), tolerance))


def _of_all_parts(record: Mapping[str, Any]) -> Mapping[str, Any]:
    """Displacements, tractions and resultants of all parts in one list: those of one may be rounding beside others."""
    if record.get("resultants") and (contact := record.get("contact")):
        together = {**record["resultants"], "contact": contact["resultant"]}
        record = {**record, "resultants": {"all": list(together.values())}, "contact": {**contact, "resultant": None}}
    parts = record.get("columns")
    if not isinstance(parts, Mapping) or not parts:  # a path's are names
        return record
    kinds = {kind: [part[kind] for part in parts.values()] for kind in next(iter(parts.values()))}
    kinds["displacements"].append(record["max_gap"] or 0.0)
    return {**record, "columns": {"parts": list(parts), **kinds}, "max_gap": None}


def _same_point(old: Sequence[Any], new: Sequence[Any], tolerance: float) -> bool:
    return old[1] == new[1] and abs(old[0] - new[0]) <= tolerance * max(abs(old[0]), abs(new[0]))


def _differences(place: str, old: Any, new: Any, tolerance: float) -> Iterator[str]:
    if isinstance(old, Mapping) and isinstance(new, Mapping):
        for key in [*old, *(k for k in new if k not in old)]:
            yield from _differences(
                f"{place}.{key}" if place else key, old.get(key), new.get(key), max(tolerance, LOOSER.get(key, 0.0))
            )
    elif isinstance(old, list) and isinstance(new, list):
        yield from _lists(place, old, new, tolerance)
    elif not _agree(old, new, tolerance, 0.0):
        yield f"{place}: {_shown(old)} -> {_shown(new)}"


def _lists(place: str, old: list[Any], new: list[Any], tolerance: float) -> Iterator[str]:
    """Numbers in one list, or in lists of lists, are judged by the largest of them."""
    one, other = list(_leaves(old)), list(_leaves(new))
    if len(one) != len(other):
        yield f"{place}: {len(old)} entries -> {len(new)}"
        return
    size = max((abs(x) for x in one + other if _number(x)), default=0.0)
    apart = [i for i, pair in enumerate(zip(one, other, strict=True)) if not _agree(*pair, tolerance, size)]
    if apart:
        both = [abs(one[i] - other[i]) for i in apart if _number(one[i]) and _number(other[i])]
        most = f", by {max(both) / size:.1e} of the largest" if both else ""
        first = apart[0]
        yield f"{place}: {len(apart)} of {len(one)} differ{most}; first {_shown(one[first])} -> {_shown(other[first])}"


def _leaves(value: Any) -> Iterator[Any]:
    if isinstance(value, list):
        for entry in value:
            yield from _leaves(entry)
    else:
        yield value


def _number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _agree(old: Any, new: Any, tolerance: float, size: float) -> bool:
    if _number(old) and _number(new):
        return abs(old - new) <= tolerance * max(abs(old), abs(new), size)
    return bool(old == new)


def _shown(value: Any) -> str:
    return f"{value:.12g}" if isinstance(value, float) else str(value)
