"""Folders that the program fills: nothing of others is touched, one process at a time, a kill at any moment mended."""

from __future__ import annotations

import itertools
import os
import signal
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from mpi4py import MPI

from hvi_fenicsx import InputError
from hvi_fenicsx.results.output_folder import ResultFolder
from hvi_fenicsx.runtime import manifest


def written(out: Path, *, force: bool = True, **files: str) -> tuple[str, ...]:
    """A result of these files, by their names before the ending; what became of the files of others."""
    folder = ResultFolder(MPI.COMM_SELF, out, force=force)
    try:
        work = folder.work
        for name, text in files.items():
            (work / f"{name}.json").write_text(text)
        return folder._moved_in({})
    finally:
        folder.discard()


def nested(out: Path, text: str, *names: str) -> tuple[str, ...]:
    """A result with results in it, as a search for equilibria makes them."""
    folder = ResultFolder(MPI.COMM_SELF, out, force=True)
    try:
        work = folder.work
        (work / "summary.json").write_text(text)
        for name in names:
            written(work / name, summary=text)
        return folder._moved_in({})
    finally:
        folder.discard()


def names(folder: Path) -> list[str]:
    return sorted(f.name for f in folder.iterdir())


def intact(folder: Path) -> bool:
    """Whether there is a manifest, and each file as it says."""
    found = manifest.read(folder)
    return found is not None and found.damaged(folder) is None


RESULT = ["a.json", "manifest.json", "summary.json"]


def test_only_what_the_manifest_lists_makes_room(tmp_path: Path) -> None:
    out = tmp_path / "r"
    written(out, summary="1", a="1", b="1")
    (out / "mesh.msh").write_text("mine")
    (out / "notes").mkdir()
    for beside in (".r.old", ".r.partial"):
        (tmp_path / beside).mkdir()
        (tmp_path / beside / "thesis.txt").write_text("mine")
    assert written(out, summary="2", a="2") == ()
    assert names(out) == sorted([*RESULT, "mesh.msh", "notes"])
    assert (out / "a.json").read_text() == "2"
    assert names(tmp_path) == [".r.old", ".r.partial", "r"]
    assert all((tmp_path / beside / "thesis.txt").exists() for beside in (".r.old", ".r.partial"))


def test_files_put_there_meanwhile_are_kept_and_one_with_a_name_of_ours_gets_another(tmp_path: Path) -> None:
    out = tmp_path / "r"
    out.mkdir()
    folder = ResultFolder(MPI.COMM_SELF, out)
    (folder.work / "summary.json").write_text("ours")
    (out / "notes.txt").write_text("mine")
    (out / "summary.json").write_text("mine")
    (out / "summary.json.kept").write_text("mine too")
    kept = folder._moved_in({})
    folder.discard()
    assert names(out) == ["manifest.json", "notes.txt", "summary.json", "summary.json.kept", "summary.json.kept-2"]
    assert (out / "summary.json").read_text() == "ours"
    assert (out / "summary.json.kept-2").read_text() == "mine"
    assert len(kept) == 1
    assert "summary.json.kept-2" in kept[0]


@pytest.mark.parametrize(
    "text",
    [
        '{"name": "web app"}',
        "[]",
        "",
        '{"program": "hvi_fenicsx", "format": 1, "kind": "result", "files": {"../thesis.txt": null}, "inputs": {}}',
        '{"program": "hvi_fenicsx", "format": 1, "kind": "result", "files": {"/etc/x": null}, "inputs": {}}',
        '{"program": "hvi_fenicsx", "format": 1, "kind": "result", "files": 3, "inputs": {}}',
    ],
)
def test_a_manifest_of_others_or_one_that_points_outside_is_none(text: str, tmp_path: Path) -> None:
    (tmp_path / "r").mkdir()
    (tmp_path / "thesis.txt").write_text("mine")
    (tmp_path / "r" / "manifest.json").write_text(text)
    (tmp_path / "r" / "summary.json").write_text("{}")
    with pytest.raises(InputError, match="holds other files"):
        written(tmp_path / "r", summary="2")
    assert names(tmp_path) == ["r", "thesis.txt"]
    assert names(tmp_path / "r") == ["manifest.json", "summary.json"]


def test_nothing_is_written_or_removed_through_a_link(tmp_path: Path) -> None:
    """Where files are written before they are renamed, in a folder that a kill has left, and by a manifest."""
    out, mine, work = tmp_path / "r", tmp_path / "away" / "thesis.txt", tmp_path / ".r.hvi-new"
    written(out, summary="1", a="1")
    mine.parent.mkdir()
    mine.write_text("mine")
    (out / "sub").symlink_to(mine.parent)
    for name in (".manifest.json.part", ".j.part", "j"):
        (out / name).symlink_to(mine)
    folder = ResultFolder(MPI.COMM_SELF, out, force=True)
    folder.begin_journal("j", ["this"])
    folder.journal.append({"x": 1})
    folder.discard()
    assert not (out / "j").is_symlink()
    work.mkdir()
    for name in (".manifest.json.part", ".manifest.json.copy"):
        (work / name).symlink_to(mine)
    (tmp_path / ".r.hvi-lock").write_text("hvi_fenicsx: process 1 on another")
    manifest.write(work, manifest.Manifest(kind="result", files={"summary.json": None}))
    written(out, summary="2")
    for listed in ("sub/thesis.txt", "./sub/thesis.txt", "sub//thesis.txt"):
        manifest.write(out, manifest.Manifest(kind="result", files={listed: None}))
        with pytest.raises(InputError, match="holds other files"):
            written(out, summary="3")
    assert mine.read_text() == "mine"


