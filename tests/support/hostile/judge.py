"""What is wrong with what a hostile input has done: its exit code, its words, its files."""

from __future__ import annotations

import hashlib
import os
import re
import signal
import unicodedata
from dataclasses import dataclass
from pathlib import Path

from hvi_fenicsx.runtime import manifest

from .case import OUT, Case

CODES = {0, 2, 3, 4, 130}
_CRASHES = re.compile(
    r"Traceback \(most recent|MPI_ABORT|PETSC ERROR|egmentation|Exception ignored|core dumped|Fatal Python"
)

_PLACES = re.compile(
    r"\.toml|mesh|m\.msh|boundary|body|load '|material|domain|solver|interface|path|"
    r"--(accuracy|quantity|axis|repeat|limit|np|out|gap|set|petsc)"
)
_MESSAGES = re.compile(r"^hvi: (?!plugin .*: its code is run$)", re.MULTILINE)


@dataclass(frozen=True)
class Outcome:
    """What came of a case.

    Attributes:
        code: the exit code; negative: the signal that ended it.
        text: both outputs.
        before: the files, by :func:`snapshot`.
        after: the files.
        owned: names that the program's manifest had before.
    """

    code: int
    text: str
    before: dict[str, str]
    after: dict[str, str]
    owned: frozenset[str]


def snapshot(folder: Path) -> dict[str, str]:
    """All files of a folder by name, with their kind and content."""
    found = {}
    for place, folders, files in os.walk(folder):
        for name in [*folders, *files]:
            path = Path(place, name)
            found[str(path.relative_to(folder))] = _kind(path)
    return found


def _kind(path: Path) -> str:
    if path.is_symlink():
        return f"link to {os.readlink(path)}"
    if path.is_file():
        return hashlib.sha256(path.read_bytes()).hexdigest()
    return "folder" if path.is_dir() else "other"


def owned(folder: Path) -> frozenset[str]:
    """What the program's manifest lists in the folder for the output, relative to that of the case."""
    target = (folder / OUT).resolve()
    known = manifest.read(target)
    return frozenset(os.path.relpath(target / name, folder.resolve()) for name in known.owned) if known else frozenset()


def faults(case: Case, found: Outcome, folder: Path) -> list[str]:
    """What is wrong, in words; empty if nothing is."""
    return [*_of_words(case, found), *_of_files(case, found, folder)]


def _of_words(case: Case, found: Outcome) -> list[str]:
    allowed = CODES | ({-signal.SIGTERM} if case.end_after else set())
    wrong = [] if found.code in allowed else [f"exit code {found.code}"]
    if crash := _CRASHES.search(found.text):
        wrong.append(f"says {crash[0]}")
    odd = {c for c in found.text if unicodedata.category(c) in ("Cc", "Cf", "Cs") and c not in "\n\t"}
    if odd and "FORCE_COLOR" not in case.environment and case.words[0] != "--help":
        wrong.append(f"prints {odd}")
    if found.code == 2 and not case.shell.strip('"$@') and len(_MESSAGES.findall(found.text)) != 1:
        wrong.append("not one message")
    if found.code == 2 and case.places and not _PLACES.search(found.text):
        wrong.append("names no place")
    return wrong


def _of_files(case: Case, found: Outcome, folder: Path) -> list[str]:
    out = os.path.relpath((folder / OUT).resolve(), folder.resolve())
    wrong = []
    for name, kind in found.before.items():
        mine = name not in found.owned and not Path(name).name.startswith(case.ours or ("\0",))
        if mine and found.after.get(name) != kind and not _is_kept(name, kind, found.after):
            wrong.append(f"{'changed' if name in found.after else 'lost'} {name!r}")
    new = [n for n in found.after if n not in found.before and not any(p.startswith(case.ours) for p in Path(n).parts)]
    written = f"{out}/summary.json" in found.after  # also by a run that was interrupted while it solved
    if case.words[:1] == ["study"] or (found.code not in (2, 130) and found.code >= 0) or (found.code != 2 and written):
        new = [n for n in new if n != out and not n.startswith(f"{out}/")]
        wrong += _of_result(case, found, folder)
    return wrong + [f"left {n!r}" for n in new if ".kept" not in n]


def _is_kept(name: str, kind: str, after: dict[str, str]) -> bool:
    """Whether a file whose name the program needed lies beside, or in a folder that does."""
    ends = [str(Path(*Path(name).parts[: i + 1])) for i in range(len(Path(name).parts))]
    for end in ends:
        rest = name[len(end) :]
        if any(n.startswith(f"{end}.kept") and n.endswith(rest) and k == kind for n, k in after.items()):
            return True
    return False


def _of_result(case: Case, found: Outcome, folder: Path) -> list[str]:
    if case.words[0] == "check" or found.code not in (0, 3, 4) or case.end_after or "help" in " ".join(case.words):
        return []
    known = manifest.read(folder / OUT)
    damaged = known.damaged(folder / OUT) if known else "everything"
    return [f"lacks {damaged}"] if damaged else []
