"""Laws that push: an equilibrium may exist although the energy has no minimum near it."""

from __future__ import annotations

import pytest
from enumeration import Floor, polyline
from scenes import Table, block, energy, model, solved


def test_an_equilibrium_that_is_no_minimum_is_found() -> None:
    """Pressed between a plate and a floor that drives every slip on: at rest the forces of both halves balance."""
    law: Table = {"law": "graph", "points": [[0, 0], [1e-4, -6.7e3]]}
    table = model(3, friction=law, second_order=True)
    table["material"]["youngs_modulus"] = 6.5e9
    table["boundary"] = {
        "plate": {"on": "top", "displacement": ["free", -2.9e-5]},
        "floor": table["boundary"]["floor"],
    }
    found = solved(table)
    assert found.exit_code == 0
    assert found.solvability.state == "metastable"
    assert found.examination is not None
    assert found.examination.certificate.second_order == "not a minimiser"


@pytest.mark.parametrize(("cells", "push"), [(2, 0.0), (2, 1e5), (2, 3e5), (3, 3e5)])
def test_an_equilibrium_on_the_drop_of_a_law_that_pushes_is_found(cells: int, push: float) -> None:
    """Slips to both sides of one vertex balance the push; under a push enumeration finds this one equilibrium."""
    law = [(0.0, -4e5), (1e-6, -4e5)]
    points = Floor(cells, push, 1e6, polyline(law), wall=False).stationary()
    found = solved(block(cells, push, 1e6, {"law": "graph", "points": [list(point) for point in law]}))
    assert found.exit_code == 0
    assert len(points) == 1 or not push
    assert any(energy(found) == pytest.approx(point.energy, rel=1e-9) for point in points)


@pytest.mark.parametrize(
    ("push", "press", "law"),
    [
        (111980.10020183094, 601566.2811261887, [(0.0, -373267.0006727698), (1.74099219e-6, -114753.69814063578)]),
        (
            220945.98102403237,
            1871740.213802309,
            [(0.0, 0.0), (5.28796738e-7, 736486.60), (5.28796738e-7, -727410.54), (1.05759348e-6, -603529.45)],
        ),
    ],
    ids=["at a narrower width", "where a load path ends"],
)
def test_others_are_found_as_well(push: float, press: float, law: list[tuple[float, float]]) -> None:
    """Of a random draw of laws that push."""
    points = Floor(2, push, press, polyline(law), wall=False).stationary()
    found = solved(block(2, push, press, {"law": "graph", "points": [list(point) for point in law]}))
    assert found.exit_code == 0
    assert any(energy(found) == pytest.approx(point.energy, rel=1e-7) for point in points)
