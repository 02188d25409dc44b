"""How a body looks in MuJoCo: the colours of its nodes, camera, headlight."""

import xml.etree.ElementTree as ET

import numpy as np

from mcmj.core.body import Body
from mcmj.utils.colours import (
    FEEDBACK_COLOURS,
    FIXED_COLOUR,
    INPUT_COLOUR,
    PLAIN_COLOUR,
    SPRING_COLOUR,
    Colour,
)

CAMERA_ANGLE = 30.0  # degrees; narrow: nodes far out are seen from above too
OBLIQUE = 60.0, -25.0  # azimuth and elevation [degrees] of the view of a body in space
NODE_SHARE, SPRING_SHARE = 0.014, 0.003  # radii, of the view
MARGIN = 0.12  # of the body's larger side, around it


def node_colour(body: Body, node: int) -> Colour:
    """Colour of a node by its role: fixed, input, fed back by output c, or none."""
    if body.fixed[node]:
        return FIXED_COLOUR
    fed = np.flatnonzero(body.w_fb[node])
    if fed.size:
        return FEEDBACK_COLOURS[fed[0] % len(FEEDBACK_COLOURS)]
    return INPUT_COLOUR if body.w_in[node].any() else PLAIN_COLOUR


def node_kinds(body: Body) -> dict[str, Colour]:
    """Names and colours of the roles that a body's nodes have, for a legend."""
    kinds = {"fixed": FIXED_COLOUR}
    if body.n_inputs:
        kinds["input"] = INPUT_COLOUR
    for c in range(body.n_outputs):
        kinds[f"fed x{c + 1}"] = FEEDBACK_COLOURS[c % len(FEEDBACK_COLOURS)]
    kinds["free"] = PLAIN_COLOUR
    used = {node_colour(body, node) for node in range(body.n_nodes)}
    return {name: colour for name, colour in kinds.items() if colour in used}


def frame(body: Body) -> tuple[float, float, float, float]:
    """Centre x, centre y, width and height [m] of the view along z that shows the whole body."""
    flat = body.positions[:, :2]
    low, high = flat.min(axis=0), flat.max(axis=0)
    margin = MARGIN * (high - low).max()
    (cx, cy), (width, height) = (low + high) / 2, high - low + 2 * margin
    return float(cx), float(cy), float(width), float(height)


def node_style(body: Body, node: int) -> dict[str, str]:
    """Attributes of a node's site."""
    radius = NODE_SHARE * max(frame(body)[2:])
    shape = "box" if body.fixed[node] else "sphere"
    colour = " ".join(f"{c:g}" for c in node_colour(body, node))
    return {"type": shape, "size": f"{radius:.6g} {radius:.6g} {radius:.6g}", "rgba": f"{colour} 1"}


def add_appearance(root: ET.Element, body: Body) -> None:
    """Add the view from above and the worldbody with its camera; shadows and smoothing off,
    on white."""
    cx, cy, width, height = frame(body)
    extent = max(width, height)
    distance = extent / 2 / np.tan(np.radians(CAMERA_ANGLE / 2))
    cz, upper = _heights(body)
    ET.SubElement(root, "statistic", center=f"{cx:g} {cy:g} {cz:g}", extent=f"{extent:g}")
    visual = ET.SubElement(root, "visual")
    azimuth, elevation = ("90", "-90") if body.dimensions == 2 else map("{:g}".format, OBLIQUE)
    angle = f"{CAMERA_ANGLE:g}"
    ET.SubElement(visual, "global", azimuth=azimuth, elevation=elevation, fovy=angle)
    ET.SubElement(visual, "headlight", ambient=".7 .7 .7", diffuse=".3 .3 .3", specular="0 0 0")
    ET.SubElement(visual, "quality", shadowsize="0", offsamples="0", numslices="12", numstacks="6")
    ET.SubElement(
        ET.SubElement(root, "asset"),
        "texture", type="skybox", builtin="flat", rgb1="1 1 1", rgb2="1 1 1",
        width="4", height="24",
    )  # fmt: skip
    default = ET.SubElement(root, "default")
    colour = " ".join(f"{c:g}" for c in SPRING_COLOUR)
    ET.SubElement(default, "tendon", width=f"{SPRING_SHARE * extent:.6g}", rgba=f"{colour} 1")
    world = ET.SubElement(root, "worldbody")
    ET.SubElement(
        world,
        "camera",
        name="top",
        pos=f"{cx:.9g} {cy:.9g} {upper + distance:.9g}",
        fovy=angle,
    )
    if body.dimensions == 3:
        _add_oblique_camera(world, body)


def camera_of(body: Body) -> str:
    """Name of the camera that shows a body best: from above, or of one in space obliquely."""
    return "top" if body.dimensions == 2 else "oblique"


def _heights(body: Body) -> tuple[float, float]:
    """z of the body's middle and of its upper end [m]."""
    if body.dimensions == 2:
        return 0.0, 0.0
    z = body.positions[:, 2]
    return float(z.min() + z.max()) / 2, float(z.max())


def _add_oblique_camera(world: ET.Element, body: Body) -> None:
    """A camera in the direction OBLIQUE, so far away that it sees the ball around the body."""
    low, high = body.positions.min(axis=0), body.positions.max(axis=0)
    centre = (low + high) / 2
    radius = (1.0 + MARGIN) * np.linalg.norm(body.positions - centre, axis=1).max()
    azimuth, elevation = np.radians(OBLIQUE)
    ahead = np.array([np.cos(azimuth), np.sin(azimuth), np.tan(elevation)]) * np.cos(elevation)
    right = np.array([np.sin(azimuth), -np.cos(azimuth), 0.0])
    place = centre - radius / np.sin(np.radians(CAMERA_ANGLE / 2)) * ahead
    ET.SubElement(
        world,
        "camera",
        name="oblique",
        pos=" ".join(f"{c:.9g}" for c in place),
        xyaxes=" ".join(f"{c:.9g}" for c in [*right, *np.cross(right, ahead)]),
        fovy=f"{CAMERA_ANGLE:g}",
    )
