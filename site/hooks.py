"""What the site has beyond `docs/`: README as its first page, the demos as pages, the reference of the public names."""

from __future__ import annotations

import ast
import json
import re
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

ROOT = Path(__file__).resolve().parents[1]
LANGUAGES = {".toml": "toml", ".py": "python", ".geo": "c"}


def on_config(config: Any) -> Any:
    """An entry FOLDER/* of the navigation stands for all pages of that folder."""
    config.nav = [expanded(entry) for entry in config.nav]
    return config


def expanded(entry: dict[str, Any]) -> dict[str, Any]:
    """An entry of the navigation with its folders written out."""
    (title, pages), *_ = entry.items()
    if isinstance(pages, str) and not pages.endswith("*"):
        return entry
    listed = [pages] if isinstance(pages, str) else pages
    return {title: [page for name in listed for page in (folder(name) if name.endswith("/*") else [name])]}


def folder(pattern: str) -> list[str]:
    """The pages of a folder."""
    if pattern == "demos/*":
        return list(demos())
    return sorted(str(path.relative_to(ROOT / "docs")) for path in (ROOT / "docs").glob(f"{pattern}.md"))


def on_files(files: Files, config: Any) -> Files:
    """All pages that are made of other files of the repository."""
    for name, text in {"index.md": first_page(), "api.md": reference(), **demos()}.items():
        files.append(File.generated(config, name, content=text))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Links from a document to a demo lead to its page."""
    return re.sub(r"\]\(\.\./demos/([^)]+)\)", r"](demos/\1.md)", markdown)


def first_page() -> str:
    """README, with its links as of the site."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    text = re.sub(r"\]\(docs/", "](", text)
    return re.sub(r"\[([^]]*)\]\((?!https?:|#)(?![\w./-]+\.(?:md|png)[)#])[^)]*\)", r"\1", text)


def demos() -> dict[str, str]:
    """A page for each scene, program, mesh and notebook."""
    paths = sorted(path for path in (ROOT / "demos").iterdir() if path.suffix in {*LANGUAGES, ".ipynb"})
    return {f"demos/{path.name}.md": f"# {path.name}\n\n{shown(path)}" for path in paths}


def shown(path: Path) -> str:
    """A file as a block of its language; a notebook as its cells."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".ipynb":
        return "\n\n".join(cell(content) for content in json.loads(text)["cells"])
    return f"```{LANGUAGES[path.suffix]}\n{text}```\n"


def cell(content: dict[str, Any]) -> str:
    """A cell of a notebook."""
    text = "".join(content["source"]).replace("](../docs/", "](../")
    return text if content["cell_type"] == "markdown" else f"```python\n{text}\n```"


def reference() -> str:
    """The public names, in the order of the alphabet."""
    tree = ast.parse((ROOT / "hvi_fenicsx" / "__init__.py").read_text(encoding="utf-8"))
    tables = [node for node in tree.body if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "_NAMES"]
    names = [name for room in ast.literal_eval(tables[0].value).values() for name in room if not name.startswith("__")]
    return "# Python reference\n\n" + "\n".join(f"::: hvi_fenicsx.{name}" for name in sorted(names))


def on_page_content(html: str, **_: Any) -> str:
    """Names in docstrings stand without Sphinx's roles."""
    return re.sub(r":(?:class|func|meth|mod|data):<code>[~.]*", "<code>", html)
