"""The built-in environments for Gymnasium: gymnasium.make("agail/Hopper-v5"), gymnasium.make_vec(...)."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from agail import _core
from agail._core import InputError


def _spaces(name: str) -> tuple[spaces.Box, spaces.Space]:
    spec = _core.environment_spec(name)
    dtype = np.float32 if spec["float32"] else np.float64
    observations = spaces.Box(-np.inf, np.inf, (spec["observation_dim"],), dtype)
    if "n" in spec:
        return observations, spaces.Discrete(spec["n"])
    low, high = (np.array(spec[bound], np.float32) for bound in ("low", "high"))
    return observations, spaces.Box(low, high, dtype=np.float32)


class NativeEnv(gymnasium.Env[np.ndarray, Any]):
    """One of agail's environments. Equal seeds give equal episodes; the time limit is inside."""

    metadata = {"render_modes": []}  # noqa: RUF012

    def __init__(self, name: str, render_mode: None = None):
        self._native = _core.NativeEnvironments(name, 1, 1)
        self.observation_space, self.action_space = _spaces(name)
        self._dtype = self.observation_space.dtype
        self._seeded = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        super().reset(seed=seed)
        seeds = []
        if seed is not None or not self._seeded:
            seeds = [int(self.np_random.integers(2**63))]
            self._seeded = True
        observations = self._native.reset(seeds, [True])
        return observations[0].astype(self._dtype, copy=False), {}

    def step(self, action: Any) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        flat = np.array(action, np.float32).reshape(-1)
        observations, rewards, terminated, truncated = self._native.step(flat, False)
        observation = observations[0].astype(self._dtype, copy=False)
        return observation, float(rewards[0]), bool(terminated[0]), bool(truncated[0]), {}


class NativeVectorEnv(VectorEnv[np.ndarray, Any, np.ndarray]):
    """Many of agail's environments, stepped by C++ threads.

    Autoreset is Gymnasium's NEXT_STEP: the step after an episode's end starts the next one, ignores
    the action and is rewarded with 0.
    """

    metadata = {"autoreset_mode": AutoresetMode.NEXT_STEP, "render_modes": []}  # noqa: RUF012

    def __init__(
        self,
        name: str,
        num_envs: int = 1,
        threads: int | None = None,
        max_episode_steps: int | None = None,
    ):
        limit = _core.environment_spec(name)["max_episode_steps"]
        if max_episode_steps not in (None, limit):
            raise InputError(
                f"agail/{name} as a vector environment has a limit of {limit} steps, not "
                f"{max_episode_steps}; another one needs vectorization_mode='sync'"
            )
        self.num_envs = num_envs
        count = min(num_envs, _core.default_threads()) if threads is None else threads
        self._native = _core.NativeEnvironments(name, num_envs, count)
        self.single_observation_space, self.single_action_space = _spaces(name)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._dtype = self.single_observation_space.dtype
        self._seeded = np.zeros(num_envs, bool)

    def _one_each(self, what: str, count: int) -> None:
        if count != self.num_envs:
            raise InputError(
                f"reset() got {count} {what} for {self.num_envs} environments; one each"
            )

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        mask = (options or {}).get("reset_mask")
        chosen = np.ones(self.num_envs, bool) if mask is None else np.asarray(mask, bool)
        self._one_each("entries of reset_mask", chosen.size)
        begin = chosen & ~self._seeded  # those that do not go on with the seed that they had
        seeds = [0] * self.num_envs
        if isinstance(seed, list | tuple):
            self._one_each("seeds", len(seed))
            begin |= chosen & np.array([each is not None for each in seed])
            seeds = [int(np.random.default_rng(each).integers(2**63)) for each in seed]
        elif seed is not None or begin.any():
            super().reset(seed=seed)
            begin |= chosen & (seed is not None)
            seeds = [int(number) for number in self.np_random.integers(2**63, size=self.num_envs)]
        self._seeded |= begin
        self._native.reset(seeds, begin.tolist())
        observations = self._native.reset([], (chosen & ~begin).tolist())
        return observations.astype(self._dtype, copy=False), {}

    def step(
        self, actions: Any
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        flat = np.ascontiguousarray(actions, np.float32).reshape(-1)
        observations, rewards, terminated, truncated = self._native.step(flat, True)
        return observations.astype(self._dtype, copy=False), rewards, terminated, truncated, {}


def register() -> None:
    """Registers agail/<id> for every built-in id; done by `import agail`."""
    for name in _core.environment_ids():
        if f"agail/{name}" in gymnasium.registry:
            continue
        gymnasium.register(
            f"agail/{name}",
            entry_point="agail.gym:NativeEnv",
            vector_entry_point="agail.gym:NativeVectorEnv",
            max_episode_steps=_core.environment_spec(name)["max_episode_steps"],
            kwargs={"name": name},
        )
