"""Pictures show what they say: positions, colours, arrows and files, by OpenGL and without."""

import json
import subprocess
import sys
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest
from models import CHAIN, CHAIN_PARTS
from PIL import Image

import mcmj
from mcmj.experiments.render import run as render
from mcmj.mjcf.appearance import frame, node_colour
from mcmj.pictures.film import Film, ModelFilm, Window, deformation_scale, strains
from mcmj.pictures.film_figure import FilmFigure
from mcmj.pictures.film_of import film as write_film_of
from mcmj.pictures.film_of import film_of
from mcmj.pictures.flat_view import FlatView
from mcmj.pictures.model_view import BAND
from mcmj.pictures.opengl import RenderingUnavailableError
from mcmj.pictures.opengl_view import GLView
from mcmj.pictures.rendering import (
    HEIGHT,
    PANEL_WIDTH,
    WIDTH,
    Report,
    Style,
    body_view,
    film_frames,
    limit_cycle_video,
    write_film,
)
from mcmj.simulation.trajectory_files.npz import save_trajectory
from mcmj.utils.colours import (
    CHANGE_COLOUR,
    FIXED_COLOUR,
    SHORTENED_COLOUR,
    STRETCHED_COLOUR,
    strain_colours,
)
from mcmj.utils.errors import InvalidArgumentError, TrajectoryFileError, UnknownNameError

SCRIPT = Path(__file__).parents[2] / "scripts" / "render.py"


@pytest.fixture(scope="module", params=["mujoco", "matplotlib"])
def view(request, body):
    try:
        with body_view(body, Style(renderer=request.param)) as opened:
            yield opened
    except RenderingUnavailableError as error:
        pytest.skip(f"no OpenGL here: {error}")


@pytest.fixture(scope="module")
def film(body, w_out):
    """2 s of a body that a force pulls, every 10 ms."""
    simulation = mcmj.Simulation(body, w_out=w_out)
    forces = np.where(body.fixed, 0.0, 30.0)
    run = simulation.rollout(2000, forces=forces, record=("positions", "outputs"))
    sparse = slice(None, None, 10)
    return Film(
        body, run.times[sparse], run.positions[sparse], run.outputs[sparse],
        forces=np.tile(forces, (200, 1)), windows=(Window(0.5, 1.0, "pulled"),),
    )  # fmt: skip


def pixel(body, point):
    """Row and column of a point of the plane in a picture of 640 x 480 seen from above."""
    cx, cy, width, height = frame(body)
    scale = HEIGHT / max(width, height)
    column, row = WIDTH / 2 + scale * (point[0] - cx), HEIGHT / 2 - scale * (point[1] - cy)
    return round(row), round(column)


def rest(body):
    return body.positions, strain_colours(np.zeros(body.n_springs), 0.0), np.zeros(body.n_nodes)


def like(pixels, colour, tolerance=45):
    """Whether pixels have a colour, in whatever light."""
    return (np.abs(pixels.astype(float) - 255 * np.array(colour)) < tolerance).all(axis=-1)


def test_every_node_is_where_it_should_be_in_the_colour_of_its_role(view, body):
    picture = view.draw(*rest(body))
    assert picture.shape == (HEIGHT, WIDTH, 3)
    for node, position in enumerate(body.positions):
        row, column = pixel(body, position)
        assert like(picture[row, column], node_colour(body, node)), node


def test_springs_are_red_where_stretched_and_blue_where_shortened(view, body):
    for sign, colour in ((1.0, STRETCHED_COLOUR), (-1.0, SHORTENED_COLOUR)):
        strained = np.zeros(body.n_springs)
        strained[3] = sign
        picture = view.draw(body.positions, strain_colours(strained, 1.0), np.zeros(body.n_nodes))
        row, column = pixel(body, body.positions[body.springs[3]].mean(axis=0))
        near = picture[row - 2 : row + 3, column - 2 : column + 3]
        assert like(near, colour).any()


def test_arrows_have_their_length(view, body):
    node, length = int(body.free[0]), 0.2 * max(frame(body)[2:])
    arrows = np.zeros(body.n_nodes)
    arrows[node] = length
    positions, colours, none = rest(body)
    changed = view.draw(positions, colours, arrows) != view.draw(positions, colours, none)
    columns = np.flatnonzero(changed.any(axis=(0, 2)))
    _, start = pixel(body, body.positions[node])
    _, tip = pixel(body, body.positions[node] + [length, 0.0])
    assert abs(columns.max() - tip) <= 4  # the arrow lies a little nearer to the camera
    assert columns.min() > start - 4


