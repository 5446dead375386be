"""The page of the architecture is what a new maintainer reads first; its floors are those that the lint keeps."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]


def floors_of_the_page() -> list[set[str]]:
    """The rooms of each floor, the lowest first."""
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    found: list[set[str]] = []
    for floor, rooms in re.findall(r"^\| (\d*) ?\| ((?:`\w+`(?:, )?)+) \|", page, re.MULTILINE):
        if floor:
            assert int(floor) == len(found) + 1
            found.append(set())
        found[-1] |= set(re.findall(r"\w+", rooms))
    return found


def test_the_floors_of_the_page_are_those_of_the_contract() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    contract = next(c for c in project["tool"]["importlinter"]["contracts"] if c["type"] == "layers")
    assert floors_of_the_page() == [set(re.findall(r"\w+", layer)) for layer in reversed(contract["layers"])]
