"""mcmj: morphological computation in MuJoCo.

A compliant body (a random planar network of masses and nonlinear springs) computes; only a
linear, static readout of its spring lengths is trained (Hauser et al., Biol. Cybern. 2012).

Names are loaded when they are first used, so that `import mcmj` costs little.
"""

import importlib
from typing import TYPE_CHECKING

from mcmj.utils.gl_backend import choose_backend

if TYPE_CHECKING:
    from mcmj import reference as reference
    from mcmj.core.body import Body as Body
    from mcmj.core.callbacks.spring_laws import SpringLaw as SpringLaw
    from mcmj.core.random_body import random_body as random_body
    from mcmj.learning.force_learning import ForceLearning as ForceLearning
    from mcmj.learning.force_learning import force_learn as force_learn
    from mcmj.learning.lessons import Teaching as Teaching
    from mcmj.learning.regression import fit_readout as fit_readout
    from mcmj.learning.teaching import teach as teach
    from mcmj.mjcf.read import from_mjcf as from_mjcf
    from mcmj.mjcf.write import to_mjcf as to_mjcf
    from mcmj.pictures.film_of import film as film
    from mcmj.pictures.plots import plot_body as plot_body
    from mcmj.pictures.plots import plot_run as plot_run
    from mcmj.simulation.ensemble import Ensemble as Ensemble
    from mcmj.simulation.phases import Phase as Phase
    from mcmj.simulation.phases import RandomForces as RandomForces
    from mcmj.simulation.phases import Schedule as Schedule
    from mcmj.simulation.reservoir import Reservoir as Reservoir
    from mcmj.simulation.run_phases import run_schedule as run_schedule
    from mcmj.simulation.simulation import Simulation as Simulation
    from mcmj.targets.limit_cycles import Target as Target
    from mcmj.targets.limit_cycles import target as target
    from mcmj.utils.errors import McmjError as McmjError

__version__ = "0.1.0"

_PLACES = {
    "Body": "core.body",
    "Ensemble": "simulation.ensemble",
    "ForceLearning": "learning.force_learning",
    "McmjError": "utils.errors",
    "Phase": "simulation.phases",
    "RandomForces": "simulation.phases",
    "Reservoir": "simulation.reservoir",
    "Schedule": "simulation.phases",
    "Simulation": "simulation.simulation",
    "SpringLaw": "core.callbacks.spring_laws",
    "Target": "targets.limit_cycles",
    "Teaching": "learning.lessons",
    "film": "pictures.film_of",
    "fit_readout": "learning.regression",
    "force_learn": "learning.force_learning",
    "from_mjcf": "mjcf.read",
    "plot_body": "pictures.plots",
    "plot_run": "pictures.plots",
    "random_body": "core.random_body",
    "run_schedule": "simulation.run_phases",
    "target": "targets.limit_cycles",
    "teach": "learning.teaching",
    "to_mjcf": "mjcf.write",
}


def __getattr__(name: str) -> object:
    if name == "reference":
        return importlib.import_module("mcmj.reference")
    if name not in _PLACES:
        raise AttributeError(f"module 'mcmj' has no attribute {name!r}")
    found = getattr(importlib.import_module(f"mcmj.{_PLACES[name]}"), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *_PLACES, "reference"})


choose_backend()  # MuJoCo reads it at import
