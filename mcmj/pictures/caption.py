"""What is written on the picture of a body: time, scales, who is who, what happens."""

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw, ImageFont

from mcmj.mjcf.appearance import (
    SHORTENED_COLOUR,
    STRETCHED_COLOUR,
    node_kinds,
)
from mcmj.pictures.film import Film

Picture = npt.NDArray[np.uint8]

SIZE, SMALL = 16, 13  # pixels
LINE = 19
DISTURBED_COLOUR = (190, 90, 0)


class Caption:
    """Writes on pictures of a film's body; the legend is made once."""

    def __init__(self, film: Film, pace: str, size: tuple[int, int]) -> None:
        self._film, self._width, self._height = film, *size
        self._font, self._small = (ImageFont.load_default(size=s) for s in (SIZE, SMALL))
        self._constant = f"{pace}, deformation x {film.scale:g}"
        if film.largest_force > 0.0:
            self._constant += f", longest arrow {film.largest_force:.2g} N"
        self._legend = self._draw_legend()

    def write(self, picture: Picture, index: int) -> Picture:
        """The picture with the words for sample `index`."""
        image = Image.fromarray(picture)
        image.paste(self._legend, (0, 0), self._legend)
        draw = ImageDraw.Draw(image)
        words = f"t = {self._film.times[index]:.1f} s   {self._constant}"
        draw.text((10, self._height - 26), words, fill="black", font=self._font)
        label = self._film.label(index)
        if label:
            at = (self._width / 2, 8)
            draw.text(at, label, fill=DISTURBED_COLOUR, font=self._font, anchor="ma")
        return np.asarray(image)

    def _draw_legend(self) -> Image.Image:
        kinds = node_kinds(self._film.body)
        rows = max(2, len(kinds))  # no higher than it must be: it is pasted on every picture
        image = Image.new("RGBA", (self._width, 10 + rows * LINE), (255, 255, 255, 0))
        draw = ImageDraw.Draw(image)
        y = 10
        for name, colour in kinds.items():
            shape = draw.rectangle if name == "fixed" else draw.ellipse
            shape((10, y + 2, 20, y + 12), fill=_rgb(colour))
            draw.text((26, y), name, fill="black", font=self._small)
            y += LINE
        strain = self._film.largest_strain
        springs = {"stretched": STRETCHED_COLOUR, "shortened": SHORTENED_COLOUR}
        for name, colour in springs.items() if strain > 0.0 else ():
            text = f"{name} {100 * strain:.2g} %"
            left = self._width - 10 - draw.textlength(text, font=self._small)
            y = 10 if name == "stretched" else 10 + LINE
            draw.line((left - 28, y + 8, left - 6, y + 8), fill=_rgb(colour), width=4)
            draw.text((left, y), text, fill="black", font=self._small)
        return image


def _rgb(colour: tuple[float, float, float]) -> tuple[int, int, int]:
    red, green, blue = (round(255 * c) for c in colour)
    return red, green, blue
