"""A body as a web page: MuJoCo in a browser does what a Simulation does; what it refuses."""

import base64
import gzip
import hashlib
import io
import json
import re
import tarfile
import warnings

import numpy as np
import pytest
from browser import needs_chromium, told
from spatial import space_body

import mcmj
from mcmj.experiments.command_line import main
from mcmj.experiments.web.config import Config
from mcmj.experiments.web.run import scene_of
from mcmj.metrics.orbits import orbit_distances
from mcmj.mjcf.bundled import model_path
from mcmj.pictures.web_page import package as web_package
from mcmj.pictures.web_page.package import PACKAGE, open_package, without_custom_sections
from mcmj.pictures.web_page.page import EXPORT, page
from mcmj.utils.errors import (
    InvalidArgumentError,
    OtherPhysicsWarning,
    PackageError,
    UnknownNameError,
)

# of the outputs, within 2,000 steps; found: 1.4e-12 and 6.5e-12 (with the bodies of mcmj) at most
TOLERANCE, BUNDLED_TOLERANCE = 1e-11, 5e-11
CHECKED = """
while (!document.title.startsWith("check")) await new Promise((next) => setTimeout(next, 50));
return document.title.slice(6);
"""
STARTED = """
const soon = () => new Promise((next) => setTimeout(next, 20));
const until = async (so) => { while (!so()) await soon(); };
const said = document.getElementById("status");
await until(() => window.mcmj?.buttons?.pause.textContent);
const { loop, canvases, trail, buttons } = window.mcmj;
"""
ACTED = (
    STARTED
    + """
const { free, dimensions, rest, stops } = loop.scene, body = canvases.body, did = {};
const node = 0, view = body.getBoundingClientRect();
body.setPointerCapture = () => {};
const send = (kind, x, y) => body.dispatchEvent(new PointerEvent(kind, {
    bubbles: true, pointerId: 1, button: 0, clientX: view.left + x, clientY: view.top + y }));
const press = (key, on = document.body) =>
    on.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true }));
await until(() => trail.rows.length > 5);
did.draws = body.getContext("2d").getImageData(0, 0, body.width, body.height).data.some((v) => v);

const before = Array.from(loop.qpos), steps = loop.steps;
send("pointerdown", view.width / 2, view.height / 2);
send("pointermove", view.width / 2 + 300, view.height / 2);
const { index } = loop.pull, at = index * dimensions;
did.pulls = loop.pull.x > loop.qpos[at];
await until(() => loop.steps > steps + 200);
did.moves = loop.qpos[at] > before[at] && loop.xfrc_applied[6 * (index + 1)] > 0;
send("pointerup", 0, 0);
did.lets_go = loop.pull === null && loop.xfrc_applied.every((force) => force === 0);

buttons.freeze[1].click();
const held = loop.shown[1], free_one = loop.shown[0], then = loop.steps;
did.pressed = buttons.freeze[1].getAttribute("aria-pressed") === "true";
await until(() => loop.steps > then + 200);
did.freezes = loop.shown[1] === held && loop.shown[0] !== free_one;
press("2");
did.frees_by_key = loop.held[1] === null;

const slow = Array.from(loop.qvel);
press("k");
did.kicks = loop.qvel.some((speed, i) => Math.abs(speed - slow[i]) > 0.05);
press(" ");
const stopped = loop.steps;
await new Promise((next) => setTimeout(next, 300));
did.pauses = loop.steps === stopped;
press(" ");
press("n", body);
press("ArrowRight", body);
did.pulls_by_key = loop.pull.x > loop.qpos[0];
const slider = document.querySelector("input[type=range]");
slider.value = 14;
slider.dispatchEvent(new Event("input"));
did.inputs = loop.inputs[0] === 1 && stops[0][14] === 1 && loop.inputs[1] === 0;

loop.qpos[at] = NaN;
await until(() => said.classList.contains("wrong"));
did.blown = [loop.qpos.every(Number.isFinite), said.textContent, loop.steps < 200];
return JSON.stringify(did);
"""
)
HEADER, TYPES = b"\0asm\1\0\0\0", b"\x01\x04\x01\x60\x00\x00"  # one type, () -> ()
WRITTEN = {
    "euler": {"integrator": "Euler"},
    "rk4": {"integrator": "RK4"},
    "discrete": {"integrator": "discrete"},
    "leapfrog": {"integrator": "leapfrog"},
    "delayed": {"integrator": "Euler", "feedback_delay": 3e-3},
    "fine": {"integrator": "Euler", "timestep": 5e-4, "control_period": 1e-3},
    "space": {"integrator": "Euler"},
}


