"""The reproduction: claims judged by numbers, runs resumed, a page that needs no other file."""

import re
import shutil
import subprocess
import sys

import numpy as np
import pytest

from mcmj.experiments.reproduce.captions import OF_RUNS, caption
from mcmj.experiments.reproduce.claims import Claim, Command, chosen, judge
from mcmj.experiments.reproduce.page import page
from mcmj.experiments.reproduce.paper import PARTS
from mcmj.experiments.reproduce.runner import Cost, cost_of, execute, finished, metrics_of
from mcmj.pictures.plotting import new_figure, save
from mcmj.utils.errors import McmjError, UnknownNameError
from mcmj.utils.files import write_metrics

METRICS = {"a": {"x": 0.01, "y": [0.02, None]}, "b": [{"z": 1.0}, {"z": 0.04}]}
SCRIPT = """
import json, pathlib, sys
out = pathlib.Path(sys.argv[sys.argv.index("--out") + 1])
out.mkdir(parents=True)
if "--fail" in sys.argv:
    sys.exit("it went wrong")
count = out.parent / "count"
count.write_text(str(int(count.read_text()) + 1) if count.exists() else "1")
(out / "metrics.json").write_text(json.dumps({"metrics": {"a": 1}}))
"""

PROBE = """<script>onload = () => {
document.title = [...document.images].every(image => image.naturalWidth > 100)
    ? "all pictures shown" : "a picture is missing" }</script>"""


def test_all_numbers_of_a_claim_count_and_null_is_infinite():
    outcome = judge(Claim("it works", "yes", "run", ("a/x", "a/y/*", "b/*/z")), METRICS)
    assert outcome.values == (0.01, 0.02, np.inf, 1.0, 0.04)
    assert outcome.rate["successes"] == 3
    with pytest.raises(UnknownNameError, match="unknown number of the metrics 'a/w'"):
        judge(Claim("it works", "yes", "run", ("a/x", "a/w")), METRICS)


def test_a_claim_holds_unless_the_successes_refute_it():
    claim = Claim("it works", "yes", "run", ("b/*/z",))
    half = judge(claim, METRICS)
    assert half.rate["successes"] == 1
    assert half.holds  # 1 of 2 does not refute 90 %
    many = judge(claim, {"b": [{"z": 1.0}] * 10 + [{"z": 0.0}] * 10})
    assert not many.holds  # 10 of 20 do
    strict = judge(Claim("all", "all", "run", ("b/*/z",), needed=1.0), METRICS)
    assert not strict.holds
    assert many.ours == "50.00% (0.00% to 100.00%)"


def test_parts_are_chosen_by_name():
    assert [part.name for part in chosen(PARTS, ["fig6"])] == ["fig6"]
    assert chosen(PARTS, []) == list(PARTS)
    with pytest.raises(UnknownNameError, match="fig5"):
        chosen(PARTS, ["fig99"])
    runs = {run.name for part in PARTS for run in part.runs}
    assert all(claim.run in runs for part in PARTS for claim in part.claims)


def test_a_finished_command_is_not_run_again_and_a_failed_one_is(tmp_path):
    (tmp_path / "script.py").write_text(SCRIPT)
    program = (sys.executable, str(tmp_path / "script.py"))
    run, out = Command("one", "script", (), ()), tmp_path / "out"
    assert not finished(run, (), out)
    execute(run, (), out, program)
    assert finished(run, (), out)
    assert not finished(run, ("--more",), out)  # another command
    assert metrics_of(run, out) == {"a": 1}
    with pytest.raises(McmjError, match="script --fail failed: it went wrong"):
        execute(run, ("--fail",), out, program)
    assert not finished(run, ("--fail",), out)
    execute(run, (), out, program)
    assert (out / "count").read_text() == "2"


@pytest.fixture
def document(tmp_path):
    figure = new_figure(2.0, 2.0)
    figure.add_subplot().plot([0, 1])
    save(figure, tmp_path / "run.png")
    part = PARTS[2]
    outcome = judge(Claim("<works> & holds", "yes", "run", ("a/x",)), METRICS)
    html = page(
        "A <title>", [part], {part.name: [outcome]}, {part.name: [tmp_path / "run.png"]},
        {part.name: ["sh scripts/run.sh perturb"]}, "{}",
    )  # fmt: skip
    (tmp_path / "page.html").write_text(html)
    return tmp_path / "page.html"


