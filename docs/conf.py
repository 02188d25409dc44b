"""The documentation site: sh scripts/run.sh sphinx-build -W docs build/site."""

import contextlib
import io
import json
import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx

import mcmj
from mcmj.experiments.command_line import parse
from mcmj.experiments.registry import GROUPS, entries, experiment_named
from mcmj.experiments.web.config import Config as Page
from mcmj.experiments.web.run import run as web_page
from mcmj.utils.errors import PackageError

project = "mcmj"
author = copyright = "The mcmj developers"
release = mcmj.__version__
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["data", "**.ipynb_checkpoints"]
html_theme = "furo"
html_title = "mcmj"
highlight_language = "none"  # equations and tables in docstrings
html_static_path: list[str] = []
myst_heading_anchors = 3
nb_execution_mode = "cache"
nb_execution_raise_on_error = True
nb_execution_timeout = 300
nb_execution_in_temp = True
nb_merge_streams = True
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_preserve_defaults = True
autodoc_default_options = {"members": True}
napoleon_numpy_docstring = False
napoleon_use_ivar = True
python_maximum_signature_line_length = 90
suppress_warnings = ["config.cache"]
DATA = Path(__file__).parent / "data"
EXTRA = Path(__file__).parent.parent / "build" / "extra"  # files of the site that are made
html_extra_path = [str(EXTRA)]
BODY = """```{raw} html
<style>
#soft-body { width: 100%; height: 56rem; border: 0 }
@media (max-width: 49em) { #soft-body { height: calc(165vw + 42rem) } }  /* one column */
</style>
<iframe id="soft-body" src="body.html" title="A soft body at work: pull a mass" loading="lazy">
</iframe>
```"""
SECTION = re.compile(r"(Args|Attributes|Raises|Returns|Yields):$")


def setup(app: Sphinx) -> None:
    """What Sphinx is told besides."""
    EXTRA.mkdir(parents=True, exist_ok=True)
    app.connect("autodoc-process-docstring", as_rst, priority=100)  # before napoleon
    app.connect("source-read", generated)


def as_rst(app: Sphinx, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Docstrings are plain text: indented blocks are equations, `x` is code, nothing is markup."""
    lines[:] = list(_converted(lines))


def _converted(lines: list[str]) -> Iterator[str]:
    section = literal = False
    blank = True
    for line in lines:
        indented = line.startswith("    ")
        if line and not indented:
            section, literal = bool(SECTION.match(line)), False
        if indented and blank and not section and not literal:
            literal = True
            yield from ("::", "")
        yield line if literal or SECTION.match(line) else _text(line)
        blank = not line.strip()


def _text(line: str) -> str:
    parts = line.split("`")
    for i in range(0, len(parts), 2):
        parts[i] = re.sub(r"([*|\\])|(?<=\w)_(?!\w)", lambda found: "\\" + found[0], parts[i])
    return "``".join(parts)


def generated(app: Sphinx, page: str, source: list[str]) -> None:
    """Pages made of the code and the data as they are."""
    makers = {"reference/commands": _commands, "reference/metrics": _metrics}
    if page == "index" and app.builder.format == "html":
        source[0] = re.sub(r"^!\[A body.*?\)$", _body, source[0], count=1, flags=re.M)
    if page in makers:
        source[0] += "\n".join(makers[page]())


def _body(picture: re.Match[str]) -> str:
    """A body that runs in the page; its picture where npm cannot fetch MuJoCo's package."""
    try:
        made = web_page(Page(body="general", readout="lissajous")).html
    except PackageError as error:
        print(f"no body in the front page: {error}")
        return picture[0]
    (EXTRA / "body.html").write_text(made, encoding="utf-8")
    return BODY


def _commands() -> Iterator[str]:
    os.environ |= {"NO_COLOR": "1", "TERM": "dumb", "COLUMNS": "100"}
    for group in GROUPS:
        yield f"\n## {group.capitalize()}"
        for name, entry in entries().items():
            if entry.group == group:
                yield f"\n### {name}\n\n{entry.line}\n\n```text\n{_help_of(name)}\n```"


def _help_of(name: str) -> str:
    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.suppress(SystemExit):
        parse(experiment_named(name), ["--help"])
    return out.getvalue().strip()


def _metrics() -> Iterator[str]:
    for path in sorted(DATA.glob("*.json")):
        document = json.loads(path.read_text(encoding="utf-8"))
        yield f"\n## {path.stem}\n\n`mcmj {document['scenario']}`\n\n```text"
        yield from _leaves(document["metrics"], "")
        yield "```"


def _leaves(entry: Any, path: str) -> Iterator[str]:
    if isinstance(entry, dict):
        for key, value in entry.items():
            yield from _leaves(value, f"{path}/{key}" if path else str(key))
    else:
        text = json.dumps(entry)
        yield f"{path}: {text if len(text) <= 60 else text[:57] + '...'}"