@pytest.fixture(scope="module")
def package():
    try:
        return open_package()
    except PackageError as error:
        pytest.skip(str(error))


def small_body(folder, name="euler", **others):
    """The file of a body with two inputs and some readout, stepped as WRITTEN says."""
    shape = {"nodes": 8, "n_inputs": 2, "input_fraction": 0.5}
    body = space_body(**shape) if name == "space" else mcmj.random_body(seed=3, **shape)
    weights = np.random.default_rng(0).normal(0.0, 3.0, (body.n_springs, body.n_outputs))
    w_out = np.vstack([weights, 0.5 - body.rest_lengths @ weights])
    path = folder / f"{name}.xml"
    path.write_text(mcmj.to_mjcf(body, readouts={"mine": w_out}, **WRITTEN.get(name, {}), **others))
    return str(path)


def page_of(package, body):
    """The page; a file under leapfrog is a warning."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", OtherPhysicsWarning)
        return page(scene_of(Config(body=body)), package)


def differences(pages, folder):
    """Of the outputs from mcmj's, as the pages say."""
    return {name: float(text) for name, text in told(pages, CHECKED, folder, "check").items()}


@needs_chromium
def test_a_browser_runs_bodies_as_a_simulation_does(package, tmp_path):
    """Integrators, substeps, a delay, inputs, a push, a body in space."""
    pages = {name: page_of(package, small_body(tmp_path, name)) for name in WRITTEN}
    pages["quadratic"] = page_of(package, "quadratic")
    found = differences(pages, tmp_path)
    assert max(found.values()) < TOLERANCE, found
    one, other = (
        scene_of(Config(body=small_body(tmp_path, name))).check for name in ("euler", "delayed")
    )
    assert np.abs(one.outputs - other.outputs).max() > 1e-4  # it would be seen


@pytest.mark.slow
@needs_chromium
def test_a_browser_runs_the_bodies_that_come_with_mcmj(package, tmp_path):
    pages = {name: page_of(package, name) for name in ("general", "gaits", "input_driven")}
    found = differences(pages, tmp_path)
    assert max(found.values()) < BUNDLED_TOLERANCE, found


@needs_chromium
def test_what_a_person_does_is_done_to_the_body(package, tmp_path):
    said = told({"page": page_of(package, small_body(tmp_path))}, ACTED, tmp_path)["page"]
    acted = json.loads(said)
    assert acted.pop("blown") == [True, "The body blew up: it starts again.", True]
    assert all(acted.values()), acted


def test_the_page_needs_no_other_file(package, tmp_path):
    html = page_of(package, small_body(tmp_path))
    ours = html.replace(package.javascript.replace(EXPORT, ""), "")
    assert len(html) - len(ours) > 200_000
    assert set(re.findall(r'(?:src|href)="(.*?)"', ours)) == {"data:,"}
    assert not re.findall(r"https?://|\bimport\b", ours)
    assert html == page_of(package, small_body(tmp_path))
    licences = gzip.decompress(base64.b64decode(package.licences)).decode()
    assert "Apache License" in licences
    assert "Third-party" in licences


def test_leapfrog_becomes_euler_and_says_so(tmp_path):
    path = small_body(tmp_path, "leapfrog")
    with pytest.warns(OtherPhysicsWarning, match="written for integrator leapfrog; this run takes"):
        scene = scene_of(Config(body=path))
    assert scene.options.integrator == "Euler"
    assert "leapfrog" in scene.note
    euler = scene_of(Config(body=small_body(tmp_path)))
    assert np.array_equal(scene.check.outputs, euler.check.outputs)


def test_targets_starts_and_sliders_are_those_of_the_file():
    """On its target a readout stays: the trial runs are as near as the body is good."""
    scene = scene_of(Config(body="quadratic"))
    (readout,) = scene.readouts
    goal = mcmj.target("quadratic")
    assert len(readout.orbits) == 1
    assert orbit_distances(readout.outputs, goal).max() < 0.05
    assert scene.stops == []


