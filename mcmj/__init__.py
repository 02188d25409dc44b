"""mcmj: morphological computation in MuJoCo.

A compliant body (a random planar network of masses and nonlinear springs) computes; only a
linear, static readout of its spring lengths is trained (Hauser et al., Biol. Cybern. 2012).
"""

import ctypes.util
import os
import sys


def _choose_gl() -> None:
    """Without a display MuJoCo must be told, before its import, how to draw off-screen."""
    if sys.platform != "linux" or "MUJOCO_GL" in os.environ or os.environ.get("DISPLAY"):
        return
    for backend, library in (("egl", "EGL"), ("osmesa", "OSMesa")):
        if ctypes.util.find_library(library):
            os.environ["MUJOCO_GL"] = backend
            return


_choose_gl()

from mcmj import reference  # noqa: E402
from mcmj.core.body import Body  # noqa: E402  (mujoco reads MUJOCO_GL at import)
from mcmj.core.callbacks.spring_laws import SpringLaw  # noqa: E402
from mcmj.core.random_body import random_body  # noqa: E402
from mcmj.learning.lessons import Teaching  # noqa: E402
from mcmj.learning.regression import fit_readout  # noqa: E402
from mcmj.learning.teaching import teach  # noqa: E402
from mcmj.mjcf.read import from_mjcf  # noqa: E402
from mcmj.mjcf.write import to_mjcf  # noqa: E402
from mcmj.simulation.ensemble import Ensemble  # noqa: E402
from mcmj.simulation.phases import Phase, RandomForces, Schedule  # noqa: E402
from mcmj.simulation.run_phases import run_schedule  # noqa: E402
from mcmj.simulation.simulation import Simulation  # noqa: E402
from mcmj.targets.limit_cycles import Target, target  # noqa: E402
from mcmj.utils.errors import McmjError  # noqa: E402

__all__ = [
    "Body",
    "Ensemble",
    "McmjError",
    "Phase",
    "RandomForces",
    "Schedule",
    "Simulation",
    "SpringLaw",
    "Target",
    "Teaching",
    "fit_readout",
    "from_mjcf",
    "random_body",
    "reference",
    "run_schedule",
    "target",
    "teach",
    "to_mjcf",
]
