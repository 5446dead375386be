"""Folders that the program fills: nothing of others is touched, one process at a time, a kill at any moment mended."""

from __future__ import annotations

import functools
import itertools
import json
import os
import signal
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from hvi_fenicsx import InputError
from hvi_fenicsx.results import output_folder
from hvi_fenicsx.results.output_folder import OutputFolder
from hvi_fenicsx.runtime import manifest


def written(out: Path, existing: output_folder.Existing = "replace", **files: str) -> tuple[str, ...]:
    """A result of these files, by their names before the ending; what became of the files of others."""
    folder = OutputFolder(out, "result")
    try:
        folder.check(existing)
        work = folder.stage()
        for name, text in files.items():
            (work / f"{name}.json").write_text(text)
        return folder.move_in({})
    finally:
        folder.close()


def nested(out: Path, text: str, *names: str) -> tuple[str, ...]:
    """A result with results in it, as a search for equilibria makes them."""
    folder = OutputFolder(out, "result")
    try:
        folder.check("replace")
        work = folder.stage()
        (work / "summary.json").write_text(text)
        for name in names:
            written(work / name, summary=text)
        return folder.move_in({})
    finally:
        folder.close()


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


def test_results_within_a_result_make_room_but_for_files_of_others(tmp_path: Path) -> None:
    out = tmp_path / "r"
    nested(out, "1", "one", "two", "three")
    (out / "two" / "mine.txt").write_text("mine")
    (out / "three" / "mine.txt").write_text("mine")
    kept = nested(out, "2", "one", "two")
    assert names(out) == ["manifest.json", "one", "summary.json", "three", "two", "two.kept"]
    assert names(out / "two") == ["manifest.json", "summary.json"]
    assert names(out / "two.kept") == names(out / "three") == ["mine.txt"]
    assert len(kept) == 1


def test_files_put_there_meanwhile_are_kept_and_one_with_a_name_of_ours_gets_another(tmp_path: Path) -> None:
    out = tmp_path / "r"
    out.mkdir()
    folder = OutputFolder(out, "result")
    folder.check("refuse")
    (folder.stage() / "summary.json").write_text("ours")
    (out / "notes.txt").write_text("mine")
    (out / "summary.json").write_text("mine")
    (out / "summary.json.kept").write_text("mine too")
    kept = folder.move_in({})
    folder.close()
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


def test_a_link_stands_for_what_it_points_to(tmp_path: Path) -> None:
    (tmp_path / "disk").mkdir()
    (tmp_path / "out").symlink_to(tmp_path / "disk" / "r")  # dangling: made there
    written(tmp_path / "out", summary="1")
    written(tmp_path / "out", summary="2")
    assert (tmp_path / "out").is_symlink()
    assert (tmp_path / "disk" / "r" / "summary.json").read_text() == "2"
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    with pytest.raises(InputError, match="--out"):
        OutputFolder(tmp_path / "loop", "result")
    assert sorted(f.name for f in tmp_path.iterdir()) == ["disk", "loop", "out"]


def test_the_folder_itself_stays_so_that_a_shell_in_it_does_too(tmp_path: Path) -> None:
    (tmp_path / "r").mkdir()
    before = (tmp_path / "r").stat().st_ino
    written(tmp_path / "r", summary="1")
    assert (tmp_path / "r").stat().st_ino == before


def test_a_folder_that_may_not_be_written_is_refused_before_anything_is_computed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "r").mkdir()
    monkeypatch.setattr(os, "access", lambda *_: False)  # root may write everywhere
    folder = OutputFolder(tmp_path / "r", "result")
    with pytest.raises(InputError, match="r: could not be written: Permission denied; choose another folder"):
        folder.check("refuse")
    assert names(tmp_path) == ["r"]


def test_an_input_is_never_replaced(tmp_path: Path) -> None:
    written(tmp_path / "r", summary="1", a="1")
    folder = OutputFolder(tmp_path / "r", "result")
    with pytest.raises(InputError, match="is to be read"):
        folder.check("replace", [tmp_path / "r" / "a.json"])
    assert names(tmp_path) == ["r"]


def test_the_second_writer_is_refused_at_once_and_the_lock_goes_with_the_first(tmp_path: Path) -> None:
    first = OutputFolder(tmp_path / "deep" / "r", "result")
    first.stage()
    with pytest.raises(InputError, match=f"process {os.getpid()} on"):
        OutputFolder(tmp_path / "deep" / "r", "result")
    OutputFolder(tmp_path / "deep" / "other", "result").close()
    first.close()
    assert names(tmp_path) == []
    written(tmp_path / "r", summary="1")


def test_a_lock_file_of_others_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / ".r.hvi-lock").write_text("mine")
    with pytest.raises(InputError, match="move it away"):
        written(tmp_path / "r", summary="1")
    assert (tmp_path / ".r.hvi-lock").read_text() == "mine"


