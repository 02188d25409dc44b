"""A needlessly complete scene of a body, to show what leaving things out saves.

What one would write without thinking: every node a sphere with six degrees of freedom that
can collide, a floor, gravity held off by equality constraints that keep nodes in the plane,
the constraint solver on, positions and velocities of every node sensed.
"""

import xml.etree.ElementTree as ET

import mujoco

from mcmj.core.body import Body
from mcmj.mjcf.write import numbers


def full_scene(body: Body) -> mujoco.MjModel:
    """Compile that scene; masses, springs and geometry are the body's."""
    root = ET.Element("mujoco")
    ET.SubElement(root, "option", timestep="0.001", gravity="0 0 0")
    world = ET.SubElement(root, "worldbody")
    extent = float(body.positions.max() - body.positions.min())
    ET.SubElement(world, "geom", type="plane", size="0 0 1", pos=numbers([0, 0, -extent]))
    tendons, equality = ET.SubElement(root, "tendon"), ET.SubElement(root, "equality")
    sensors = ET.SubElement(root, "sensor")
    for i, position in enumerate(body.positions):
        node = ET.SubElement(world, "body", name=f"n{i}", pos=numbers([*position, 0]))
        if not body.fixed[i]:
            for axis, name in (("1 0 0", "x"), ("0 1 0", "y"), ("0 0 1", "z")):
                ET.SubElement(node, "joint", name=f"n{i}{name}", type="slide", axis=axis)
            ET.SubElement(node, "joint", name=f"n{i}r", type="ball")
            ET.SubElement(equality, "joint", joint1=f"n{i}z")  # stay in the plane
        radius = numbers(0.005 * extent)
        ET.SubElement(node, "geom", type="sphere", size=radius, mass=numbers(body.masses[i]))
        ET.SubElement(node, "site", name=f"n{i}")
        for kind in ("framepos", "framelinvel"):
            ET.SubElement(sensors, kind, objtype="site", objname=f"n{i}")
    for j, (a, b) in enumerate(body.springs):
        spring = ET.SubElement(
            tendons,
            "spatial",
            name=f"s{j}",
            stiffness=numbers([body.k1[j], 0, body.k3[j]]),
            damping=numbers([body.d1[j], 0, body.d3[j]]),
            springlength=numbers(body.rest_lengths[j]),
        )
        ET.SubElement(spring, "site", site=f"n{a}")
        ET.SubElement(spring, "site", site=f"n{b}")
        ET.SubElement(sensors, "tendonpos", tendon=f"s{j}")
        ET.SubElement(sensors, "tendonvel", tendon=f"s{j}")
    return mujoco.MjModel.from_xml_string(ET.tostring(root, encoding="unicode"))
