"""What a Python function raises that PETSc calls ends the solve; it is not taken for a start that failed."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import pytest
from petsc4py import PETSc
from scenes import P, model, quadratic_linear, solved

from hvi_fenicsx.system.equations import Equations


def failing_at(number: int, function: Callable[..., object], raised: BaseException) -> Callable[..., object]:
    """The function, but for one call of it, counted from 1."""
    calls = itertools.count(1)

    def failing(*arguments: object) -> object:
        if next(calls) == number:
            raise raised
        return function(*arguments)

    return failing


@pytest.mark.parametrize("method", ["auto", "condensed"])
@pytest.mark.parametrize("raised", [ValueError("of a law"), KeyboardInterrupt()])
def test_an_error_in_a_residual_ends_the_run(
    method: str, raised: BaseException, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Equations, "residual", failing_at(3, Equations.residual, raised))
    with pytest.raises(type(raised)) as error:
        solved(model(4, P, friction=quadratic_linear(1e3), epsilon=0.01, method=method))
    assert not isinstance(error.value, PETSc.Error)
