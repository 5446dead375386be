"""Tables: strict, frozen, refused in plain words; a changed copy is validated like a new one."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Annotated, Any, Literal

import pytest
from pydantic import ValidationError, model_validator

from hvi_fenicsx.errors import InputError
from hvi_fenicsx.schema import (
    Count,
    Length,
    Mistake,
    Table,
    choose,
    descriptions,
    mistakes_of,
    validation_error,
    vector,
)


class Plate(Table):
    """A plate."""

    shape: Literal["plate"] = "plate"
    size: Annotated[tuple[Length, Length], vector(2)]
    """width and height"""
    cells: Count = 4

    @model_validator(mode="after")
    def _is_flat(self) -> Plate:
        if self.size[1] > self.size[0]:
            raise validation_error([Mistake(("size",), "must be wider than high")])
        return self


class Beam(Table):
    """A beam."""

    shape: Literal["beam"] = "beam"
    length: Length

    @model_validator(mode="after")
    def _is_long(self) -> Beam:
        if self.length < 2.0:
            raise ValueError("a beam of less than {2 m} is none")
        return self


def refused(read: Any, table: type[Table]) -> list[Mistake]:
    with pytest.raises(ValidationError) as caught:
        read()
    return mistakes_of(caught.value, table)


def test_a_changed_copy_is_validated_and_keeps_what_was_given() -> None:
    plate = Plate(size=(2.0, 1.0))
    finer = plate.changed(cells=8)
    assert (finer.size, finer.cells, plate.cells) == ((2.0, 1.0), 8, 4)
    for told, values in {
        "cells: must be greater than 0 (is 0)": {"cells": 0},
        "size: must be wider than high": {"size": (1.0, 2.0)},
        'cell: unknown key "cell"; did you mean "cells"?': {"cell": 1},
    }.items():
        with pytest.raises(InputError) as caught:
            plate.changed(**values)
        assert str(caught.value).startswith(told)


def test_what_was_left_to_its_default_stays_so() -> None:
    assert Plate(size=(2.0, 1.0)).changed(size=(3.0, 1.0)).model_fields_set == {"size"}


def test_a_table_is_read_by_the_class_that_its_key_names() -> None:
    classes = {"plate": Plate, "beam": Beam}
    assert choose({"shape": "beam", "length": 3.0}, "shape", classes) == Beam(length=3.0)
    wrong = {
        'unknown shape "beem"; did you mean "beam"? allowed: plate, beam': {"shape": "beem"},
        "is missing; allowed: plate, beam": {"length": 3.0},
        "must be a table with a shape (is 3)": 3,
        "a beam of less than {2 m} is none": {"shape": "beam", "length": 1.0},
    }
    for text, data in wrong.items():
        assert [m.text for m in refused(lambda data=data: choose(data, "shape", classes), Beam)] == [text]


def test_the_room_loads_nothing_heavy() -> None:
    heavy = ("dolfinx", "ufl", "petsc4py", "mpi4py", "numpy")
    code = f"import sys, hvi_fenicsx.schema; sys.exit(any(m in sys.modules for m in {heavy}))"
    assert subprocess.run([sys.executable, "-c", code], cwd=Path(__file__).parents[2]).returncode == 0


class Sheet(Plate):
    """A thin plate."""

    cells: Count = 2
    """along
    its width"""


def test_a_field_is_described_by_the_text_below_it() -> None:
    assert descriptions(Plate) == {"size": "width and height"}
    assert descriptions(Sheet) == {"size": "width and height", "cells": "along\nits width"}
    assert descriptions(type("Made", (Plate,), {"__doc__": "has no source", "__module__": "nowhere"})) == descriptions(
        Plate
    )
