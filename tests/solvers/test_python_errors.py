"""What a Python function raises that PETSc calls ends the solve; it is not taken for a start that failed."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
import pytest
from petsc4py import PETSc
from scenes import P, model, quadratic_linear, solved

from hvi_fenicsx.system.equations import Equations
from hvi_fenicsx.system.petsc_options import raise_python_error


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


@pytest.mark.parametrize("raised", [FloatingPointError("overflow"), np.linalg.LinAlgError("singular"), PETSc.Error(76)])
def test_what_a_solve_itself_fails_by_is_no_error_of_a_function(raised: Exception) -> None:
    """PETSc's own chain of errors, from a SNES whose function raises."""

    def failing(*_: object) -> None:
        raise raised

    x = PETSc.Vec().createSeq(2)
    snes = PETSc.SNES().create(PETSc.COMM_SELF)
    snes.setFunction(failing, x.duplicate())
    snes.setUseMF(True)
    with pytest.raises(PETSc.Error) as error:
        snes.solve(None, x)
    raise_python_error(error.value)
