"""MP4 of a robot whose trunk is the computer, seen from the side, with its gait diagram."""

from collections.abc import Mapping
from pathlib import Path

import imageio_ffmpeg
import mediapy
import mujoco
import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw, ImageFont

from mcmj.pictures.walk_video import FPS, INK, Event, GaitDiagram, strain_colours
from mcmj.robots.trunk_walker import TrunkWalker
from mcmj.robots.walk_metrics import joined
from mcmj.utils.errors import McmjError
from mcmj.utils.files import whole_file
from mcmj.utils.validation import Array

Frame = npt.NDArray[np.uint8]

WIDTH, HEIGHT = 640, 480  # pixels of the robot's picture; the diagram is beside it
FULL_STRAIN = 0.05
MUSCLE = (0.49, 0.23, 0.62)


def trunk_video(path: str | Path, walkers: Mapping[str, TrunkWalker], *, shown: float) -> None:
    """Film gaits one after the other in real time, each going on from where its walker is.

    Args:
        walkers: by gait, in closed loop; of one robot.
        shown: time of each [s].

    Raises:
        McmjError: no OpenGL.
        OutputError: the file cannot be written.
    """
    mediapy.set_ffmpeg(imageio_ffmpeg.get_ffmpeg_exe())
    walks = [walker.walk(shown, joints=True) for walker in walkers.values()]
    walk = joined(walks)
    events = [Event(index * shown, name) for index, name in enumerate(walkers)]
    diagram = GaitDiagram(walk, events)
    first = next(iter(walkers.values()))
    rows = np.searchsorted(walk.times, np.arange(0, walk.times[-1] - walk.sample, 1 / FPS))
    assert walk.joints is not None
    with whole_file(Path(path)) as temporary, _renderer(first.model) as renderer:
        target = temporary.with_suffix(".mp4")
        side = diagram.draw(0.0)
        shape = (HEIGHT, WIDTH + side.shape[1])
        with mediapy.VideoWriter(target, shape, fps=FPS, crf=25) as video:
            for row in rows:
                picture = _picture(first, renderer, walk.joints[0, row], walk.trunk[0, row])
                beside = np.full((HEIGHT, side.shape[1], 3), 255, dtype=np.uint8)
                drawn = diagram.draw(walk.times[row])
                beside[HEIGHT - len(drawn) :] = drawn
                _legend(beside)
                video.add_image(np.hstack([picture, beside]))


def _picture(walker: TrunkWalker, renderer: mujoco.Renderer, qpos: Array, trunk: Array) -> Frame:
    """The robot in the middle of the picture, springs coloured by strain."""
    model, n = walker.model, walker.trunk.n_sensed
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_forward(model, data)
    rest = walker.trunk.body.rest_lengths[:n]
    model.tendon_rgba[:n, :3] = strain_colours(data.ten_length[:n] / rest - 1, FULL_STRAIN)
    model.tendon_rgba[n : walker.trunk.body.n_springs, :3] = MUSCLE
    camera = mujoco.MjvCamera()
    camera.type = mujoco.mjtCamera.mjCAMERA_FREE
    camera.lookat[:] = [trunk[0], 0.8 * walker.trunk.settings.leg, 0.0]
    # along -z with y upwards, from a little above the ground
    camera.distance, camera.azimuth, camera.elevation = 3.4, 90.0, -100.0
    renderer.update_scene(data, camera)
    return renderer.render().copy()


def _legend(beside: Frame) -> None:
    """Words above the gait diagram, drawn in place."""
    picture = Image.fromarray(beside)
    draw = ImageDraw.Draw(picture)
    font = ImageFont.load_default(size=14)
    words = (
        ("The trunk's springs are all that", INK),
        ("drives its muscles.", INK),
        (f"stretched by {FULL_STRAIN:.0%} or more", (214, 38, 41)),
        (f"shortened by {FULL_STRAIN:.0%} or more", (31, 79, 214)),
        ("muscles", tuple(int(255 * c) for c in MUSCLE)),
    )
    for line, (text, colour) in enumerate(words):
        draw.text((16, 24 + 26 * line), text, fill=colour, font=font)
    beside[:] = np.asarray(picture)


def _renderer(model: mujoco.MjModel) -> mujoco.Renderer:
    model.vis.global_.offwidth, model.vis.global_.offheight = WIDTH, HEIGHT
    try:
        return mujoco.Renderer(model, HEIGHT, WIDTH)
    except Exception as error:  # each OpenGL backend raises errors of its own
        raise McmjError(f"no off-screen OpenGL ({type(error).__name__}: {error})") from error
