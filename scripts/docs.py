"""The numbers and figures of the documentation: run its commands, fill its tables.

    python scripts/docs.py                  fill every table from docs/data
    python scripts/docs.py --run perturb    run the commands of docs/experiments/perturb.md first
    python scripts/docs.py --check          only say which pages are stale; exit status 1 if any

A page names its commands in its front matter, with the figures to keep of each:

    ---
    runs:
      perturb_seeds:
        command: perturb --engine twin --seeds 20
        figures: [perturb.png]
    ---

A run leaves docs/data/perturb_seeds.json (its metrics.json) and the figures, in docs/figures.
What stands between `<!-- commands -->` or `<!-- table RUN .. [at PATH] .. -->` and `<!-- end -->`
is written from these. Rows of a table are templates over the metrics, those after `at PATH` once
for every entry of the mapping or list there, whose key or number is {key}. Of several runs the
metrics are by name. See `Numbers` for the formats.
"""

import json
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from string import Formatter
from typing import Annotated, Any

import tyro
import yaml

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
NAMES = {"van_der_pol": "Van der Pol", "quadratic": "quadratic", "lissajous": "Lissajous"}
_BLOCK = re.compile(
    r"(?P<start><!-- (?P<what>commands|table)(?P<rest>.*?)-->\n).*?(?P<end><!-- end -->)", re.S
)


class Numbers(Formatter):
    """Formats of templates: `.3` digits as Python's, `p2` percent and `n2` a number, both with so
    many significant digits, `name` a name in words. Of a list it is the median; what is not finite,
    or beyond the end of a list, is a dash."""

    def get_value(self, key: int | str, args: Any, kwargs: Any) -> Any:
        return kwargs[str(key)]

    def get_field(self, field_name: str, args: Any, kwargs: Any) -> Any:
        try:
            return super().get_field(field_name, args, kwargs)
        except IndexError:  # a list that ends before: of a robot that fell
            return None, field_name

    def format_field(self, value: Any, format_spec: str) -> str:
        if isinstance(value, list):
            value = median([one for one in value if one is not None] or [float("nan")])
        if value is None:
            return "-"
        if isinstance(value, bool):
            return "yes" if value else "no"
        if format_spec == "name":
            return NAMES.get(str(value), str(value).replace("_", " "))
        if format_spec[:1] in ("p", "n"):
            number = 100.0 * value if format_spec[0] == "p" else float(value)
            text = _significant(number, int(format_spec[1:]))
            return f"{text} %" if format_spec[0] == "p" else text
        return str(super().format_field(value, format_spec))


def _significant(number: float, digits: int) -> str:
    text = f"{number:.{digits}g}"
    plain = f"{float(text):.12f}".rstrip("0").rstrip(".")
    return text if "e" in text and (abs(number) < 1e-4 or abs(number) >= 1e6) else plain


class _Metrics(dict[str, Any]):
    """A mapping whose keys may be written without quotes in a template, numbers too."""

    def __missing__(self, key: object) -> Any:
        if isinstance(key, int) and str(key) in self:
            return self[str(key)]
        raise KeyError(key)


@dataclass(frozen=True)
class Run:
    """A command of a page, and the figures that the page shows of it."""

    name: str
    command: str
    figures: tuple[str, ...]

    @property
    def data(self) -> Path:
        """Its metrics, as committed."""
        return DOCS / "data" / f"{self.name}.json"

    def carry_out(self) -> None:
        """Run it and keep its metrics and figures.

        Raises:
            SystemExit: the command failed.
        """
        out = ROOT / "results" / "docs" / self.name
        command = [sys.executable, "-m", "mcmj", *self.command.split(), "--out", str(out)]
        print(f"mcmj {self.command}", flush=True)
        if subprocess.run(command, cwd=ROOT, check=False).returncode != 0:
            sys.exit(f"docs: {self.name} failed")
        shutil.copyfile(out / "metrics.json", self.data)
        for figure in self.figures:
            shutil.copyfile(out / figure, DOCS / "figures" / self.kept(figure))

    def kept(self, figure: str) -> str:
        """The name of a figure in docs/figures: with the run's, unless one begins or ends so."""
        if figure.startswith(self.name):
            return figure
        path = Path(figure)
        return self.name + path.suffix if self.name.endswith(path.stem) else f"{self.name}_{figure}"


def runs_of(text: str) -> list[Run]:
    """The runs that a page's front matter names."""
    if not text.startswith("---\n"):
        return []
    front = yaml.safe_load(text.split("---\n", 2)[1]) or {}
    return [
        Run(name, run["command"], tuple(run.get("figures", ())))
        for name, run in front.get("runs", {}).items()
    ]


def filled(text: str) -> str:
    """A page with its blocks written anew."""
    runs = {run.name: run for run in runs_of(text)}

    def block(found: re.Match[str]) -> str:
        if found["what"] == "commands":
            body = "```sh\n" + "".join(f"mcmj {run.command}\n" for run in runs.values()) + "```\n"
        else:
            try:
                body = "\n".join(_table(found["rest"])) + "\n"
            except FileNotFoundError as error:
                print(f"docs: {error}")
                return found[0]  # as it was
        return f"{found['start']}{body}{found['end']}"

    return _BLOCK.sub(block, text)


def _table(asked: str) -> Iterator[str]:
    """Lines of a table; `asked` is what stands in its comment after the word table."""
    first, *lines = asked.strip().splitlines()
    names, _, path = first.strip().partition(" at ")
    header, *templates = [line.strip() for line in lines]
    found = {name: _metrics_of(name) for name in names.split()}
    metrics = found if len(found) > 1 else found[names]
    rows = []
    for values in _rows(metrics, path):
        with suppress(KeyError, TypeError):  # an entry of another kind
            rows += [Numbers().vformat(template, (), values) for template in templates]
    if not rows:
        raise SystemExit(f"docs: no row of {names} has the fields of {templates}")
    yield from (header, "|" + " --- |" * (header.count("|") - 1), *rows)


def _metrics_of(name: str) -> dict[str, Any]:
    path = DOCS / "data" / f"{name}.json"
    if not path.is_file():
        raise FileNotFoundError(f"{path.name} is missing: run the page that has it, with --run")
    text = path.read_text(encoding="utf-8")
    metrics: dict[str, Any] = json.loads(text, object_pairs_hook=_Metrics)["metrics"]
    return metrics


def _rows(metrics: Mapping[str, Any], path: str) -> Iterator[Mapping[str, Any]]:
    if not path:
        yield metrics
        return
    found: Any = metrics
    for part in filter(None, path.strip("/").split("/")):
        found = found[part]
    for key, entry in found.items() if isinstance(found, Mapping) else enumerate(found, 1):
        if isinstance(entry, Mapping):
            yield {**entry, "key": key}


def main(
    run: Annotated[tuple[str, ...], tyro.conf.arg(metavar="PAGE")] = (), check: bool = False
) -> None:
    """Run the commands of these pages (`all` for every page), and fill all tables."""
    pages = sorted(DOCS.rglob("*.md"))
    for page in pages:
        if page.stem in run or "all" in run:
            for one in runs_of(page.read_text(encoding="utf-8")):
                one.carry_out()
    stale = []
    for path in [ROOT / "README.md", *pages]:
        text = path.read_text(encoding="utf-8")
        new = filled(text)
        if new != text:
            stale.append(str(path.relative_to(ROOT)))
            if not check:
                path.write_text(new, encoding="utf-8")
    print("\n".join(f"{'stale' if check else 'written'}: {name}" for name in stale))
    sys.exit(1 if check and stale else 0)


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
