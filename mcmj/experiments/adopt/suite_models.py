"""Models of dm_control's suite, as MjSpec; needs the extra "control"."""

from collections.abc import Callable, Mapping
from typing import Any

import mujoco

from mcmj.utils.extras import extra

with extra("control", "the models of dm_control's suite need dm_control"):
    from dm_control.suite import cheetah, common, fish, quadruped, swimmer

LINKS = 15  # of the swimmer
FLOOR = 20  # half width of the quadruped's ground [m]

_MODELS: dict[str, Callable[[], tuple[Any, Mapping[str, Any]]]] = {
    "swimmer": lambda: swimmer.get_model_and_assets(LINKS),
    "fish": fish.get_model_and_assets,
    "cheetah": cheetah.get_model_and_assets,
    "quadruped": lambda: (quadruped.make_model(floor_size=FLOOR), common.ASSETS),
}


def suite_model(name: str) -> mujoco.MjSpec:
    """A model of the suite as it is, "swimmer", "fish", "cheetah" or "quadruped"."""
    xml, assets = _MODELS[name]()
    text = xml.decode() if isinstance(xml, bytes) else xml
    spec = mujoco.MjSpec.from_string(text, include=dict(assets))
    _scale_to_total_mass(spec)
    return spec


def _scale_to_total_mass(spec: mujoco.MjSpec) -> None:
    """The cheetah asks for a total mass, which MuJoCo now warns of: its densities are scaled."""
    wanted, spec.compiler.settotalmass = spec.compiler.settotalmass, -1.0
    if wanted > 0.0:
        factor = wanted / float(spec.compile().body_mass.sum())
        for geom in spec.geoms:
            geom.density *= factor
