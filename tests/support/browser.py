"""A headless Chromium, driven through its debugging pipe (two file descriptors, JSON between zero bytes)."""

from __future__ import annotations

import base64
import contextlib
import itertools
import json
import os
import select
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
_QUIET = (
    "--headless --no-sandbox --disable-gpu --no-first-run --disable-background-networking --disable-component-update "
    "--disable-sync --disable-default-apps --disable-extensions --remote-debugging-pipe"
)


class Browser:
    """One page. Every message of the browser is kept in ``heard``."""

    def __init__(self, reading: int, writing: int) -> None:
        self._reading, self._writing = reading, writing
        self._numbers, self._rest, self._session = itertools.count(1), b"", ""
        self.heard: list[dict[str, Any]] = []
        target = self.ask("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for room in ("Page", "Network", "Log", "Runtime"):
            self.ask(f"{room}.enable")

    def ask(self, method: str, **parameters: Any) -> dict[str, Any]:
        """A command and its answer."""
        number = next(self._numbers)
        message = {"id": number, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._writing, json.dumps(message).encode() + b"\0")
        answer = next(m for m in self._messages() if m.get("id") == number)
        assert "error" not in answer, f"{method}: {answer['error']}"
        result: dict[str, Any] = answer["result"]
        return result

    def open(self, file: Path, width: int) -> None:
        """Load a file on a screen of this width; back when everything is loaded."""
        self.ask("Emulation.setDeviceMetricsOverride", width=width, height=844, deviceScaleFactor=1, mobile=width < 600)
        self.heard.clear()
        self.ask("Page.navigate", url=file.as_uri())
        if not any(m.get("method") == "Page.loadEventFired" for m in self.heard):
            next(m for m in self._messages() if m.get("method") == "Page.loadEventFired")

    def evaluate(self, script: str) -> Any:
        """The value of an expression in the page."""
        return self.ask("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)["result"]["value"]

    def picture(self) -> bytes:
        """The whole page, PNG."""
        return base64.b64decode(self.ask("Page.captureScreenshot", captureBeyondViewport=True)["data"])

    def printed(self) -> bytes:
        """The page as it is printed on A4, PDF."""
        answer = self.ask("Page.printToPDF", paperWidth=8.27, paperHeight=11.69, preferCSSPageSize=True)
        return base64.b64decode(answer["data"])

    def _messages(self, patience: float = 60.0) -> Iterator[dict[str, Any]]:
        end = time.monotonic() + patience
        while True:
            *whole, self._rest = self._rest.split(b"\0")
            if whole:
                first, self._rest = whole[0], b"\0".join([*whole[1:], self._rest])
                self.heard.append(json.loads(first))
                yield self.heard[-1]
                continue
            assert select.select([self._reading], [], [], max(0.0, end - time.monotonic()))[0], "the browser is silent"
            more = os.read(self._reading, 1 << 20)
            assert more, "the browser has ended"
            self._rest += more


@contextlib.contextmanager
def browser() -> Iterator[Browser]:
    """A Chromium with a profile of its own; both go at the end."""
    assert CHROMIUM is not None
    orders, answers = os.pipe(), os.pipe()

    def place() -> None:  # it reads from 3 and writes to 4
        given = os.dup(orders[0]), os.dup(answers[1])
        os.dup2(given[0], 3)
        os.dup2(given[1], 4)

    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        command = [CHROMIUM, *_QUIET.split(), f"--user-data-dir={profile}"]
        child = subprocess.Popen(
            command, preexec_fn=place, close_fds=False, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        try:
            yield Browser(answers[0], orders[1])
        finally:
            child.terminate()
            child.wait(20)
            for end in (*orders, *answers):
                os.close(end)
