"""MP4 of a walk: the robot, the body that drives it, and the gait diagram running beside them."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import imageio_ffmpeg
import mediapy
import mujoco
import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw, ImageFont
from scipy.ndimage import binary_closing

from mcmj.robots.quadruped import ROBOT_GROUP
from mcmj.robots.walk_metrics import Walk
from mcmj.robots.walk_scene import GROUND_GROUP, ROBOT
from mcmj.targets.gaits import LEGS
from mcmj.utils.errors import McmjError
from mcmj.utils.files import whole_file
from mcmj.utils.validation import Array

Frame = npt.NDArray[np.uint8]

WIDTH, HEIGHT, SIDE = 640, 480, 320  # pixels: the robot's picture; width of the column beside it
BODY = 230  # height of the body's picture
FPS = 25
SHADOW = 1024  # pixels of the map: without shadows feet seem to float
GAP = 0.05  # s; feet bounce: shorter gaps in a bar of the diagram are closed
SHOWN = 3.0  # seconds of the gait diagram, the last at its right edge
LARGEST = 0.08  # largest displacement of a node as drawn, over the size of the picture
FULL_STRAIN = 0.005  # at which a spring has its full colour
INK, BAR, MARK = (30, 30, 30), (40, 60, 110), (224, 123, 0)
STRETCHED, SHORTENED, SLACK = (0.84, 0.15, 0.16), (0.12, 0.31, 0.84), (0.55, 0.58, 0.62)


@dataclass(frozen=True)
class Event:
    """Something to mark: when [s], and what to say from then on."""

    time: float
    label: str


def walk_video(
    path: str | Path, model: mujoco.MjModel, walk: Walk, events: Sequence[Event]
) -> None:
    """Film the first copy of a walk in real time.

    Args:
        model: of the walker.
        walk: with joints.
        events: in the order of time, the first at the start.

    Raises:
        McmjError: no OpenGL.
        OutputError: the file cannot be written.
    """
    assert walk.joints is not None
    mediapy.set_ffmpeg(imageio_ffmpeg.get_ffmpeg_exe())
    shown = np.arange(0, walk.times[-1] - walk.sample, 1 / FPS)
    rows = np.searchsorted(walk.times, shown)
    diagram = GaitDiagram(walk, events)
    with whole_file(Path(path)) as temporary, _renderers(model) as (robot, body):
        shape, target = (HEIGHT, WIDTH + SIDE), temporary.with_suffix(".mp4")
        with mediapy.VideoWriter(target, shape, fps=FPS, crf=25) as video:
            camera = _camera(model)
            for row, pictures in zip(
                rows, _pictures(model, robot, body, camera, walk.joints[0, rows]), strict=True
            ):
                side = np.vstack([pictures[1], diagram.draw(walk.times[row])])
                video.add_image(np.hstack([pictures[0], side]))


class GaitDiagram:
    """Bars where feet bear load, over the last SHOWN seconds, with events marked."""

    def __init__(self, walk: Walk, events: Sequence[Event]) -> None:
        self._times, self._events = walk.times, events
        closing = np.ones((max(1, round(GAP / walk.sample)), 1))
        self._contact = binary_closing(walk.contact[0] > 0, closing)
        self._font = ImageFont.load_default(size=16)

    def draw(self, now: float) -> Frame:
        """The diagram at a time [s]."""
        height, left, top, row = HEIGHT - BODY, 40, 48, 42
        picture = Image.new("RGB", (SIDE, height), "white")
        draw = ImageDraw.Draw(picture)
        scale = (SIDE - left - 8) / SHOWN
        first = np.searchsorted(self._times, now - SHOWN)
        last = np.searchsorted(self._times, now, side="right")
        for leg, name in enumerate(LEGS):
            y = top + leg * row
            draw.text((8, y + 6), name, fill=INK, font=self._font)
            stance = np.r_[False, self._contact[first:last, leg], False].astype(int)
            for a, b in np.flatnonzero(np.diff(stance)).reshape(-1, 2):
                x = [left + scale * (self._times[first + k] - now + SHOWN) for k in (a, b - 1)]
                draw.rectangle((x[0], y + 4, max(x[1], x[0] + 1), y + 26), fill=BAR)
        label = ""
        for event in self._events:
            if event.time <= now:
                label = event.label
                if event.time > now - SHOWN:
                    at = left + scale * (event.time - now + SHOWN)
                    draw.line((at, top - 6, at, top + 4 * row), fill=MARK, width=2)
        draw.text((8, 8), label, fill=MARK, font=ImageFont.load_default(size=22))
        draw.text((SIDE - 74, 12), f"{now:5.1f} s", fill=INK, font=self._font)
        caption = f"feet on the ground, last {SHOWN:g} s; bounces left out"
        draw.text((left, height - 24), caption, fill=INK, font=ImageFont.load_default(size=13))
        return np.asarray(picture)


def _pictures(
    model: mujoco.MjModel,
    robot: mujoco.Renderer,
    body: mujoco.Renderer,
    camera: mujoco.MjvCamera,
    joints: Array,
) -> Iterator[tuple[Frame, Frame]]:
    """Pictures of the robot, and of its body with displacements magnified."""
    data = mujoco.MjData(model)
    trunk = model.body(ROBOT + "trunk")
    nodes = model.jnt_qposadr[trunk.jntadr[0]]
    springs = model.tendon_stiffness > 0
    rest = model.tendon_lengthspring[springs, 0]
    magnified = LARGEST * model.stat.extent / np.abs(joints[:, :nodes]).max()
    only_robot, only_body = mujoco.MjvOption(), mujoco.MjvOption()
    for groups in (only_robot.geomgroup, only_robot.sitegroup, only_robot.tendongroup):
        groups[:] = 0
    only_robot.geomgroup[[ROBOT_GROUP, GROUND_GROUP]] = 1
    only_body.geomgroup[[ROBOT_GROUP, GROUND_GROUP]] = 0
    for qpos in joints:
        data.qpos[:] = qpos
        mujoco.mj_forward(model, data)
        model.tendon_rgba[springs, :3] = strain_colours(
            data.ten_length[springs] / rest - 1, FULL_STRAIN
        )
        model.light_active[:] = True
        robot.update_scene(data, camera, only_robot)
        picture = robot.render().copy()
        data.qpos[:nodes] *= magnified
        mujoco.mj_forward(model, data)
        model.light_active[:] = False
        body.update_scene(data, "top", only_body)
        yield picture, body.render().copy()


def strain_colours(strain: Array, full: float) -> Array:
    """Colours (n, 3): blue when shortened, red when stretched, full at the strain `full`."""
    weight = np.minimum(np.abs(strain) / full, 1.0)[:, None]
    goal = np.where(strain[:, None] > 0, STRETCHED, SHORTENED)
    return (1 - weight) * np.array(SLACK) + weight * goal


def _camera(model: mujoco.MjModel) -> mujoco.MjvCamera:
    """From the side and a little above, following the trunk."""
    camera = mujoco.MjvCamera()
    camera.type = mujoco.mjtCamera.mjCAMERA_TRACKING
    camera.trackbodyid = model.body(ROBOT + "trunk").id
    camera.distance, camera.azimuth, camera.elevation = 7.5, 115.0, -12.0
    return camera


@contextmanager
def _renderers(model: mujoco.MjModel) -> Iterator[tuple[mujoco.Renderer, mujoco.Renderer]]:
    model.vis.global_.offwidth, model.vis.global_.offheight = WIDTH, HEIGHT
    model.vis.quality.shadowsize = SHADOW
    try:
        robot = mujoco.Renderer(model, HEIGHT, WIDTH)
    except Exception as error:  # each OpenGL backend raises errors of its own
        raise McmjError(f"no off-screen OpenGL ({type(error).__name__}: {error})") from error
    with robot, mujoco.Renderer(model, BODY, SIDE) as body:
        yield robot, body
