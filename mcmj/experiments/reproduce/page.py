"""One self-contained HTML page: the table of claims, every figure and video, no other file."""

import base64
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path

from mcmj.experiments.reproduce.captions import caption
from mcmj.experiments.reproduce.claims import FEW, Outcome, Part
from mcmj.experiments.reproduce.runner import Cost

STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; max-width: 75rem; margin: 2rem auto; padding: 0 1rem;
       color: #222; }
table { border-collapse: collapse; width: 100%; }
th, td { text-align: left; padding: .3rem .6rem; border-bottom: 1px solid #ddd;
         vertical-align: top; }
td.yes { color: #14722d; font-weight: 600; } td.no { color: #b3261e; font-weight: 600; }
figure { margin: 1rem 0; } img, video { max-width: 100%; height: auto; }
figcaption, code, .small { color: #666; font-size: .85rem; overflow-wrap: anywhere; }
h2 { margin-top: 2.5rem; border-bottom: 2px solid #eee; }
@media (max-width: 45rem) {
  thead { display: none; } table, tbody, tr, td { display: block; }
  tr { border-bottom: 2px solid #ddd; padding: .5rem 0; }
  td { border: 0; padding: .1rem 0; }
  td::before { content: attr(data-label) ": "; color: #666; font-weight: 400; }
}
"""
KINDS = {".png": "image/png", ".gif": "image/gif", ".mp4": "video/mp4"}
OF_CLAIMS = ("figure", "claim", "paper", "ours: median (range)", "successes", "needed", "holds")
OF_COSTS = ("command", "seconds", "processor seconds", "share")


def page(
    title: str,
    parts: Sequence[Part],
    outcomes: Mapping[str, Sequence[Outcome]],
    files: Mapping[str, Sequence[Path]],
    commands: Mapping[str, Sequence[str]],
    account: str,
    costs: Mapping[str, Cost] = {},
) -> str:
    """The page.

    Args:
        outcomes: of each part's claims, by its name.
        files: pictures and videos of each part.
        commands: that made them, of each part; a part without any has no section.
        account: configuration and versions, in a line.
        costs: of the commands, by name.
    """
    sections = "\n".join(_section(part, commands, files) for part in parts if commands[part.name])
    rows = [_row(part, outcome) for part in parts for outcome in outcomes[part.name]]
    count = _count([outcome for part in parts for outcome in outcomes[part.name]])
    return f"""<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1"><title>{escape(title)}</title>
<style>{STYLE}</style></head><body>
<h1>{escape(title)}</h1>
<p>After Hauser, Ijspeert, Füchslin, Pfeifer and Maass, <em>The role of feedback in morphological
computation with compliant bodies</em>, Biol. Cybern. 106 (2012) 595&ndash;613.
{count}</p>
{_table(OF_CLAIMS, rows)}
{sections}
{_times(costs)}
<p class="small">{escape(account)}</p>
</body></html>
"""


def _count(outcomes: Sequence[Outcome]) -> str:
    decided = [outcome for outcome in outcomes if outcome.decided]
    held, few = sum(outcome.holds for outcome in decided), len(outcomes) - len(decided)
    text = (
        f"<strong>{held} of {len(decided)} claims hold</strong>: the successes do not refute the "
        "rate that is needed (95 % Wilson interval)."
    )
    if few:
        text += f" Of {few} more, over fewer than {FEW} bodies, the successes are only counted."
    return text


def _section(
    part: Part, commands: Mapping[str, Sequence[str]], files: Mapping[str, Sequence[Path]]
) -> str:
    lines = "".join(f"<p><code>{escape(line)}</code></p>\n" for line in commands[part.name])
    figures = "".join(_figure(path) for path in files[part.name])
    return f'<h2 id="{part.name}">{escape(part.title)}</h2>\n{lines}{figures}'


def _row(part: Part, outcome: Outcome) -> list[tuple[str, str]]:
    """Cells, each with its class."""
    claim, rate = outcome.claim, outcome.rate
    return [
        (f'<a href="#{part.name}">{escape(part.name)}</a>', ""),
        (escape(claim.text), ""),
        (escape(claim.paper), ""),
        (escape(outcome.ours), ""),
        (f"{rate['successes']} of {rate['of']}", ""),
        (f"{claim.needed:.0%}", ""),
        (outcome.verdict, outcome.verdict if outcome.verdict in ("yes", "no") else ""),
    ]


def _times(costs: Mapping[str, Cost]) -> str:
    """Where the time goes, the longest first; nothing without commands."""
    if not costs:
        return ""
    total = sum(cost.seconds for cost in costs.values())
    rows = [
        [
            (escape(name), ""),
            (f"{cost.seconds:.1f}", ""),
            ("" if cost.processor_seconds is None else f"{cost.processor_seconds:.1f}", ""),
            (f"{cost.seconds / total:.0%}", ""),
        ]
        for name, cost in sorted(costs.items(), key=lambda pair: -pair[1].seconds)
    ]
    return f"<h2>Where the time goes</h2>\n{_table(OF_COSTS, rows)}"


def _table(names: Sequence[str], rows: Sequence[Sequence[tuple[str, str]]]) -> str:
    """Each cell names its column: a narrow screen shows the cells of a row below each other."""
    head = "".join(f"<th>{escape(name)}</th>" for name in names)
    body = "\n".join(
        "<tr>"
        + "".join(
            f'<td data-label="{escape(name)}" class="{kind}">{cell}</td>'
            for name, (cell, kind) in zip(names, row, strict=True)
        )
        + "</tr>"
        for row in rows
    )
    return f"<table><thead><tr>{head}</tr></thead><tbody>\n{body}\n</tbody></table>"


def _figure(path: Path) -> str:
    kind = KINDS[path.suffix]
    source = f"data:{kind};base64,{base64.b64encode(path.read_bytes()).decode()}"
    text = escape(caption(path.parent.name, path.stem))
    if kind.startswith("video"):
        inside = f'<video controls muted loop playsinline src="{source}"></video>'
    else:
        inside = f'<img alt="{text}" src="{source}">'
    return f"<figure>{inside}<figcaption>{text}</figcaption></figure>\n"
