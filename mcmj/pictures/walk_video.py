"""MP4 of a walk: the robot, the body that drives it, and the gait diagram running beside them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw, ImageFont
from scipy.ndimage import binary_closing

from mcmj.pictures.opengl import new_renderer
from mcmj.pictures.video_file import Picture, new_video
from mcmj.robots.quadruped import ROBOT_GROUP
from mcmj.robots.walk_metrics import Walk
from mcmj.robots.walk_scene import GROUND_GROUP, ROBOT
from mcmj.targets.gaits import LEGS
from mcmj.utils.colours import (
    BLACK,
    BLUE,
    CHANGE_COLOUR,
    SHORTENED_COLOUR,
    STRETCHED_COLOUR,
    Colour,
    in_bytes,
    strain_colours,
)
from mcmj.utils.validation import Array

Indices = npt.NDArray[np.int64]

WIDTH, HEIGHT, SIDE = 640, 480, 320  # pixels: the robot's picture; width of the column beside it
BODY = 230  # height of the body's picture
FPS = 25
SHADOW = 1024  # pixels of the map: without shadows feet seem to float
GAP = 0.05  # s; feet bounce: shorter gaps in a bar of the diagram are closed
SHOWN = 3.0  # seconds of the gait diagram, the last at its right edge
LARGEST = 0.08  # largest displacement of a node as drawn, over the size of the picture
INK, BAR, MARK = in_bytes(BLACK), in_bytes(BLUE), in_bytes(CHANGE_COLOUR)


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
        RenderingUnavailableError: no OpenGL.
        OutputError: the file cannot be written.
    """
    rows, joints = shown_rows(walk)
    springs = np.flatnonzero(model.tendon_stiffness > 0)
    strains = spring_strains(model, springs, joints)
    colours = strain_colours(strains, np.abs(strains).max())
    legend = draw_words(strain_words(strains), SIDE, columns=2)
    diagram = GaitDiagram(walk, events)
    model.vis.quality.shadowsize = SHADOW
    with (
        new_renderer(model, WIDTH, HEIGHT) as robot,
        new_renderer(model, SIDE, BODY) as body,
        new_video(path, WIDTH + SIDE, HEIGHT, fps=FPS) as video,
    ):
        pictures = _pictures(model, robot, body, joints, springs, colours)
        for row, (robot_picture, body_picture) in zip(rows, pictures, strict=True):
            top = body_picture[: len(legend)]
            np.minimum(top, legend, out=top)  # words are dark, the ground is white
            side = np.vstack([body_picture, diagram.draw(walk.times[row])])
            video.add_image(np.hstack([robot_picture, side]))


def shown_rows(walk: Walk, speed: float = 1.0) -> tuple[Indices, Array]:
    """Rows (F,) of a walk that a film shows, in real time at speed 1; the first copy's joints."""
    assert walk.joints is not None
    rows = np.searchsorted(walk.times, np.arange(0, walk.times[-1] - walk.sample, speed / FPS))
    return rows, walk.joints[0, rows]


def spring_strains(model: mujoco.MjModel, springs: Indices, joints: Array) -> Array:
    """Strains (F, L) of springs, given by their tendons (L,), at joints (F, nq)."""
    data, strains = mujoco.MjData(model), []
    for qpos in joints:
        data.qpos[:] = qpos
        mujoco.mj_fwdPosition(model, data)
        strains.append(data.ten_length[springs] / model.tendon_lengthspring[springs, 0] - 1)
    return np.array(strains)


def strain_words(strains: Array) -> list[tuple[str, Colour]]:
    """What the springs' colours mean."""
    percent = 100 * np.abs(strains).max()
    return [
        (f"stretched {percent:.2g} %", STRETCHED_COLOUR),
        (f"shortened {percent:.2g} %", SHORTENED_COLOUR),
    ]


def draw_words(words: Sequence[tuple[str, Colour]], width: int, *, columns: int = 1) -> Picture:
    """Words in their colours on white, in rows of so many."""
    line, font = 24, ImageFont.load_default(size=14)
    picture = Image.new("RGB", (width, -(-len(words) // columns) * line), "white")
    draw = ImageDraw.Draw(picture)
    for place, (text, colour) in enumerate(words):
        at = (12 + place % columns * width / columns, 2 + place // columns * line)
        draw.text(at, text, fill=in_bytes(colour), font=font)
    return np.asarray(picture)


class GaitDiagram:
    """Bars where feet bear load, over the last SHOWN seconds, with events marked."""

    def __init__(self, walk: Walk, events: Sequence[Event]) -> None:
        self._times, self._events = walk.times, events
        closing = np.ones((max(1, round(GAP / walk.sample)), 1))
        self._contact = binary_closing(walk.contact[0] > 0, closing)
        self._font = ImageFont.load_default(size=16)

    def draw(self, now: float) -> Picture:
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
    model: mujoco.MjModel, robot: mujoco.Renderer, body: mujoco.Renderer, joints: Array,
    springs: Indices, colours: Array,
) -> Iterator[tuple[Picture, Picture]]:  # fmt: skip
    """Pictures of the robot, and of its body with displacements magnified."""
    data, camera = mujoco.MjData(model), _camera(model)
    trunk = model.body(ROBOT + "trunk")
    nodes = model.jnt_qposadr[trunk.jntadr[0]]
    magnified = LARGEST * model.stat.extent / np.abs(joints[:, :nodes]).max()
    only_robot, only_body = mujoco.MjvOption(), mujoco.MjvOption()
    for groups in (only_robot.geomgroup, only_robot.sitegroup, only_robot.tendongroup):
        groups[:] = 0
    only_robot.geomgroup[[ROBOT_GROUP, GROUND_GROUP]] = 1
    only_body.geomgroup[[ROBOT_GROUP, GROUND_GROUP]] = 0
    for qpos, shown in zip(joints, colours, strict=True):
        data.qpos[:] = qpos
        mujoco.mj_forward(model, data)
        model.light_active[:] = True
        robot.update_scene(data, camera, only_robot)
        picture = robot.render().copy()
        data.qpos[:nodes] *= magnified
        mujoco.mj_forward(model, data)
        model.tendon_rgba[springs, :3] = shown
        model.light_active[:] = False
        body.update_scene(data, "top", only_body)
        yield picture, body.render().copy()


def _camera(model: mujoco.MjModel) -> mujoco.MjvCamera:
    """From the side and a little above, following the trunk."""
    camera = mujoco.MjvCamera()
    camera.type = mujoco.mjtCamera.mjCAMERA_TRACKING
    camera.trackbodyid = model.body(ROBOT + "trunk").id
    camera.distance, camera.azimuth, camera.elevation = 7.5, 115.0, -12.0
    return camera
