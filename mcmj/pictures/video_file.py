"""Video files, MP4 or GIF, whole or not at all."""

import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import numpy.typing as npt

from mcmj.utils.errors import InvalidArgumentError, OutputError
from mcmj.utils.files import whole_file

Picture = npt.NDArray[np.uint8]  # (height, width, 3)
_PALETTE = "split[a][b];[a]palettegen[p];[b][p]paletteuse"
OPTIONS = {  # of ffmpeg
    ".mp4": "-vcodec h264 -pix_fmt yuv420p -crf 23 -f mp4",
    ".gif": f"-vcodec gif -pix_fmt pal8 -vf {_PALETTE} -f gif",
}


class Video:
    """A file that ffmpeg writes, picture by picture."""

    def __init__(self, path: Path, width: int, height: int, fps: float, options: str) -> None:
        self._shape = (height, width, 3)
        self._ffmpeg = subprocess.Popen(
            [
                imageio_ffmpeg.get_ffmpeg_exe(), "-v", "error", "-f", "rawvideo",
                "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", str(fps), "-i", "-",
                *options.split(), "-y", path,
            ],
            stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
        )  # fmt: skip

    def add_image(self, picture: Picture) -> None:
        """Add a picture.

        Raises:
            InvalidArgumentError: of another size.
            BrokenPipeError: ffmpeg has ended; `close` says why.
        """
        if picture.shape != self._shape or picture.dtype != np.uint8:
            raise InvalidArgumentError("picture", f"bytes {self._shape}", picture.shape)
        assert self._ffmpeg.stdin is not None
        self._ffmpeg.stdin.write(picture.tobytes())

    def close(self) -> str | None:
        """Finish the file; what ffmpeg said if it failed."""
        try:
            said = self._ffmpeg.communicate()[1].decode(errors="replace")
        except BrokenPipeError:  # on flushing what was left
            said = ""
        return said if self._ffmpeg.wait() else None

    def kill(self) -> None:
        """Give the file up."""
        self._ffmpeg.kill()
        self._ffmpeg.communicate()


@contextmanager
def new_video(path: str | Path, width: int, height: int, *, fps: float) -> Iterator[Video]:
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
    with whole_file(path) as temporary:
        video = Video(temporary, width, height, fps, OPTIONS[suffix])
        try:
            yield video
        except BrokenPipeError:
            pass  # ffmpeg says why
        except BaseException:
            video.kill()
            raise
        said = video.close()
        if said is not None:
            reason = "no space left" if "No space left" in said else "ffmpeg failed, disk full?"
            raise OutputError(f"cannot write {path}: {reason}")
