"""Laws that push: an equilibrium may exist although the energy has no minimum near it."""

from __future__ import annotations

from scenes import Table, model, solved


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
