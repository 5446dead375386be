"""What a run's report says, as plain data for its template."""

from __future__ import annotations

import base64
import shlex
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from .. import png_file
from ..reader import Result
from . import numbers, paths, scene_text, verdict
from .certificate_text import certificate, estimate

_FIRST = ("escape", "scene", "body", "stress")
"""The pictures that are shown first, in this order; what is not named here comes after, by its name."""


def content(result: Result) -> dict[str, Any]:
    """All that the template shows."""
    shown = {path.stem: picture(path) for path in pictures(result.folder, _FIRST)}
    return {
        "title": result.title,
        "summary": result.summary,
        "verdict": verdict.headline(result),
        "existence": list(verdict.existence(result)),
        "warnings": result.summary.get("warnings") or [],
        "facts_of_run": list(numbers.facts(result)),
        "drawing": shown.pop("scene", None),
        "pictures": list(shown.values()),
        "body": list(scene_text.body(result)),
        "parts": list(scene_text.parts(result)),
        "contact": [numbers.contact(part) for part in result.parts],
        "forces": numbers.forces(result),
        "certificate": certificate(result),
        "estimate": estimate(result.summary.get("estimate")),
        "time": list(numbers.time(result.summary.get("time") or {})),
        "effects": list(scene_text.effects(result)),
        "reproduce": reproduce(result),
    }


def pictures(folder: Path, first: Sequence[str]) -> list[Path]:
    """The finished pictures of a folder.

    Args:
        folder: the folder.
        first: the names of those that come first, in this order; the others follow by their names.
    """
    found = (path for path in folder.glob("*.png") if not path.name.startswith("."))
    return sorted(found, key=lambda p: (first.index(p.stem) if p.stem in first else len(first), p.stem))


def picture(path: Path) -> dict[str, Any]:
    """A picture that lies in the page itself, with its size, so that the page does not jump while it is decoded."""
    raw = path.read_bytes()
    width, height = png_file.size(raw)
    return {
        "name": path.name,
        "caption": png_file.caption(raw) or path.stem,
        "data": f"data:image/png;base64,{base64.b64encode(raw).decode()}",
        "width": width,
        "height": height,
    }


def reproduce(result: Result) -> dict[str, Any]:
    """The command that gave the result, the one that gives it again, the scene and the versions."""
    summary = result.summary
    text = paths.beside((result.folder / "scene.toml").read_text(encoding="utf-8"), result.scene)
    return {
        "given": paths.command(str(summary.get("command") or "")),
        "can": summary.get("command") is not None,
        "again": shlex.join(_again(summary)),
        "scene": text,
        "download": f"data:application/toml;base64,{base64.b64encode(text.encode()).decode()}",
        "files": [Path(file).name for file in paths.files(result.scene)],
        "versions": versions(summary.get("versions") or {}),
    }


def _again(summary: Mapping[str, Any]) -> Iterable[str]:
    ranks = int(summary.get("ranks") or 1)
    petsc = str(summary.get("petsc") or "")
    return [
        *("hvi", "run", "scene.toml", "--out", "again"),
        *(("--np", str(ranks)) if ranks > 1 else ()),
        *((f"--petsc={petsc}",) if petsc else ()),
    ]


def versions(found: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Names and versions of what is installed."""
    return ((name, str(version)) for name, version in found.items() if version != "absent")
