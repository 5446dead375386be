"""The blocks of the documents: what a reader would type or save, with how a test shall treat it.

A fenced block's language says what it is; a block that is indented by four spaces and begins with a command is one of
the shell. A comment on the line before a block changes how it is tested, and no reader sees it:

    <!-- file: NAME -->      the block is saved under this name
    <!-- run: OPTIONS -->    appended to each run of it, so that it is quick
    <!-- syntax: WHY -->     only the syntax is checked
    <!-- needs: RESULT -->   a result of the demo of that name

A first line `# NAME.py` or `# NAME.toml` names the file too; a Python block with a name is run as a file of its own,
the others one after another. In a block, `# exit code N` after a command says with what it ends. SCENE.toml stands for
a scene of the reader's own; a command with words in brackets is a synopsis, and is not run.
"""

from __future__ import annotations

import re
import shlex
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCUMENTS = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
_BLOCK = re.compile(
    r"(?:<!-- (?P<note>[^\n]*) -->\n\n?)?"
    r"(?:^```(?P<language>\w*)\n(?P<fenced>.*?)^```$|(?P<indented>(?:^    [^\n]*\n|^\n)+))",
    re.M | re.S,
)
_COMMANDS = ("./hvi ", "mpirun ", "pip ", "docker ", "time ")


@dataclass(frozen=True)
class Block:
    """A block: its language, its text, and the comment before it as a key and a value."""

    language: str
    text: str
    key: str
    value: str


@dataclass(frozen=True)
class Command:
    """A command of a shell block, and the exit code that it shall have."""

    text: str
    code: int


def blocks(document: Path) -> Iterator[Block]:
    """All blocks of a document that a test can do something with."""
    for found in _BLOCK.finditer(document.read_text(encoding="utf-8")):
        key, _, value = (found["note"] or "").partition(": ")
        if found["indented"] is None:
            name = re.match(r"# ([\w-]+\.(?:py|toml))\n", found["fenced"])
            yield Block(found["language"], found["fenced"], *(("file", name[1]) if name else (key, value)))
            continue
        text = textwrap.dedent(found["indented"]).strip("\n")
        if text.startswith(_COMMANDS):
            yield Block("sh", text, key, value)


def commands(block: Block) -> Iterator[Command]:
    """The commands of a shell block, one a line."""
    for line in block.text.replace("\\\n", " ").splitlines():
        code = re.search(r"# exit code (\d+)", line)
        words = shlex.split(line, comments=True)
        if words and not any(word.startswith("[-") for word in words):
            own = line.replace("SCENE.toml", "demos/wall_left.toml")
            yield Command(_made_quick(own, block), int(code[1]) if code else 0)


def _made_quick(line: str, block: Block) -> str:
    """A run with the options of its note, which may be repeated; another command as it is."""
    words = shlex.split(line, comments=True)
    if words[:2] != ["./hvi", "run"] and "hvi_fenicsx" not in words:
        return line
    return shlex.join([*words, *(shlex.split(block.value) if block.key == "run" else []), "--force"])