def test_the_second_writer_is_refused_at_once_and_the_lock_goes_with_the_first(tmp_path: Path) -> None:
    first = ResultFolder(MPI.COMM_SELF, tmp_path / "deep" / "r")
    with pytest.raises(InputError, match=f"process {os.getpid()} on"):
        ResultFolder(MPI.COMM_SELF, tmp_path / "deep" / "r")
    ResultFolder(MPI.COMM_SELF, tmp_path / "deep" / "other").discard()
    first.discard()
    assert names(tmp_path) == []
    written(tmp_path / "r", summary="1")


class Killed(BaseException):
    """The end of the process: nothing of the program's own runs after it."""


def filled(work: Path) -> None:
    """Write the files of a second result."""
    for name in ("summary", "a", "c"):
        (work / f"{name}.json").write_text("2")


def killed_at(
    step: int,
    out: Path,
    patch: pytest.MonkeyPatch,
    fill: Callable[[Path], None] = filled,
    finish: Callable[[ResultFolder], object] = lambda folder: folder._moved_in({}),
) -> bool:
    """Replace a result, killed at a system call that changes files, counted from 0; whether there were so many.

    Args:
        step: the number of the call.
        out: the folder.
        patch: of the calls.
        fill: writes the new files.
        finish: what is done with them, in which the process is killed, or when the folder is closed.
    """
    calls = itertools.count()
    folder = ResultFolder(MPI.COMM_SELF, out, force=True)
    fill(folder.work)

    def counted(real: Any) -> Any:
        def call(*arguments: Any, **keys: Any) -> Any:
            if next(calls) >= step:
                raise Killed
            return real(*arguments, **keys)

        return call

    with patch.context() as patched:
        for name in ("rename", "replace", "unlink", "rmdir", "fsync"):
            patched.setattr(os, name, counted(getattr(os, name)))
        try:
            finish(folder)
            folder.discard()
        except Killed:
            pass
        else:
            return False
    assert folder._lock is not None
    folder._lock.release(keep=True)  # as the kernel does
    return True


def killed_everywhere(
    folder: Path, patch: pytest.MonkeyPatch, begin: Callable[[Path], object], **how: Any
) -> Iterator[Path]:
    """A folder for each call at which :func:`killed_at` kills its process; that of the last one ends by itself."""
    for step in itertools.count():
        out = folder / str(step) / "r"
        begin(out)
        alive = not killed_at(step, out, patch, **how)
        yield out
        if alive:
            return


def test_killed_at_any_call_the_result_is_the_old_or_the_new_one_and_the_next_run_works(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each system call that changes files, in turn. In between there is no summary, or all is of one result."""
    kinds = {"1": ["a", "b", "summary"], "2": ["a", "c", "summary"]}
    seen = []

    def first(out: Path) -> None:
        written(out, summary="1", a="1", b="1")
        (out / "notes.txt").write_text("mine")

    for out in killed_everywhere(tmp_path, monkeypatch, first):
        if (out / "summary.json").exists():
            now = (out / "summary.json").read_text()
            assert all((out / f"{name}.json").read_text() == now for name in kinds[now])
            assert intact(out)
        with pytest.raises(InputError, match="already holds a result"):
            written(out, force=False, summary="3")
        assert intact(out)
        now = (out / "summary.json").read_text()
        assert names(out) == sorted([*(f"{n}.json" for n in kinds[now]), "manifest.json", "notes.txt"])
        assert names(out.parent) == ["r"]
        seen.append(now)
    assert seen == sorted(seen)
    assert seen[0] == "1"
    assert seen.count("2") > 6


def test_killed_at_any_call_results_within_a_result_are_those_of_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As above: while the old results make room for the new ones."""

    def fill(work: Path) -> None:
        (work / "summary.json").write_text("2")
        for name in ("one", "three"):
            written(work / name, summary="2")

    seen = []
    for out in killed_everywhere(tmp_path, monkeypatch, lambda out: nested(out, "1", "one", "two"), fill=fill):
        ResultFolder(MPI.COMM_SELF, out, force=True).discard()
        now = (out / "summary.json").read_text()
        inside = ["one", "two"] if now == "1" else ["one", "three"]
        assert names(out) == sorted([*inside, "manifest.json", "summary.json"])
        assert all((out / name / "summary.json").read_text() == now for name in inside)
        seen.append(now)
    assert seen == sorted(seen)
    assert seen.count("2") > 6


def test_a_signal_waits_until_all_is_moved_whichever_thread_gets_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """MPI has a thread of its own, which takes the signals that the main one blocks."""
    out, asked, ended = tmp_path / "r", threading.Event(), threading.Event()
    written(out, summary="1", a="1", b="1")
    replace, before = os.replace, signal.getsignal(signal.SIGTERM)

    def stopped(number: int, frame: object) -> None:
        raise KeyboardInterrupt

    def other() -> None:
        asked.wait()
        signal.pthread_kill(threading.get_ident(), signal.SIGTERM)
        ended.set()

    def signalled(source: Path, goal: Path) -> None:
        if goal.parent == out:
            asked.set()
            ended.wait()
        replace(source, goal)

    threading.Thread(target=other).start()
    signal.signal(signal.SIGTERM, stopped)
    try:
        with monkeypatch.context() as patched:
            patched.setattr(os, "replace", signalled)
            with pytest.raises(KeyboardInterrupt):
                written(out, summary="2", a="2", c="2")
        assert signal.getsignal(signal.SIGTERM) is stopped
    finally:
        asked.set()
        signal.signal(signal.SIGTERM, before)
    assert names(out) == ["a.json", "c.json", "manifest.json", "summary.json"]
    assert intact(out)
    assert names(tmp_path) == ["r"]
