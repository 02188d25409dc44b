"""A ground on which motion shows."""

import mujoco

SQUARES = "squares"  # the material


def paint_squares(spec: mujoco.MjSpec, side: float, colours: tuple[float, float]) -> None:
    """Add a material of squares [m] of two greys."""
    spec.add_texture(
        name=SQUARES, type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        rgb1=[colours[0]] * 3, rgb2=[colours[1]] * 3, width=64, height=64,
    )  # fmt: skip
    textures = [""] * mujoco.mjtTextureRole.mjNTEXROLE
    textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = SQUARES
    spec.add_material(
        name=SQUARES, textures=textures, texrepeat=[1 / side, 1 / side], texuniform=True
    )
