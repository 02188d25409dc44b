"""Videos on a full disk, and a MUJOCO_GL that is none: one clear line, nothing half-written."""

import os
import resource
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import mcmj
from mcmj.pictures.film import Film
from mcmj.pictures.rendering import Style, write_film
from mcmj.utils.errors import McmjError

SCRIPTS = Path(__file__).parents[2] / "scripts"
SIZE = 20_000  # bytes that are there; each video takes more


def write(folder, suffix):
    """In a child: write a video, print the error and what is left."""
    body = mcmj.random_body(1, nodes=8)
    times = 0.04 * np.arange(30)
    noise = np.random.default_rng(0).normal(size=(30, body.n_nodes, 2))
    film = Film(body, times, body.positions + 0.1 * noise, np.ones((30, body.n_outputs)))
    path = Path(folder) / f"film{suffix}"
    try:
        write_film(film, {suffix: path}, Style(renderer="matplotlib"))
    except McmjError as error:
        print(error)
    print([p.name for p in path.parent.iterdir()])


def child(folder, suffix, *prefix, limit=resource.RLIM_INFINITY):
    code = f"import test_full_disk as t; t.write({str(folder)!r}, {suffix!r})"
    done = subprocess.run(
        [*prefix, sys.executable, "-c", code],
        cwd=Path(__file__).parent, capture_output=True, text=True, timeout=120,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)),
    )  # fmt: skip
    return done.stdout.splitlines(), done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".mp4", ".gif"])
def test_a_video_that_exceeds_a_limit_of_size(suffix, tmp_path):
    lines, _ = child(tmp_path, suffix)
    assert lines == [f"['film{suffix}']"]
    (tmp_path / f"film{suffix}").unlink()
    lines, errors = child(tmp_path, suffix, limit=SIZE)
    assert lines == [f"cannot write {tmp_path}/film{suffix}: ffmpeg failed, disk full?", "[]"]
    assert "Traceback" not in errors


@pytest.mark.parametrize("suffix", [".mp4", ".gif"])
def test_a_video_on_a_full_disk(suffix, tmp_path):
    mount = f'mount -t tmpfs -o size={SIZE} tmpfs {tmp_path} && exec "$@"'
    own_mounts = ["unshare", "-rm", "sh", "-c", mount, "sh"]
    if subprocess.run([*own_mounts, "true"], capture_output=True).returncode:
        pytest.skip("no disk can be mounted here")
    lines, errors = child(tmp_path, suffix, *own_mounts)
    assert lines == [f"cannot write {tmp_path}/film{suffix}: no space left", "[]"]
    assert "Traceback" not in errors


def test_a_wrong_mujoco_gl_is_refused_before_any_work(tmp_path):
    done = subprocess.run(
        [sys.executable, SCRIPTS / "limit_cycle.py", "--out", tmp_path / "out"],
        env=os.environ | {"MUJOCO_GL": "wrong"}, capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    assert done.returncode == 1
    assert done.stderr.startswith("limit_cycle: error: unknown MUJOCO_GL 'wrong'; valid choices: ")
    assert "egl" in done.stderr or sys.platform != "linux"
    assert done.stderr.count("\n") == 1
    assert not (tmp_path / "out").exists()