def test_without_flock_nothing_of_others_is_removed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = OutputFolder(tmp_path / "r", "result")
    work = first.stage()

    def refused(*_: object) -> None:
        raise OSError(38, "Function not implemented")

    monkeypatch.setattr("fcntl.flock", refused)
    with pytest.raises(InputError, match="File exists"):
        written(tmp_path / "r", summary="1")
    assert work.is_dir()


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
    finish: Callable[[OutputFolder], object] = lambda folder: folder.move_in({}),
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
    folder = OutputFolder(out, "result")
    folder.check("replace")
    fill(folder.stage())

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
            folder.close()
        except Killed:
            pass
        else:
            return False
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
            written(out, "refuse", summary="3")
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
        OutputFolder(out, "result").close()
        now = (out / "summary.json").read_text()
        inside = ["one", "two"] if now == "1" else ["one", "three"]
        assert names(out) == sorted([*inside, "manifest.json", "summary.json"])
        assert all((out / name / "summary.json").read_text() == now for name in inside)
        seen.append(now)
    assert seen == sorted(seen)
    assert seen.count("2") > 6


def test_a_result_given_up_is_not_moved_in_by_the_next_run_wherever_its_removal_is_killed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A second signal may come when the files are whole, and a third end their removal."""

    def whole(work: Path) -> None:
        filled(work)
        manifest.write(work, manifest.Manifest(kind="result", files=manifest.listed(work)))

    begin = functools.partial(written, summary="1", a="1", b="1")
    outs = [*killed_everywhere(tmp_path, monkeypatch, begin, fill=whole, finish=lambda _: None)]
    for out in outs:
        OutputFolder(out, "result").close()
        assert intact(out)
        assert names(out.parent) == ["r"]
    assert len(outs) > 4


def test_killed_while_a_growing_file_is_announced_the_next_run_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The folder is made then, and its manifest is not whole yet."""
    outs = [
        *killed_everywhere(tmp_path, monkeypatch, lambda _: None, finish=lambda folder: folder.announce("rows.csv"))
    ]
    for out in outs:
        written(out, "resume", summary="1", a="1")
        assert set(names(out)) == set(RESULT)
        assert names(out.parent) == ["r"]
    assert len(outs) > 4


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


def test_what_cannot_be_moved_stays_whole_and_the_next_run_moves_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "r"
    written(out, summary="1", a="1")

    replace = os.replace

    def refused(source: Path, goal: Path) -> None:
        if goal.parent == out:
            raise OSError(5, "Input/output error")
        replace(source, goal)

    with monkeypatch.context() as patched:
        patched.setattr(os, "replace", refused)
        with pytest.raises(InputError, match="the whole result is in") as error:
            written(out, summary="2", a="2")
    left = Path(str(error.value).split("the whole result is in ")[1].split(",")[0])
    assert (left / "summary.json").read_text() == "2"
    with pytest.raises(InputError, match="already holds a result"):
        written(out, "refuse", summary="3")
    assert (out / "summary.json").read_text() == "2"
    assert names(tmp_path) == ["r"]


def test_a_left_result_that_cannot_be_moved_yet_is_not_forgotten(tmp_path: Path) -> None:
    """A file stands where the folder was; when it is away, the next run goes on."""
    out = tmp_path / "r"
    folder = OutputFolder(out, "result")
    (folder.stage() / "summary.json").write_text("1")
    out.write_text("mine")
    with pytest.raises(InputError, match="the whole result is in"):
        folder.move_in({})
    folder.close()
    for _ in range(2):
        with pytest.raises(InputError, match="Not a directory"):
            written(out, summary="2")
    assert out.read_text() == "mine"
    out.unlink()
    with pytest.raises(InputError, match="already holds a result"):
        written(out, "refuse", summary="3")
    assert (out / "summary.json").read_text() == "1"
    assert names(tmp_path) == ["r"]


def test_a_folder_in_the_place_of_a_listed_file_is_kept(tmp_path: Path) -> None:
    out = tmp_path / "r"
    written(out, summary="1", a="1", b="1")
    for name in ("a.json", "b.json"):
        (out / name).unlink()
        (out / name).mkdir()
        (out / name / "thesis.txt").write_text("mine")
    written(out, summary="2", a="2")
    assert (out / "a.json.kept" / "thesis.txt").exists()
    assert (out / "b.json" / "thesis.txt").exists()
    assert (out / "a.json").read_text() == "2"


def test_a_damaged_file_is_found_whichever_it_is(tmp_path: Path) -> None:
    out = tmp_path / "r"
    written(out, summary="1", a="1")
    assert intact(out)
    found = manifest.read(out)
    assert found is not None
    (out / "a.json").write_text("")
    assert found.damaged(out) == "a.json"
    (out / "a.json").unlink()
    assert found.damaged(out) == "a.json"
    assert json.loads((out / "manifest.json").read_text())["kind"] == "result"
