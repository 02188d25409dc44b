"""MP4 of a robot whose trunk is the computer, seen from the side, with its gait diagram."""

from collections.abc import Mapping
from pathlib import Path

import mujoco
import numpy as np

from mcmj.pictures.opengl import new_renderer
from mcmj.pictures.video_file import Picture, new_video
from mcmj.pictures.walk_video import (
    FPS,
    HEIGHT,
    SIDE,
    WIDTH,
    Event,
    GaitDiagram,
    draw_words,
    shown_rows,
    spring_strains,
    strain_words,
)
from mcmj.robots.trunk import Trunk
from mcmj.robots.walk_metrics import Walk, joined
from mcmj.utils.colours import BLACK, MUSCLE_COLOUR, strain_colours
from mcmj.utils.validation import Array


def trunk_video(
    path: str | Path,
    model: mujoco.MjModel,
    trunk: Trunk,
    walks: Mapping[str, Walk],
    *,
    speed: float = 1.0,
) -> None:
    """Film walks of one robot, one after the other, in real time, or so many times faster.

    Args:
        model: of the robot.
        walks: by gait, with joints; of the same sampling.

    Raises:
        RenderingUnavailableError: no OpenGL.
        OutputError: the file cannot be written.
    """
    walk = joined(list(walks.values()))
    ends = np.cumsum([len(one.times) for one in walks.values()]) * walk.sample
    starts = [0.0, *ends.tolist()]
    diagram = GaitDiagram(walk, [Event(*event) for event in zip(starts, walks, strict=False)])
    rows, joints = shown_rows(walk, speed)
    springs, flat = np.arange(trunk.n_sensed), trunk.body.dimensions == 2
    strains = spring_strains(model, springs, joints)
    words = [
        ("The trunk's springs are all that", BLACK),
        ("drives its muscles.", BLACK),
        *strain_words(strains),
        ("muscles", MUSCLE_COLOUR),
    ]
    beside = np.full((HEIGHT, SIDE, 3), 255, dtype=np.uint8)
    legend = draw_words(words, SIDE)
    beside[16 : 16 + len(legend)] = legend
    model.tendon_rgba[trunk.n_sensed : trunk.body.n_springs, :3] = MUSCLE_COLOUR
    with (
        new_renderer(model, WIDTH, HEIGHT) as renderer,
        new_video(path, WIDTH + SIDE, HEIGHT, fps=FPS) as video,
    ):
        for row, qpos, colours in zip(
            rows, joints, strain_colours(strains, np.abs(strains).max()), strict=True
        ):
            model.tendon_rgba[springs, :3] = colours
            x, y, height = walk.trunk[0, row, :3]
            centre = [x, 0.8 * trunk.settings.leg, 0.0] if flat else [x, y, 0.7 * height]
            drawn = diagram.draw(walk.times[row])
            beside[-len(drawn) :] = drawn
            video.add_image(np.hstack([_picture(model, renderer, qpos, centre, flat=flat), beside]))


def _picture(
    model: mujoco.MjModel,
    renderer: mujoco.Renderer,
    qpos: Array,
    centre: list[float],
    *,
    flat: bool,
) -> Picture:
    """The robot, with a point in the middle of the picture."""
    data, camera = mujoco.MjData(model), mujoco.MjvCamera()
    data.qpos[:] = qpos
    mujoco.mj_forward(model, data)
    camera.type = mujoco.mjtCamera.mjCAMERA_FREE
    camera.lookat[:] = centre
    if flat:  # along -z with y upwards, from a little above the ground
        camera.distance, camera.azimuth, camera.elevation = 3.4, 90.0, -100.0
    else:  # from the side and a little ahead
        camera.distance, camera.azimuth, camera.elevation = 2.9, 125.0, -14.0
    renderer.update_scene(data, camera)
    found: Picture = renderer.render()
    return found