def test_without_opengl_matplotlib_draws(body, monkeypatch):
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    monkeypatch.delenv("DISPLAY", raising=False)
    report = Report()
    with body_view(body, report=report) as view:
        assert isinstance(view, FlatView)
    assert "apt-get install libegl1" in report.why_flat
    with pytest.raises(RenderingUnavailableError, match="no EGL"):
        GLView(body, WIDTH, HEIGHT)


def test_scales(body, film):
    assert film.scale == deformation_scale(body, film.positions)
    moved = film.scale * np.abs(film.positions - body.positions).max()
    largest = max(frame(body)[2:])
    assert moved <= 0.05 * largest or film.scale == 1.0
    a, b = body.springs[0]
    length = np.linalg.norm(film.positions[-1, a] - film.positions[-1, b])
    strain = strains(body, film.positions[-1])[0]
    assert strain == pytest.approx(length / body.rest_lengths[0] - 1.0, abs=1e-14)
    colours = np.array([film.colours(i) for i in range(200)])[..., None, :]
    full = np.isclose(colours, [STRETCHED_COLOUR, SHORTENED_COLOUR], rtol=0, atol=1e-9)
    assert full.all(axis=-1).sum() == 1  # one spring at one time: none saturates
    assert film.arrows(7).max() == pytest.approx(0.12 * largest)
    assert (film.label(49), film.label(50), film.label(100)) == ("", "pulled", "")


@pytest.mark.parametrize(("fps", "speed", "step"), [(25, 1, 4), (25, 2, 8), (50, 0.5, 1)])
def test_speed(film, fps, speed, step):
    assert np.array_equal(film.pick(fps, speed), np.arange(0, 200, step))


def test_the_outputs_draw_themselves_and_the_window_is_marked(film):
    figure = FilmFigure(film, "real time", WIDTH, HEIGHT, PANEL_WIDTH)
    white = np.full((HEIGHT, WIDTH, 3), 255, np.uint8)
    early, late = (figure.draw(white, index) for index in (10, 199))
    assert early.shape == (HEIGHT, WIDTH + PANEL_WIDTH, 3)
    shade = 0.15 * np.array(CHANGE_COLOUR) + 0.85  # 0.5 s of 2 s
    assert 0.2 < like(early[400, WIDTH:], shade, 4).mean() < 0.3
    dark = [(frame[:, WIDTH:].sum(axis=-1) < 150).sum() for frame in (early, late)]
    assert dark[1] > dark[0]


def test_words_lie_on_the_picture_of_the_body(film):
    figure = FilmFigure(film, "real time", WIDTH, HEIGHT, PANEL_WIDTH)
    grey = np.full((HEIGHT, WIDTH, 3), 128, np.uint8)
    frame = figure.draw(grey, 0)[:, :WIDTH]
    assert (frame[100:400] == 128).all()  # the middle is the picture
    assert (frame <= 128).all()
    assert (frame[-30:].max(axis=-1) < 30).any()  # time
    assert like(frame[:60], np.minimum(STRETCHED_COLOUR, 0.5), 30).any()  # legend


def decoded(path):
    """Frames (F, 480, 1024, 3) of a video, and what ffmpeg says about it."""
    words = [imageio_ffmpeg.get_ffmpeg_exe(), "-i", path, "-f", "rawvideo", "-pix_fmt", "rgb24"]
    done = subprocess.run([*words, "-"], capture_output=True, check=True)
    frames = np.frombuffer(done.stdout, np.uint8).reshape(-1, HEIGHT, WIDTH + PANEL_WIDTH, 3)
    return frames, done.stderr.decode()