def test_what_a_page_cannot_do_is_said(tmp_path):
    custom = tmp_path / "custom.xml"
    custom.write_text(mcmj.to_mjcf(mcmj.random_body(0), springs="tansig"))
    with pytest.raises(InvalidArgumentError, match=r"body: expected MuJoCo's own springs.*tansig"):
        scene_of(Config(body=str(custom)))
    arm = mcmj.Reservoir(model_path("soft_arm"), sensors="tendonpos:*", channels="*")
    other = tmp_path / "arm.xml"
    other.write_text(arm.to_mjcf())
    with pytest.raises(InvalidArgumentError, match=r"no reservoir's file .`mcmj view` shows it"):
        scene_of(Config(body=str(other)))
    with pytest.raises(UnknownNameError, match="unknown readout 'waltz'; valid choices: quadratic"):
        scene_of(Config(body="quadratic", readout="waltz"))
    silent = tmp_path / "silent.xml"
    silent.write_text(mcmj.to_mjcf(mcmj.random_body(0, n_outputs=1), integrator="Euler"))
    with pytest.raises(InvalidArgumentError, match="body: expected 2 feedback channels"):
        scene_of(Config(body=str(silent)))


# --- the package --------------------------------------------------------------------------------


def test_out_may_name_the_page(package, tmp_path):
    path = small_body(tmp_path)
    main(["web", str(path), "--out", str(tmp_path / "mine.html"), "--quiet"])
    assert (tmp_path / "mine.html").stat().st_size > 1e6
    assert json.loads((tmp_path / "metrics.json").read_text())["scenario"] == "web"


@pytest.fixture
def no_cache(monkeypatch, tmp_path):
    """An empty cache, and only those programs that a test puts into `bin`."""
    monkeypatch.setenv("MCMJ_CACHE_DIR", str(tmp_path / "cache"))
    programs = tmp_path / "bin"
    programs.mkdir()
    monkeypatch.setenv("PATH", str(programs))
    return programs


def make_npm(programs, does):
    """A program npm that `does` this, in a shell, and counts how often."""
    npm = programs / "npm"
    npm.write_text(f"#!/bin/sh\necho called $@ >> {programs}/calls\n{does}\n")
    npm.chmod(0o755)


def test_without_npm_it_says_how_to_get_the_package(no_cache, tmp_path, capsys):
    with pytest.raises(SystemExit) as caught:
        main(["web", "--out", str(tmp_path / "out"), "--quiet"])
    said = f"web: error: package: npm is not installed; `npm pack {PACKAGE}` on a machine with npm"
    assert str(caught.value.code).startswith(said)
    assert "give it as --package FILE" in str(caught.value.code)
    assert not list((tmp_path / "out").iterdir())


def test_what_npm_says_is_in_the_error(no_cache):
    make_npm(no_cache, "echo 'npm error network timeout' >&2; exit 1")
    with pytest.raises(PackageError, match=r"npm cannot fetch .* \(npm error network timeout\)"):
        open_package()


def test_another_file_than_the_right_one_is_refused(no_cache, tmp_path):
    make_npm(no_cache, "echo other > mujoco.tgz")
    with pytest.raises(PackageError, match="has another checksum"):
        open_package()
    wrong = tmp_path / "wrong.tgz"
    for content in (None, b"other"):
        if content:
            wrong.write_bytes(content)
        with pytest.raises(PackageError, match=f"expected {PACKAGE} as a .tgz file, got .*wrong"):
            open_package(wrong)
    assert not list(tmp_path.glob("cache/*"))


def test_it_is_fetched_once(no_cache, tmp_path, monkeypatch):
    source = tmp_path / "source.tgz"
    with tarfile.open(source, "w:gz") as archive:
        for name, content in (("mujoco.js", b"script"), ("mujoco.wasm", HEADER + TYPES)):
            member = tarfile.TarInfo(f"package/{name}")
            member.size = len(content)
            archive.addfile(member, io.BytesIO(content))
    digest = hashlib.sha512(source.read_bytes()).digest()
    monkeypatch.setattr(web_package, "SHA512", base64.b64encode(digest).decode())
    make_npm(no_cache, f"/bin/cp {source} mujoco.tgz")
    one, other = open_package(), open_package()
    assert one == other == open_package(source)
    assert one.javascript == "script"
    assert (no_cache / "calls").read_text() == f"called pack {PACKAGE} --silent\n"


def test_custom_sections_are_left_out():
    """A custom section (0) with a name of 3 bytes and 200 of content: its size takes two bytes."""
    content = b"\x03abc" + bytes(200)
    custom = b"\x00" + bytes([len(content) & 127 | 128, len(content) >> 7]) + content
    assert without_custom_sections(HEADER + custom + TYPES + custom) == HEADER + TYPES
