"""``report.html`` of a study: what accuracy costs, in its sentences and pictures, from the study's folder alone."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from ..errors import ResultError
from .content import picture, pictures
from .render import NAME, render

_FIRST = ("work_precision", "error_h", "error_epsilon", "time")
"""The pictures that are shown first, in this order; what is not named here comes after, by its name."""


def write(folder: Path) -> Path:
    """Write the page into the folder of a finished study; for one process alone.

    Raises:
        ResultError: no study is there, or it is damaged.
        NotWrittenError: the page cannot be written.
    """
    file = folder / "study.json"
    try:
        content = _content(json.loads(file.read_text(encoding="utf-8")), folder)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ResultError(f"{file}: no finished study, or damaged ({error})") from None
    return render("study.html.j2", content, folder / NAME)


def _content(study: dict[str, Any], folder: Path) -> dict[str, Any]:
    return {
        "title": f"{study['scene'] or 'untitled'}: what accuracy costs",
        "sentences": list(study["sentences"]),
        "pictures": [picture(path) for path in pictures(folder, _FIRST)],
        "facts_of_study": [
            ("points", str(len(study["points"]))),
            ("MPI ranks of each", str(study["ranks"])),
            ("hvi_fenicsx", str(study["version"])),
        ],
        "quantities": list(study["quantities"].items()),
    }
