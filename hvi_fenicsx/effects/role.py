"""What an effect does, as plain data: pictures and pages are made from a result folder alone."""

from __future__ import annotations

import json
from typing import Any

from ..laws import Superpotential, describe
from .base import Effect
from .contribution import BoundaryLaw, Contribution

Role = dict[str, Any]
"""One effect's role, ready for JSON:

    place: where it stands in the scene: "boundary", "body" or "material".
    drive: how it drives the body: "load", "kinematic" or "resistance".
    meaning: what it is, in a sentence or two.
    label: the same in a few words.
    traction: a load on its part by component, numbers or formulas, N/m²; empty: none.
    pressure: a load against its part, a number or a formula, N/m²; None: none.
    prescribed: the displacement components, from 0, that it prescribes.
    bounded: whether it bounds the normal displacement.
    obstacle: the unit vector towards a flat obstacle, where it has one.
    laws: the displacement that each of its laws acts on, the law as a scene writes it, and the multipliers of its
        tractions and of its lengths, numbers or formulas.
"""


def role_of(effect: Effect, contribution: Contribution) -> Role:
    """The role of an effect.

    Args:
        effect: the effect.
        contribution: what it added to the problem.
    """
    load = effect.surface_load()
    return {
        "place": effect.place.value,
        "drive": effect.drive.name.lower(),
        "meaning": effect.meaning(),
        "label": effect.label or effect.key.replace("_", " "),
        "traction": [f.source for f in load.components] if load else [],
        "pressure": load.pressure.source if load and load.pressure else None,
        "prescribed": sorted({c.component for c in contribution.conditions}),
        "bounded": bool(contribution.bounds),
        "obstacle": next((b.towards.constant for b in contribution.bounds if b.towards is not None), None),
        "laws": [_law(brought) for brought in contribution.laws],
    }


def _law(brought: BoundaryLaw) -> dict[str, Any]:
    return {
        "direction": brought.direction.value,
        "law": _table(brought.law),
        "multiplier": brought.multiplier.source,
        "length_multiplier": brought.length_multiplier.source,
    }


def _table(law: Superpotential) -> dict[str, Any]:
    """The table that a scene would have; its name alone where a parameter is not plain data."""
    try:
        table = describe(law)
        json.dumps(table)
    except (TypeError, ValueError, AttributeError):
        return {"law": law.name}
    return table
