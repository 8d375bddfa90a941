"""A vector environment that counts its steps, in every autoreset mode."""

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

LIMIT = 5


class Counting(VectorEnv):
    """Observations are (episode, steps in it); reward = steps. Every third episode ends in a terminal state after 3
    steps, the others at a limit of 5. An episode that goes on after its end raises AssertionError.
    """

    def __init__(self, mode, num_envs=1):
        self.metadata = {"autoreset_mode": mode}
        self.num_envs = num_envs
        self.single_observation_space = spaces.Box(-1, 1000, (2,))
        self.single_action_space = spaces.Box(-1, 1, (1,))
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.episode = np.full(num_envs, -1)
        self.steps = np.zeros(num_envs, int)
        self.ended = np.zeros(num_envs, bool)

    def observations(self):
        return np.stack([self.episode, self.steps], axis=1).astype(np.float32)

    def begin(self, which):
        self.episode[which] += 1
        self.steps[which] = 0
        self.ended[which] = False

    def reset(self, *, seed=None, options=None):
        assert seed is None or len(seed) == self.num_envs
        self.begin(np.full(self.num_envs, True))
        return self.observations(), {}

    def step(self, actions):
        assert self.action_space.contains(actions)
        mode = self.metadata["autoreset_mode"]
        again = self.ended & (mode == AutoresetMode.NEXT_STEP)
        assert not (self.ended & ~again).any(), "a step after the end of an episode"
        going = ~again
        self.steps[going] += 1
        self.begin(again)
        terminated = going & (self.episode % 3 == 0) & (self.steps == 3)
        truncated = going & (self.steps == LIMIT)
        rewards, self.ended = self.steps.astype(float), terminated | truncated
        info = {}
        if mode == AutoresetMode.SAME_STEP and self.ended.any():
            info["final_obs"] = np.array(list(self.observations()), dtype=object)
            self.begin(self.ended.copy())
        return self.observations(), rewards, terminated, truncated, info
