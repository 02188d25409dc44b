"""The colours of figures, films and windows: the paper's where it has one. No other table."""

import numpy as np

from mcmj.utils.validation import Array

Colour = tuple[float, float, float]  # red, green, blue in [0, 1]

BLACK = (0.0, 0.0, 0.0)
RED = (0.84, 0.15, 0.16)
BLUE = (0.12, 0.31, 0.84)
PALE_BLUE = (0.54, 0.64, 0.93)
GREEN = (0.16, 0.62, 0.24)
ORANGE = (0.88, 0.48, 0.0)
PURPLE = (0.49, 0.23, 0.62)
LILAC = (0.58, 0.40, 0.74)
PINK = (0.89, 0.47, 0.76)
GREY = (0.5, 0.5, 0.5)
BROWN = (0.55, 0.43, 0.19)
SAND = (0.74, 0.63, 0.35)

TARGET_COLOUR = RED
OUTPUT_COLOURS = (BLACK, BLUE, GREEN, ORANGE)
GROUP_COLOURS = (BLUE, BLACK, GREEN)  # of tasks, methods, degrees: a curve each
CHANGE_COLOUR = ORANGE  # when something is done to the body: disturbed, switched, pushed
RECOVERED_COLOUR = BLUE
MUSCLE_COLOUR = PURPLE
INTEGRATOR_COLOURS = {
    "Euler": BLACK, "leapfrog": RED, "RK4": BLUE, "discrete": GREEN, "implicit": BROWN,
    "implicitfast": SAND, "toolbox_euler": LILAC, "toolbox_rk": PINK, "Euler_hook": GREY,
    "RK4_hook": PALE_BLUE, "adaptive_leapfrog": ORANGE,
}  # fmt: skip

# nodes, as in the paper's Figs. 2 and 5m
FIXED_COLOUR = (0.85, 0.10, 0.10)
INPUT_COLOUR = (0.20, 0.70, 0.20)
FEEDBACK_COLOURS = ((0.55, 0.20, 0.70), (0.10, 0.70, 0.75), (0.95, 0.60, 0.10), (0.90, 0.40, 0.65))
PLAIN_COLOUR = (0.45, 0.45, 0.45)

SPRING_COLOUR = (0.55, 0.58, 0.62)
STRETCHED_COLOUR, SHORTENED_COLOUR = RED, BLUE
ARROW_COLOUR = (0.10, 0.10, 0.10)


def strain_colours(strains: Array, largest: float) -> Array:
    """Colours (..., L, 3) from strains (..., L): blue if shortened, red if stretched.

    Args:
        largest: of the whole film or scene: only there a colour is full, so that none saturates.
    """
    share = np.abs(strains) / largest if largest > 0.0 else np.zeros_like(strains)
    weight = share[..., None] ** 0.25  # one very short spring must not make all others grey
    goal = np.where(strains[..., None] > 0, STRETCHED_COLOUR, SHORTENED_COLOUR)
    found: Array = (1 - weight) * np.array(SPRING_COLOUR) + weight * goal
    return found


def in_bytes(colour: Colour) -> tuple[int, int, int]:
    """Red, green, blue in 0 .. 255, as Pillow takes them."""
    red, green, blue = (round(255 * c) for c in colour)
    return red, green, blue
