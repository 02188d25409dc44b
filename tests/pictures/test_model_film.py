"""A film of any MuJoCo model: frames of its motion, the model as it was."""

import mujoco
import numpy as np
import pytest
from PIL import Image

from mcmj.mjcf.bundled import model_path
from mcmj.pictures.model_film import HEIGHT, PANEL, WIDTH, ModelFilm, model_frames, write_model_film
from mcmj.utils.errors import InvalidArgumentError


@pytest.fixture
def film():
    model = mujoco.MjModel.from_xml_path(str(model_path("soft_arm")))
    times = 0.01 * np.arange(100)
    qpos = 0.2 * np.sin(6 * times)[:, None] * np.ones(model.nq)
    outputs = np.column_stack([np.sin(6 * times), np.cos(6 * times)])
    return ModelFilm(model, times, qpos, outputs, outputs[:80], seconds=0.2)


def test_frames_show_the_motion_beside_the_outputs(film):
    binary = np.zeros(mujoco.mj_sizeModel(film.model), np.uint8)
    mujoco.mj_saveModel(film.model, None, binary)
    frames = list(model_frames(film))
    assert len(frames) == 5
    assert all(frame.shape == (HEIGHT, WIDTH + PANEL, 3) for frame in frames)
    for part in (slice(0, WIDTH), slice(WIDTH, None)):
        assert np.abs(np.diff([f[:, part].astype(float).mean() for f in frames])).max() > 0.01
    arm = np.argwhere(frames[0][:, :WIDTH].min(axis=2) < 200)
    assert 10 < arm[:, 0].min() < arm[:, 0].max() < HEIGHT - 10  # all of it, on white
    after = np.zeros_like(binary)
    mujoco.mj_saveModel(film.model, None, after)
    assert np.array_equal(binary, after)


def test_a_film_is_an_mp4_and_its_last_picture(film, tmp_path):
    write_model_film(film, tmp_path / "arm.mp4")
    assert (tmp_path / "arm.mp4").stat().st_size > 1000
    with Image.open(tmp_path / "arm.png") as last:
        assert last.size == (WIDTH + PANEL, HEIGHT)
    assert film.pace == "4.9 x faster"


def test_what_does_not_fit_the_model_is_named(film):
    with pytest.raises(InvalidArgumentError, match="qpos"):
        ModelFilm(film.model, film.times, film.qpos[:, :3], film.outputs)
