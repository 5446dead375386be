"""Which lines of the package each test executes: a pytest plugin, and its counterpart in the processes tests start.

What a fixture of a module or of the session executes counts for every test that asks for the fixture, and so does its
time. Lines come from ``sys.monitoring``, which reports each line once and then no more until the next test begins.
"""

from __future__ import annotations

import atexit
import contextlib
import json
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

ROOT, CHILDREN = "HVI_RECORDED_ROOT", "HVI_RECORDED_CHILDREN"
_TOOL, _NO_TEST = sys.monitoring.COVERAGE_ID, "no test"
Lines = set[tuple[str, int]]


def start(lines: list[Lines]) -> None:
    """Record into the last of these sets, whatever it is at the time."""
    root = os.environ[ROOT] + os.sep

    def executed(code: Any, line: int) -> object:
        if code.co_filename.startswith(root):
            lines[-1].add((code.co_filename[len(root) :], line))
        return sys.monitoring.DISABLE

    sys.monitoring.use_tool_id(_TOOL, "faults")
    sys.monitoring.register_callback(_TOOL, sys.monitoring.events.LINE, executed)
    sys.monitoring.set_events(_TOOL, sys.monitoring.events.LINE)


def record_child() -> None:
    """Record this process, to its end."""
    if CHILDREN not in os.environ:
        return
    lines: Lines = set()
    start([lines])
    parallel = int(os.environ.get("OMPI_COMM_WORLD_SIZE", "1")) > 1

    def write() -> None:
        file = Path(os.environ[CHILDREN], f"{os.getpid()}.json")
        with contextlib.suppress(OSError):  # a disk that a test has made full
            file.write_text(json.dumps({"parallel": parallel, "lines": sorted(lines)}), encoding="utf-8")

    atexit.register(write)


class Recorder:
    """The plugin. What it finds is written to ``target`` when all tests have run."""

    def __init__(self, target: Path) -> None:
        self.target = target
        self.sets: list[Lines] = [set()]
        self.found: dict[str, dict[str, Any]] = {}
        self.folder = Path(tempfile.mkdtemp(prefix="recorded-"))
        os.environ[CHILDREN] = str(self.folder)
        start(self.sets)

    def _begin(self) -> None:
        self.sets.append(set())
        sys.monitoring.restart_events()

    def _end(self) -> dict[str, Any]:
        """What was executed since the last beginning, by this process and by those that it started."""
        lines, parallel = self.sets.pop(), False
        for file in self.folder.glob("*.json"):
            with contextlib.suppress(json.JSONDecodeError):  # a test that lets no file grow cuts this one too
                child = json.loads(file.read_text(encoding="utf-8"))
                lines |= {(name, line) for name, line in child["lines"]}
                parallel |= child["parallel"]
            file.unlink()
        sys.monitoring.restart_events()
        return {"lines": lines, "parallel": parallel}

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef: Any, request: Any) -> Iterator[None]:
        if fixturedef.scope == "function":
            return (yield)
        self._begin()
        began = time.perf_counter()
        try:
            return (yield)
        finally:
            found = {**self._end(), "seconds": time.perf_counter() - began}
            key = _key(fixturedef, getattr(request, "param_index", 0))
            found["lines"] |= self.found.get(key, {}).get("lines", set())  # made again, of other fixtures
            self.found[key] = found

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: Any) -> Iterator[None]:
        self._begin()
        began, known = time.perf_counter(), set(self.found)
        self.failed = False
        try:
            return (yield)
        finally:
            found = self._end()
            own = time.perf_counter() - began - sum(self.found[k]["seconds"] for k in set(self.found) - known)
            keys = [key for key in _keys(item) if key in self.found]
            self.found[item.nodeid] = {**found, "seconds": own, "fixtures": keys, "failed": self.failed}

    def pytest_runtest_logreport(self, report: Any) -> None:
        self.failed |= report.failed

    def pytest_sessionfinish(self) -> None:
        sys.monitoring.set_events(_TOOL, 0)
        shutil.rmtree(self.folder)
        tests = {name: self._whole(one) for name, one in self.found.items() if "failed" in one}
        self.target.write_text(json.dumps(tests), encoding="utf-8")

    def _whole(self, test: dict[str, Any]) -> dict[str, Any]:
        """A test with the fixtures that it asks for; lines by file."""
        parts = [test, *(self.found[key] for key in test["fixtures"])]
        lines: dict[str, list[int]] = {}
        for file, line in sorted(set().union(*(part["lines"] for part in parts))):
            lines.setdefault(file, []).append(line)
        return {
            "seconds": round(sum(part["seconds"] for part in parts), 4),
            "parallel": any(part["parallel"] for part in parts),
            "failed": test["failed"],
            "lines": lines,
        }


def _key(fixture: Any, index: int) -> str:
    return f"fixture {fixture.baseid}::{fixture.argname}[{index}]"


def _keys(item: Any) -> Iterator[str]:
    """The fixtures that a test asks for, each with the number of its parameter."""
    indices = item.callspec.indices if hasattr(item, "callspec") else {}
    for name, fixtures in item._fixtureinfo.name2fixturedefs.items():
        yield from (_key(fixture, indices.get(name, 0)) for fixture in fixtures)


class Order:
    """The plugin that runs the tests named in a file, in its order, and no others."""

    def __init__(self, source: Path) -> None:
        self.wanted = {name: i for i, name in enumerate(source.read_text(encoding="utf-8").splitlines())}

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items: list[Any]) -> None:
        items[:] = sorted((i for i in items if i.nodeid in self.wanted), key=lambda i: self.wanted[i.nodeid])


def pytest_configure(config: Any) -> None:
    """Record, or run in order, as the environment says."""
    if target := os.environ.get("HVI_RECORDED_TARGET"):
        config.pluginmanager.register(Recorder(Path(target)))
    if source := os.environ.get("HVI_TEST_ORDER"):
        config.pluginmanager.register(Order(Path(source)))
