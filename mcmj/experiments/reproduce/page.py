"""One self-contained HTML page: the table of claims, every figure and video, no other file."""

import base64
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path

from mcmj.experiments.reproduce.claims import Outcome, Part

STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; max-width: 75rem; margin: 2rem auto; padding: 0 1rem;
       color: #222; }
table { border-collapse: collapse; width: 100%; }
th, td { text-align: left; padding: .3rem .6rem; border-bottom: 1px solid #ddd;
         vertical-align: top; }
td.yes { color: #14722d; font-weight: 600; } td.no { color: #b3261e; font-weight: 600; }
img, video { max-width: 100%; margin: .6rem 0; }
figcaption, code, .small { color: #666; font-size: .85rem; }
h2 { margin-top: 2.5rem; border-bottom: 2px solid #eee; }
"""
KINDS = {".png": "image/png", ".gif": "image/gif", ".mp4": "video/mp4"}


def page(
    title: str,
    parts: Sequence[Part],
    outcomes: Mapping[str, Sequence[Outcome]],
    files: Mapping[str, Sequence[Path]],
    commands: Mapping[str, Sequence[str]],
    account: str,
) -> str:
    """The page.

    Args:
        outcomes: of each part's claims, by its name.
        files: pictures and videos of each part.
        commands: that made them, of each part.
        account: configuration and versions, in a line.
    """
    held = sum(outcome.holds for part in parts for outcome in outcomes[part.name])
    total = sum(len(outcomes[part.name]) for part in parts)
    sections = "\n".join(
        f'<h2 id="{part.name}">{escape(part.title)}</h2>\n'
        + "".join(f"<p><code>{escape(line)}</code></p>\n" for line in commands[part.name])
        + "".join(_figure(path) for path in files[part.name])
        for part in parts
    )
    rows = "\n".join(_row(part, outcome) for part in parts for outcome in outcomes[part.name])
    return f"""<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>
<style>{STYLE}</style></head><body>
<h1>{escape(title)}</h1>
<p>After Hauser, Ijspeert, Füchslin, Pfeifer and Maass, <em>The role of feedback in morphological
computation with compliant bodies</em>, Biol. Cybern. 106 (2012) 595&ndash;613.
<strong>{held} of {total} claims hold</strong>: the successes do not refute the rate that is needed
(95 % Wilson interval).</p>
<table><thead><tr><th>figure</th><th>claim</th><th>paper</th><th>ours: median (range)</th>
<th>successes</th><th>needed</th><th>holds</th></tr></thead><tbody>
{rows}
</tbody></table>
{sections}
<p class="small">{escape(account)}</p>
</body></html>
"""


def _row(part: Part, outcome: Outcome) -> str:
    claim, rate = outcome.claim, outcome.rate
    verdict = ("yes", "yes") if outcome.holds else ("no", "no")
    cells = [
        f'<a href="#{part.name}">{escape(part.name)}</a>',
        escape(claim.text),
        escape(claim.paper),
        escape(outcome.ours),
        f"{rate['successes']} of {rate['of']}",
        f"{claim.needed:.0%}",
    ]
    tail = f'<td class="{verdict[0]}">{verdict[1]}</td>'
    return "<tr>" + "".join(f"<td>{cell}</td>" for cell in cells) + tail + "</tr>"


def _figure(path: Path) -> str:
    kind = KINDS[path.suffix]
    source = f"data:{kind};base64,{base64.b64encode(path.read_bytes()).decode()}"
    name = escape(f"{path.parent.name}/{path.name}")
    if kind.startswith("video"):
        inside = f'<video controls muted loop src="{source}"></video>'
    else:
        inside = f'<img alt="{name}" src="{source}">'
    return f"<figure>{inside}<figcaption>{name}</figcaption></figure>\n"
