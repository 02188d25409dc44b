"""Off-screen videos of a body at work: deformation scaled up, springs coloured by strain.

With no display, `MUJOCO_GL` must be set before mujoco is imported: mcmj/__init__.py does it.
"""

import os
import sys
from collections.abc import Iterator
from pathlib import Path

import imageio_ffmpeg
import mediapy
import mujoco
import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw, ImageFont

from mcmj.appearance import SPRING_COLOUR, frame
from mcmj.body import Body, spring_lengths
from mcmj.bodyfile import load_model
from mcmj.errors import McmjError
from mcmj.mjcf import to_mjcf
from mcmj.store import whole_file
from mcmj.targets import Target
from mcmj.validation import Array

Frame = npt.NDArray[np.uint8]

SIZE = 400  # pixels: a frame is two squares
FPS = 25
TRAIL = 3.0  # seconds of outputs drawn behind the dot
STRETCHED, SHORTENED = np.array([0.84, 0.15, 0.16]), np.array([0.12, 0.31, 0.84])
REMEDY = "on Debian or Ubuntu: apt-get install libegl1 libegl-mesa0 libgl1-mesa-dri libopengl0"
SHOWN_SHARE = 0.05  # the automatic scale makes the largest displacement this share of the body


class RenderingUnavailableError(McmjError):
    """No OpenGL: videos cannot be made here; everything else can."""


def deformation_scale(body: Body, positions: Array) -> float:
    """A round factor (1, 2, 5, 10, ..) that makes displacements (T, N, 2) visible."""
    largest = np.abs(positions - body.positions).max()
    if largest == 0.0:
        return 1.0
    wanted = SHOWN_SHARE * max(frame(body)[2:]) / largest
    exponent = np.floor(np.log10(wanted))
    mantissa = max(m for m in (1, 2, 5) if m <= wanted / 10**exponent + 1e-9)
    return max(1.0, float(mantissa * 10**exponent))


def body_frames(body: Body, positions: Array, *, scale: float, size: int = SIZE) -> Iterator[Frame]:
    """Pictures (size, size, 3) of the body at positions (F, N, 2), displacements times scale.

    Raises:
        RenderingUnavailableError: no OpenGL context can be made.
    """
    model = load_model(to_mjcf(body))
    data = mujoco.MjData(model)
    extension = spring_lengths(positions, body.springs) - body.rest_lengths
    strain = extension / np.abs(extension).max() if extension.any() else extension
    with _renderer(model, size) as renderer:
        for moved, colour in zip(positions, strain, strict=True):
            shift = scale * (moved - body.positions)
            data.qpos[:] = shift[body.free].ravel()
            model.tendon_rgba[: body.n_springs, :3] = _strain_colours(colour)
            mujoco.mj_forward(model, data)
            renderer.update_scene(data, camera="top")
            yield renderer.render().copy()


def _strain_colours(strain: Array) -> Array:
    """Colours (L, 3) from strain in [-1, 1]: blue when shortened, red when stretched."""
    goal = np.where(strain[:, None] > 0, STRETCHED, SHORTENED)
    weight = np.sqrt(np.abs(strain))[:, None]
    return (1 - weight) * np.array(SPRING_COLOUR) + weight * goal


def _renderer(model: mujoco.MjModel, size: int) -> mujoco.Renderer:
    chosen = os.environ.get("MUJOCO_GL") or os.environ.get("DISPLAY")
    if sys.platform == "linux" and not chosen:
        raise RenderingUnavailableError(f"no display, no EGL and no OSMesa library; {REMEDY}")
    try:
        model.vis.global_.offwidth = model.vis.global_.offheight = size
        return mujoco.Renderer(model, size, size)
    except Exception as error:  # each OpenGL backend raises errors of its own
        raise RenderingUnavailableError(
            f"no off-screen OpenGL ({type(error).__name__}: {error}); {REMEDY}"
        ) from error


class PhasePortrait:
    """A square picture of the target orbit on which the outputs draw themselves."""

    def __init__(self, target: Target, outputs: Array, *, size: int = SIZE) -> None:
        orbit = target.orbit(1000)
        both = np.vstack([orbit[:, :2], outputs[:, :2]])
        self._size = size
        self._centre = (both.max(axis=0) + both.min(axis=0)) / 2
        self._scale = 0.8 * size / np.ptp(both, axis=0).max()
        self._font = ImageFont.load_default(size=16)
        self._background = Image.new("RGB", (size, size), "white")
        draw = ImageDraw.Draw(self._background)
        draw.line(self._pixels(np.vstack([orbit, orbit[:1]])), fill=(236, 160, 160), width=7)
        draw.text((14, 10), "target", fill=(200, 60, 60), font=self._font)
        draw.text((74, 10), "outputs x2 over x1", fill="black", font=self._font)

    def _pixels(self, values: Array) -> list[tuple[float, float]]:
        flat = (values[:, :2] - self._centre) * self._scale * np.array([1, -1]) + self._size / 2
        return [(float(x), float(y)) for x, y in flat]

    def draw(self, trail: Array, caption: str) -> Frame:
        """The portrait with a trail of outputs (n, >= 2), the newest last."""
        picture = self._background.copy()
        draw = ImageDraw.Draw(picture)
        pixels = self._pixels(trail)
        if len(pixels) > 1:
            draw.line(pixels, fill="black", width=2)
        x, y = pixels[-1]
        draw.ellipse((x - 6, y - 6, x + 6, y + 6), fill="black")
        draw.text((14, self._size - 30), caption, fill="black", font=self._font)
        return np.asarray(picture)


def limit_cycle_video(
    path: str | Path,
    body: Body,
    target: Target,
    times: Array,
    positions: Array,
    outputs: Array,
    *,
    seconds: float = 13.0,
) -> None:
    """MP4 in real time: the body computing, beside its phase portrait drawing itself.

    Args:
        times, positions, outputs: the same T control steps: (T,), (T, N, 2), (T, n_outputs).
        seconds: length of the video, from the first sample on.

    Raises:
        RenderingUnavailableError: no OpenGL.
        OutputError: the file cannot be written.
    """
    step = times[1] - times[0]
    stride = 1.0 / (FPS * step)
    shown = np.arange(min(int(seconds * FPS), int(len(times) / stride)))
    at = np.minimum((shown * stride).round().astype(int), len(times) - 1)
    scale = deformation_scale(body, positions)
    portrait = PhasePortrait(target, outputs)
    trail = round(TRAIL / step)
    mediapy.set_ffmpeg(imageio_ffmpeg.get_ffmpeg_exe())
    pictures = body_frames(body, positions[at], scale=scale)
    first = next(pictures)
    caption = f"real time, deformation x {scale:g}"
    with (
        whole_file(Path(path)) as temporary,
        mediapy.VideoWriter(
            temporary.with_suffix(".mp4"), (SIZE, 2 * SIZE), fps=FPS, crf=23
        ) as video,
    ):
        for index, picture in zip(at, _chain(first, pictures), strict=True):
            past = outputs[max(0, index - trail) : index + 1 : 10]
            label = f"t = {times[index]:.1f} s   {caption}"
            video.add_image(np.hstack([picture, portrait.draw(past, label)]))


def _chain(first: Frame, rest: Iterator[Frame]) -> Iterator[Frame]:
    yield first
    yield from rest
