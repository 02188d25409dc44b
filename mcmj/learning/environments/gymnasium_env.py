"""The environments of mcmj.learning.environments.environment for Gymnasium; needs the extra "gym".

gymnasium.make("mcmj.learning.environments.gymnasium_env:mcmj/Orbit-v0", name="quadratic")
"""

from typing import Any

import numpy as np

from mcmj.learning.environments.environment import Environment, load
from mcmj.learning.environments.setting import Setting
from mcmj.simulation.simulation import Simulation
from mcmj.utils.extras import extra
from mcmj.utils.validation import Array

with extra("gym", "Gymnasium's environments need gymnasium"):
    import gymnasium
    from gymnasium import spaces

ID = "mcmj/Orbit-v0"


class OrbitEnv(gymnasium.Env[dict[str, Any], Array]):
    """A body that is to generate an orbit; see mcmj.learning.environments.environment.Orbit.

    Actions are in [-1, 1]: shares of the largest ones there.

    Args:
        name, task, setting, stepping: as for mcmj.learning.environments.environment.load.
        environment: an environment made by environment.make, instead of a name.
        render_mode: None or "rgb_array".
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"]}  # noqa: RUF012  (Gymnasium's)

    def __init__(
        self,
        name: str = "quadratic",
        task: str | None = None,
        setting: Setting | None = None,
        *,
        environment: Environment | None = None,
        render_mode: str | None = None,
        **stepping: Any,
    ) -> None:
        self.environment = environment or load(name, task, setting, **stepping)
        self.render_mode = render_mode
        frames = round(1 / self.environment.control_timestep())
        self.metadata = {**self.metadata, "render_fps": frames}
        self._largest = self.environment.action_spec().maximum
        self.action_space = spaces.Box(-1.0, 1.0, self._largest.shape, np.float64)
        self.observation_space: spaces.Dict = spaces.Dict(
            {
                key: spaces.Box(spec.minimum, spec.maximum, spec.shape, np.float64)
                for key, spec in self.environment.observation_spec().items()
            }
        )

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Array], dict[str, Any]]:
        """Start an episode; the same seed gives the same ones."""
        super().reset(seed=seed)
        if seed is not None:
            self.environment.task.reseed(seed)
        return dict(self.environment.reset().observation), {}

    def step(self, action: Array) -> tuple[dict[str, Array], float, bool, bool, dict[str, Any]]:
        """One control step; terminated if the outputs ran away, truncated by the time limit."""
        step = self.environment.step(self._largest * action)
        terminated = step.last() and step.discount == 0.0
        return dict(step.observation), step.reward, terminated, step.last() and not terminated, {}

    def render(self) -> Any:
        """A body from above, displacements as they are; a model from where its camera stands."""
        if self.render_mode is None:
            return None
        is_body = isinstance(self.environment.physics.reservoir, Simulation)
        return self.environment.physics.render(480, 640, camera_id="top" if is_body else -1)

    def close(self) -> None:
        """Free MuJoCo's memory."""
        self.environment.close()


if ID not in gymnasium.registry:
    gymnasium.register(ID, entry_point=f"{__name__}:OrbitEnv")
