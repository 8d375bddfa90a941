"""A vector environment of one, as a plain environment.

Lanes run on their own: each starts its next episode with a seed of its own, and may be many steps ahead of another. A
vector environment steps all of its environments at once, so only one of them can be behind a lane.
"""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import concatenate, create_empty_array, iterate

from agail._core import InputError


class OfOne(gymnasium.Env[Any, Any]):
    """Every episode is begun by reset(), so the autoreset modes differ only in where the last observation is."""

    def __init__(self, vector: VectorEnv[Any, Any, Any]):
        if vector.num_envs != 1:
            raise InputError(
                f"{vector} steps {vector.num_envs} environments at once, but lanes run on their own; "
                "give a function that makes one with num_envs=1, and lanes=N"
            )
        mode = vector.metadata.get("autoreset_mode")
        if not isinstance(mode, AutoresetMode):
            raise InputError(
                f"{vector} does not say in metadata['autoreset_mode'] what it does at the end of an "
                "episode; give it one of gymnasium.vector.AutoresetMode"
            )
        self._vector, self._same_step = vector, mode == AutoresetMode.SAME_STEP
        self.observation_space = vector.single_observation_space
        self.action_space = vector.single_action_space
        self.spec = vector.spec

    @property
    def unwrapped(self) -> Any:
        return self._vector.unwrapped

    def _first(self, observations: Any) -> Any:
        return next(iterate(self._vector.observation_space, observations))

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        observations, info = self._vector.reset(seed=None if seed is None else [seed])
        return self._first(observations), info

    def step(self, action: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        space = self._vector.single_action_space
        actions = concatenate(space, [action], create_empty_array(space, 1))
        observations, rewards, terminated, truncated, info = self._vector.step(actions)
        ended = bool(terminated[0]) or bool(truncated[0])
        if ended and self._same_step:  # what came back begins the next episode
            if "final_obs" not in info:
                raise InputError("autoreset SAME_STEP, but no final_obs in the info of a last step")
            observation = info["final_obs"][0]
        else:
            observation = self._first(observations)
        return observation, np.asarray(rewards)[0], terminated[0], truncated[0], info

    def close(self) -> None:
        self._vector.close()
