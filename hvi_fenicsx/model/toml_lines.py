"""Line numbers of the keys of a TOML text, which tomllib does not tell: best effort, for messages only.

The text has been read by tomllib before, so it is well formed; the scan only has to keep strings, brackets
and keys apart.
"""

from __future__ import annotations

import contextlib
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field

from ..schema import Keys

_TOKEN = re.compile(
    r'(?P<comment>#[^\n]*)|(?P<text>"""(?:\\.|[^\\])*?"""+|\'\'\'.*?\'\'\'+|"(?:\\.|[^"\\\n])*"|\'[^\'\n]*\')'
    r"|(?P<newline>\n)|(?P<mark>[\[\]{}=,.])|(?P<word>[^\s\[\]{}=,.#\"']+)",
    re.DOTALL,
)


def lines_of(text: str) -> Mapping[Keys, int]:
    """The line of each key and table by its way through the tables; as far as the scan came."""
    scan = _Scan([(m.lastgroup or "", m.group(), m.start()) for m in _TOKEN.finditer(text)], text)
    with contextlib.suppress(IndexError, RecursionError, ValueError):
        scan.document()
    return scan.lines


def line_of(lines: Mapping[Keys, int], where: Keys) -> int | None:
    """The line of a place, or of the innermost table around it that has one.

    Args:
        lines: by the keys of each place, see :func:`lines_of`.
        where: the keys of the place.
    """
    for length in range(len(where), 0, -1):
        if where[:length] in lines:
            return lines[where[:length]]
    return None


@dataclass
class _Scan:
    tokens: list[tuple[str, str, int]]
    source: str
    position: int = 0
    lines: dict[Keys, int] = field(default_factory=dict)
    counts: dict[Keys, int] = field(default_factory=dict)

    def document(self) -> None:
        table: Keys = ()
        while self.position < len(self.tokens):
            kind, token, _ = self.tokens[self.position]
            if kind in ("comment", "newline"):
                self.position += 1
            elif token == "[":
                table = self.header()
            else:
                self.entry(table)

    def header(self) -> Keys:
        start = self.position
        while self.token() == "[":
            self.position += 1
        path = self.key(())
        if self.position - start > 1 and self.tokens[start + 1][1] == "[":
            self.counts[path] = self.counts.get(path, -1) + 1
            path = (*path, self.counts[path])
        while self.position < len(self.tokens) and self.token() == "]":
            self.position += 1
        return path

    def entry(self, table: Keys) -> None:
        path = self.key(table)
        self.position += 1  # the equals sign
        self.value(path)

    def key(self, table: Keys) -> Keys:
        """A dotted key; each of its steps is noted at its line."""
        path = table
        while True:
            kind, token, start = self.tokens[self.position]
            path = (*path, _unquoted(token) if kind == "text" else token)
            self.lines.setdefault(path, self.source.count("\n", 0, start) + 1)
            self.position += 1
            if self.token() != ".":
                return path
            self.position += 1

    def value(self, path: Keys) -> None:
        opening = self.token()
        if opening == "{":
            self.inline_table(path)
        elif opening == "[":
            self.array(path)
        else:
            while self.position < len(self.tokens) and self.token() not in (",", "}", "]", "\n"):
                self.position += 1

    def inline_table(self, path: Keys) -> None:
        self.position += 1
        while self.skip() != "}":
            self.entry(path)
        self.position += 1

    def array(self, path: Keys) -> None:
        self.position += 1
        index = 0
        while self.skip() != "]":
            start = self.tokens[self.position][2]
            self.lines.setdefault((*path, index), self.source.count("\n", 0, start) + 1)
            self.value((*path, index))
            index += 1
        self.position += 1

    def skip(self) -> str:
        """The next token that is no separator."""
        while self.tokens[self.position][0] in ("comment", "newline") or self.token() == ",":
            self.position += 1
        return self.token()

    def token(self) -> str:
        return self.tokens[self.position][1]


def _unquoted(token: str) -> str:
    return next(iter(tomllib.loads(f"{token} = 0")))