def test_the_page_refers_to_nothing_outside(document):
    html = document.read_text()
    assert "&lt;works&gt; &amp; holds" in html
    sources = re.findall(r'(?:src|href)="([^"]*)"', html)
    assert sources
    assert all(source.startswith(("data:", "#")) for source in sources)
    anchors = {source[1:] for source in sources if source.startswith("#")}
    assert anchors <= set(re.findall(r'id="([^"]*)"', html))


@pytest.mark.skipif(shutil.which("chromium") is None, reason="no chromium")
def test_a_browser_shows_the_page_with_its_pictures(document, tmp_path):
    """Headless Chromium lays it out; every picture has a size of its own."""
    document.write_text(document.read_text().replace("</body>", PROBE + "</body>"))
    done = subprocess.run(
        ["chromium", "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run",
         "--disable-background-networking", "--disable-component-update", "--disable-sync",
         f"--user-data-dir={tmp_path / 'profile'}", "--virtual-time-budget=5000", "--dump-dom",
         document.as_uri()],
        capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    assert "<title>all pictures shown</title>" in done.stdout, done.stderr[-500:]


def test_an_account_of_another_version_is_not_taken(tmp_path):
    run = Command("one", "script", (), ())
    (tmp_path / "one").mkdir()
    write_metrics(tmp_path / "one" / "metrics.json", "script", {}, 0, {})
    (tmp_path / "one" / "account.json").write_text("{}")
    assert not finished(run, (), tmp_path)


def test_few_bodies_are_counted_and_not_judged():
    two = {"b": [{"z": 0.0}, {"z": 0.0}, {"z": 1.0}]}
    outcome = judge(Claim("it works", "yes", "run", ("b/*/z",)), two)
    assert outcome.holds
    assert outcome.verdict == "2 of 3"
    assert outcome.plain["verdict"] == "2 of 3"
    assert judge(Claim("all", "all", "run", ("b/*/z",), needed=1.0), two).verdict == "no"
    many = {"b": [{"z": 0.0}] * 20}
    assert judge(Claim("it works", "yes", "run", ("b/*/z",)), many).verdict == "yes"
    one = judge(Claim("it works", "yes", "run", ("b/0/z",)), two)
    assert one.verdict == "yes"


def test_the_page_has_no_empty_headings_and_captions_in_words(tmp_path):
    part, bare = PARTS[2], PARTS[0]
    figure = new_figure(2.0, 2.0)
    figure.add_subplot().plot([0, 1])
    (tmp_path / "perturb").mkdir()
    save(figure, tmp_path / "perturb" / "noise_tolerance.png")
    outcome = judge(Claim("it works", "yes", "run", ("a/x",)), METRICS)
    files = {part.name: [tmp_path / "perturb" / "noise_tolerance.png"], bare.name: []}
    html = page(
        "A title", [bare, part], {bare.name: [], part.name: [outcome]}, files,
        {bare.name: [], part.name: ["mcmj perturb"]}, "{}", {"perturb": Cost(3.25, None)},
    )  # fmt: skip
    assert 'name="viewport"' in html
    assert bare.title not in html
    assert re.findall("<h2.*?>(.*?)</h2>", html) == [part.title, "Where the time goes"]
    (told,) = re.findall("<figcaption>(.*?)</figcaption>", html)
    assert told.startswith("Orbit error after some time of noise")
    cells = re.findall(r'<td data-label="([^"]+)"', html)
    assert len(cells) == 7 + 4  # each names its column, where there is no room for a head


def test_every_picture_of_the_runs_has_a_caption_of_its_own():
    assert len(set(OF_RUNS.values())) == len(OF_RUNS)
    runs = {run.name for part in PARTS for run in part.runs}
    assert {run for run, _ in OF_RUNS} == runs
    assert caption("limit_cycle", "quadratic") == (
        "The body in its free run: the quadratic limit cycle."
    )
    assert caption("perturb", "another_figure") == "Perturb: another figure."


def test_what_a_command_took_is_kept(tmp_path):
    (tmp_path / "script.py").write_text(SCRIPT)
    run, started = Command("one", "script", (), ()), []
    execute(run, (), tmp_path, (sys.executable, str(tmp_path / "script.py")), started.append)
    cost = cost_of(run, tmp_path)
    assert len(started) == 1
    assert cost is not None
    assert cost_of(Command("two", "script", (), ()), tmp_path) is None
    assert 0 < cost.seconds < 60
    assert cost.processor_seconds is None or 0 < cost.processor_seconds < 60
