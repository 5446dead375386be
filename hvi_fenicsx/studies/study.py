"""A finished study: each point measured against the reference."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from scipy import sparse

from ..scene import Scene
from . import solution_fields
from .certainty import Certainty, certainty
from .error_norms import Errors, errors
from .plan import Plan, exact_like
from .reference_solution import ReferenceSolution, TransferredSolution
from .setting import Setting
from .store import Store
from .table import Row, row


@dataclass(frozen=True, kw_only=True)
class Study:
    """A finished study.

    Attributes:
        scene: what was studied.
        rows: the points, cheapest mesh first.
        own: the scene's own setting.
        exact: the exact law on the scene's mesh.
        certain: how well the reference is known, by quantity.
        reference: its row.
        coarser: errors of the next coarser levels against the reference, finest first.
        left_out: combinations that were not run.
        ranks: that the points ran on.
    """

    scene: Scene
    rows: tuple[Row, ...]
    own: Row
    exact: Row
    certain: Mapping[str, Certainty]
    reference: Row
    coarser: tuple[Errors, ...]
    left_out: tuple[str, ...]
    ranks: int


def evaluate(plan: Plan, store: Store) -> Study:
    """Measure all points that are in a store.

    Args:
        plan: what was to be run.
        store: the points; it must hold the reference.

    Raises:
        ResultError: a point's solution is missing or damaged.
    """
    finest = plan.reference[0]
    stiffness = sparse.csr_array(sparse.load_npz(store.stiffness(finest)))
    reference = ReferenceSolution(solution_fields.load(store.solution(finest)), stiffness)
    levels = [_transferred(reference, store, setting) for setting in plan.reference[1:]]
    coarser = tuple(errors(reference, found) for found in levels if found is not None)
    certain = certainty(coarser)
    rows = tuple(_rows(plan, store, reference, certain))
    own, exact = (next(r for r in rows if r.point == store.name(s)) for s in (plan.own, plan.exact))
    return Study(
        scene=plan.own.scene,
        rows=rows,
        own=own,
        exact=exact,
        certain=certain,
        reference=row(store.name(finest), finest, store.record(finest) or {}, certain),
        coarser=coarser,
        left_out=plan.left_out,
        ranks=store.ranks,
    )


def _transferred(reference: ReferenceSolution, store: Store, setting: Setting) -> TransferredSolution | None:
    """A certified point on the reference's vertices; None for another."""
    if not (store.record(setting) or {}).get("converged"):
        return None
    return reference.transfer(solution_fields.load(store.solution(setting)))


def _rows(plan: Plan, store: Store, reference: ReferenceSolution, certain: Mapping[str, Certainty]) -> Iterator[Row]:
    partner: tuple[Setting | None, TransferredSolution | None] = (None, None)
    for setting in plan.points:
        alone = exact_like(plan.exact, setting)
        if partner[0] != alone:
            partner = (alone, _transferred(reference, store, alone))
        found = _transferred(reference, store, setting)
        own = part = left_out = None
        if found is not None:
            own, left_out = errors(reference, found), reference.left_out(found)
            if setting.scene.solver.smoothing and setting.accuracy is None and partner[1] is not None:
                part = errors(reference, found, partner[1])
        record = store.record(setting) or {}
        yield row(store.name(setting), setting, record, certain, errors=own, epsilon_part=part, left_out=left_out)
