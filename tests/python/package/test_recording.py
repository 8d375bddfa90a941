"""agail.record() with somebody else's policy."""

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from small import Line
from test_gymnasium import broken
from test_spaces import Discretes

import agail


class Model:
    """Remembers what it was asked."""

    def __init__(self, answer):
        self.answer, self.asked = answer, []

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        self.asked.append((observation, state, bool(episode_start[0]), deterministic))
        return self.answer(observation), (0 if state is None else state) + 1


def test_episodes_are_the_environments():
    model = Model(lambda observation: np.array([5.0]) * -observation[:1])  # beyond the bounds
    demos = agail.record(model, 3, environment=Line, seed=7)
    assert demos.environment == "Line" and len(demos) == 3 and demos.missing_ratio == 0
    for number, episode in enumerate(demos):
        line = Line()
        observation, _ = line.reset(seed=7 + number)
        np.testing.assert_array_equal(episode.observations[0], observation)
        for t in range(len(episode)):
            assert -1 <= episode.actions[t, 0] <= 1
            observation, reward, terminated, truncated, _ = line.step(
                episode.actions[t].astype(np.float32)
            )
            np.testing.assert_array_equal(episode.observations[t + 1], observation)
            assert episode.rewards[t] == reward
            assert (episode.terminations[t], episode.truncations[t]) == (terminated, truncated)
        assert terminated or truncated
    assert all(asked[3] is True for asked in model.asked)
    starts = [asked[2] for asked in model.asked]
    assert sum(starts) == 3 and starts[0]
    states = [asked[1] for asked in model.asked]
    assert states[0] is None and states[1] == 1
    agail.record(model, 1, environment=Line, deterministic=False)
    assert model.asked[-1][3] is False


def test_environments_that_reuse_their_observation():
    class Reusing(Line):
        def __init__(self):
            super().__init__()
            self.observation_space = spaces.Box(-10, 10, (2,), np.float64)
            self.buffer = np.zeros(2)

        def observation(self):
            self.buffer[:] = self.at, self.steps
            return self.buffer

    demos = agail.record(Model(lambda observation: np.zeros(1)), 1, environment=Reusing)
    np.testing.assert_array_equal(demos[0].observations[:, 1], np.arange(51))


def test_discrete_actions_and_built_in_environments():
    demos = agail.record(Model(lambda seen: seen - 3), 2, environment=Discretes)
    assert demos.mean_return == 20  # it was asked with what the environment gave, not one-hot
    assert demos.observation_dim == 3 and demos[0].actions.max() <= 2
    demos = agail.record(Model(lambda observation: np.int64(1)), 2, environment="CartPole-v1")
    assert demos.environment == "CartPole-v1" and (demos[0].actions == 1).all()
    given = gymnasium.make("agail/CartPole-v1")
    again = agail.record(Model(lambda observation: np.int64(1)), 2, environment=given)
    assert again.environment == "CartPole-v1"
    np.testing.assert_array_equal(demos[1].observations, again[1].observations)
    run = agail.train("CartPole-v1", demos.mask(0.5), method="bc", timesteps=1, progress=False)
    assert run.finished


def test_our_own_policy_through_predict():
    run = agail.train("CartPole-v1", method="trpo", timesteps=20_000, progress=False)
    model = Model(lambda observation: run.policy.predict(observation)[0])
    theirs = agail.record(model, 5, environment="CartPole-v1").mean_return
    assert theirs > 0.6 * agail.evaluate(run, 5).mean_return > 60


@pytest.mark.parametrize(
    ("answer", "told"),
    [
        (np.zeros(2), r"action space of Line is Box"),
        (np.array([np.nan]), "Model returned array"),
        ("left", "returned 'left'"),
    ],
    ids=str,
)
def test_actions_that_are_not_the_environments(answer, told):
    with pytest.raises(agail.InputError, match=told):
        agail.record(Model(lambda observation: answer), 1, environment=Line)


def test_other_mistakes():
    with pytest.raises(agail.InputError, match="Discrete"):
        agail.record(Model(lambda seen: 9), 1, environment=Discretes)
    with pytest.raises(agail.InputError, match="needs the environment"):
        agail.record(Model(None), 1)
    with pytest.raises(agail.InputError, match=r"no predict"):
        agail.record(3, 1, environment=Line)
    with pytest.raises(agail.InputError, match="episodes = 0"):
        agail.record(Model(None), 0, environment=Line)
    with pytest.raises(agail.InputError, match="raised ZeroDivisionError after"):
        agail.record(Model(lambda o: np.zeros(1)), 50, environment=broken("raises", after=40))
    with pytest.raises(agail.InputError, match="only actions may be missing"):
        agail.record(Model(lambda o: np.zeros(1)), 2, environment=broken("nan", after=40))


def test_spaces_that_are_not_supported():
    class Other(Line):
        def __init__(self):
            super().__init__()
            self.action_space = spaces.MultiDiscrete([2, 2])

    with pytest.raises(agail.InputError, match="MultiDiscrete is not supported"):
        agail.record(Model(None), 1, environment=Other)
