"""The numbers of facets in forms, on which the compiled code depends: as few and as small as the form allows."""

from __future__ import annotations

from typing import Any

import numpy as np
import ufl
from dolfinx.mesh import meshtags


def renumbered(form: Any) -> Any:
    """The form with new numbers of its facets, from 1 on, so that forms over different parts are compiled once.

    Facets have one number if the same integrands are integrated over them.

    Args:
        form: UFL; one without arguments, or whose facets have no numbers, stays as it is.
    """
    over = [i for i in form.integrals() if i.integral_type() == "exterior_facet" and _has_numbers(i)]
    if not form.arguments() or len({id(i.subdomain_data()) for i in over}) != 1:
        return form
    alike = _alike(over)
    old = [[n for integral in group for n in _numbers(integral)] for group in alike]
    if any(len(set(numbers)) < len(numbers) for numbers in old):  # an integrand counts twice there
        return form
    new = _new_numbers(old)
    tags = _selected(form.arguments()[0].ufl_function_space().mesh, over[0].subdomain_data(), new)
    rest = [i for i in form.integrals() if not any(i is one for one in over)]
    ids = [tuple(sorted({new[n] for n in numbers})) for numbers in old]
    return ufl.Form(
        [*rest, *(g[0].reconstruct(subdomain_id=i, subdomain_data=tags) for g, i in zip(alike, ids, strict=True))]
    )


def _alike(integrals: list[Any]) -> list[list[Any]]:
    """Integrals in groups of one integrand and rule."""
    groups: dict[Any, list[Any]] = {}
    for integral in integrals:
        groups.setdefault((integral.integrand(), str(integral.metadata())), []).append(integral)
    return list(groups.values())


def _new_numbers(old: list[list[int]]) -> dict[int, int]:
    """A number from 1 on for each number: one for all that are in the same groups."""
    groups_of = {n: tuple(n in numbers for numbers in old) for numbers in old for n in numbers}
    kinds = sorted(set(groups_of.values()))
    return {n: 1 + kinds.index(kind) for n, kind in groups_of.items()}


def _has_numbers(integral: Any) -> bool:
    return integral.subdomain_data() is not None and all(isinstance(n, int) for n in _numbers(integral))


def _numbers(integral: Any) -> tuple[int, ...]:
    number = integral.subdomain_id()
    return number if isinstance(number, tuple) else (number,)


def _selected(mesh: Any, tags: Any, new: dict[int, int]) -> Any:
    """The entities that have one of these numbers, with the new ones."""
    found = [tags.find(number) for number in new]
    entities = np.concatenate(found)
    values = np.repeat(np.array(list(new.values()), dtype=np.int32), [len(f) for f in found])
    order = np.argsort(entities)
    return meshtags(mesh, tags.dim, entities[order], values[order])