def test_files_have_the_frames_they_should(film, tmp_path):
    paths = {kind: tmp_path / f"film{kind}" for kind in (".mp4", ".gif", ".png")}
    report = write_film(film, paths, Style(renderer="matplotlib"), stills=2)
    frames, account = decoded(paths[".mp4"])
    assert len(frames) == len(report.frame_ms) == 50
    assert "25 fps" in account
    shown = frames[20]
    drawn = list(film_frames(film, Style(renderer="matplotlib")))[20]
    assert np.abs(shown.astype(int) - drawn).mean() < 3.0  # compressed
    with Image.open(paths[".gif"]) as gif:
        assert (gif.n_frames, gif.size) == (25, ((WIDTH + PANEL_WIDTH) // 2, HEIGHT // 2))
    assert sorted(p.name for p in tmp_path.iterdir()) == [
        "film.gif", "film.mp4", "film_0024.png", "film_0049.png",
    ]  # fmt: skip


def test_limit_cycle_video(film, tmp_path):
    times = film.times
    limit_cycle_video(
        tmp_path / "v.mp4", film.body, mcmj.target("lissajous"), times, film.positions,
        film.outputs, seconds=1.0,
    )  # fmt: skip
    assert len(decoded(tmp_path / "v.mp4")[0]) == 26


def test_what_cannot_be_shown_is_said(film, tmp_path):
    with pytest.raises(InvalidArgumentError, match="at least two steps"):
        Film(film.body, film.times[:1], film.positions[:1], film.outputs[:1])
    with pytest.raises(UnknownNameError, match="auto, matplotlib, mujoco"):
        Style(renderer="vulkan")
    with pytest.raises(InvalidArgumentError, match=r"\.mp4 or \.gif"):
        write_film(film, {".mp4": tmp_path / "film.avi"}, Style(renderer="matplotlib"))
    assert not list(tmp_path.iterdir())


def script(*options):
    words = [sys.executable, SCRIPT, *map(str, options)]
    return subprocess.run(words, capture_output=True, text=True, timeout=120)


def test_script_renders_a_trajectory_file(film, w_out, tmp_path):
    simulation = mcmj.Simulation(film.body, w_out=w_out)
    run = simulation.rollout(1000, record=("positions", "outputs"))
    save_trajectory(tmp_path / "run.npz", run, body=film.body, w_out=w_out)
    out = tmp_path / "out"
    done = script("--trajectory", tmp_path / "run.npz", "--formats", "png", "--out", out)
    assert done.returncode == 0, done.stderr
    document = json.loads((out / "metrics.json").read_text())
    assert document["metrics"]["frames"] == 25
    assert document["metrics"]["body_frame_ms"] > 0
    with Image.open(out / "film_0024.png") as still:
        row, column = pixel(film.body, film.body.positions[film.body.fixed][0])
        assert like(np.asarray(still)[row, column], FIXED_COLOUR)


def test_it_is_said_what_a_trajectory_lacks(film, tmp_path):
    run = mcmj.Simulation(film.body).rollout(10)
    save_trajectory(tmp_path / "run.npz", run)
    with pytest.raises(TrajectoryFileError, match="a film needs the body and the positions"):
        render.run(render.Config(trajectory=tmp_path / "run.npz"))


def test_a_disturbed_film_marks_what_happened():
    config = render.Config(
        body="van_der_pol", before=1.0, during=1.0, after=1.0, freeze=(2,), forces=5.0
    )
    film = render.run(config)
    assert film.windows[0].label == "output x2 frozen, random forces up to 5 N"
    inside = slice(1000, 2000)
    assert np.ptp(film.outputs[inside, 1]) == 0.0  # frozen
    pushed = film.forces - np.where(film.body.fixed, 0.0, film.outputs @ film.body.w_fb.T)
    assert np.abs(pushed[:1000]).max() < 1e-12
    assert np.ptp(pushed[inside], axis=0).max() < 1e-12
    assert 2.5 < np.abs(pushed[inside]).max() <= 5.0


def test_a_film_of_any_model_shows_it_and_its_outputs(tmp_path):
    w_out = np.random.default_rng(0).normal(size=(5, 2)) / 50
    reservoir = mcmj.Reservoir(CHAIN, **CHAIN_PARTS, w_out=w_out)
    reservoir.set_state(qvel=[10.0, -20.0])
    recorded = film_of(reservoir, 1.0)
    assert isinstance(recorded, ModelFilm)
    assert recorded.qpos.shape == (500, 2)
    try:
        frames = list(film_frames(recorded))
    except RenderingUnavailableError:
        pytest.skip("no OpenGL here")
    assert len(frames) == 25
    model = np.stack(frames)[:, BAND:-BAND, :WIDTH].astype(int)
    moved = np.abs(np.diff(model, axis=0)).max(axis=-1) > 10
    assert moved.any(axis=(1, 2)).all()  # the chain moves in every picture
    assert (np.stack(frames)[:, :BAND, :WIDTH] > 200).mean() > 0.9
    write_film_of(reservoir, tmp_path / "chain.gif", 0.2)
    assert (tmp_path / "chain.gif").stat().st_size > 1000
    with pytest.raises(UnknownNameError, match="unknown camera 'no'"):
        film_of(reservoir, 0.1, camera="no")
