"""Actions in whatever units the environment has: learning must not depend on them."""

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from small import train

import agail


class Reach(gymnasium.Env):
    """A point that is pushed towards 0 by an action in any units."""

    observation_space = spaces.Box(-10, 10, (2,), np.float64)

    def __init__(self, low, high):
        self.centre, self.scale = (low + high) / 2, (high - low) / 2
        self.action_space = spaces.Box(low, high, (1,), np.float32)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.place, self.steps = self.np_random.uniform(-2, 2), 0
        return np.array([self.place, 1.0]), {}

    def step(self, action):
        self.place += 0.3 * float((action[0] - self.centre) / self.scale)
        self.steps += 1
        reward = 5 - abs(self.place)
        return np.array([self.place, 1.0]), reward, abs(self.place) > 5, self.steps == 50, {}


class Expert:
    def __init__(self, environment):
        self.environment = environment

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        push = np.clip(-2 * observation[:1], -1, 1)
        return self.environment.centre + self.environment.scale * push, state


@pytest.mark.parametrize("method", ["bc", "bco", "agail"])
def test_units_of_the_actions_do_not_matter(method):
    def result(low, high):
        def make():
            return Reach(low, high)

        demos = agail.record(Expert(make()), 6, environment=make)
        demos = demos if method == "bc" else demos.mask(0.75)
        settings = {"bc": {"epochs": 60}, "inverse_dynamics": {"epochs": 60}}
        run = train(make, demos, method=method, timesteps=4096, **settings)
        action = run.policy.predict(np.array([0.1, 1.0]))[0]
        assert low <= action[0] <= high
        return agail.evaluate(run, 10, environment=make).mean_return / demos.mean_return

    usual = result(-1, 1)
    assert usual > (0.5 if method == "bco" else 0.9)
    for bounds in [(50, 100), (0, 255), (-0.001, 0.001), (999, 1001)]:
        assert result(*bounds) == pytest.approx(usual, abs=0.1), bounds


def test_exploration_is_in_units_of_the_bounds():
    run = train(lambda: Reach(0, 255), method="trpo", timesteps=512, policy={"initial_log_std": -1})
    observations = np.tile([0.1, 1.0], (2000, 1))
    actions = run.policy.predict(observations, deterministic=False)[0]
    assert actions.min() >= 0 and actions.max() <= 255
    assert np.std(actions) == pytest.approx(127.5 * np.exp(-1), rel=0.15)
    assert abs(actions.mean() - 127.5) < 60
