"""Video files, MP4 or GIF, whole or not at all."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import imageio_ffmpeg
import mediapy
import numpy as np
import numpy.typing as npt

from mcmj.utils.errors import InvalidArgumentError, OutputError
from mcmj.utils.files import whole_file

Picture = npt.NDArray[np.uint8]  # (height, width, 3)
OPTIONS: dict[str, dict[str, Any]] = {".mp4": {"crf": 23}, ".gif": {"codec": "gif"}}  # of ffmpeg


@contextmanager
def new_video(
    path: str | Path, width: int, height: int, *, fps: float
) -> Iterator[mediapy.VideoWriter]:
    """A video file to which `add_image(picture)` adds a picture of so many pixels.

    Raises:
        InvalidArgumentError: neither .mp4 nor .gif.
        OutputError: the file cannot be written, as when the disk is full.
    """
    suffix = Path(path).suffix
    if suffix not in OPTIONS:
        raise InvalidArgumentError("path", f"a name that ends with {' or '.join(OPTIONS)}", path)
    if not Path(path).parent.is_dir():
        raise OutputError(f"cannot write {path}: there is no folder {Path(path).parent}")
    mediapy.set_ffmpeg(imageio_ffmpeg.get_ffmpeg_exe())
    with whole_file(path) as temporary:
        try:
            size = (height, width)
            with mediapy.VideoWriter(temporary, size, fps=fps, **OPTIONS[suffix]) as video:
                yield video
        except (RuntimeError, BrokenPipeError) as error:
            said = str(error)
            if isinstance(error, RuntimeError) and not said.startswith("Error writing"):
                raise  # not mediapy's
            reason = "no space left" if "No space left" in said else "ffmpeg failed, disk full?"
            raise OutputError(f"cannot write {path}: {reason}") from error
