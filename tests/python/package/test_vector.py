"""Vector environments that do not tell how their environments are made: one of one is a lane."""

import gymnasium
import numpy as np
import pytest
from counting import LIMIT, Counting
from gymnasium.vector import AutoresetMode
from small import Line, train

import agail
from agail._vector import OfOne


class Still:
    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        return np.zeros(1, np.float32), None


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_every_mode_gives_the_same_episodes(mode):
    demos = agail.record(Still(), 6, environment=lambda: Counting(mode))
    assert demos.environment == "Counting" and len(demos) == 6
    # reset() begins another episode than the one that SAME_STEP has begun already.
    skip = 2 if mode == AutoresetMode.SAME_STEP else 1
    for number, episode in zip(range(0, 6 * skip, skip), demos):
        terminates = number % 3 == 0
        length = 3 if terminates else LIMIT
        # The last row is the episode's own final observation, not the next one's first.
        assert episode.observations[:, 0].tolist() == [number] * (length + 1)
        assert episode.observations[:, 1].tolist() == list(range(length + 1))
        assert episode.rewards.tolist() == list(range(1, length + 1))
        assert episode.terminations.tolist() == [False] * (length - 1) + [terminates]
        assert episode.truncations.tolist() == [False] * (length - 1) + [not terminates]


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_training_on_every_mode(mode):
    run = train(lambda: Counting(mode), method="trpo", lanes=2)
    assert run.finished and run.settings["run"]["lanes"] == 2
    lengths = np.genfromtxt(run.folder / "episodes.csv", delimiter=",", names=True)
    pairs = set(zip(*(lengths[name].astype(int).tolist() for name in lengths.dtype.names[-2:])))
    assert pairs == {(6, 3), (15, 5)} or pairs == {(3, 6), (5, 15)}


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_a_vector_of_one_learns_as_its_environment(mode):
    def vector():
        return gymnasium.vector.SyncVectorEnv([Line], autoreset_mode=mode)

    policies = [train(make, method="trpo", lanes=2).policy for make in (Line, vector)]
    rows = np.random.default_rng(0).normal(size=(20, 2))
    np.testing.assert_array_equal(*[policy.predict(rows)[0] for policy in policies])


def test_vectors_that_cannot_be_lanes():
    with pytest.raises(agail.InputError, match="num_envs=1"):
        train(lambda: Counting(AutoresetMode.NEXT_STEP, 2), method="trpo")
    with pytest.raises(agail.InputError, match=r"num_envs=1.*lanes=N"):
        train(Counting(AutoresetMode.NEXT_STEP, 2), method="trpo")
    with pytest.raises(agail.InputError, match="autoreset_mode"):
        train(lambda: Counting(None), method="trpo")


def test_final_observation_that_is_not_there():
    class Forgetful(Counting):
        def step(self, actions):
            return *super().step(actions)[:4], {}

    with pytest.raises(agail.InputError, match="no final_obs"):
        train(lambda: Forgetful(AutoresetMode.SAME_STEP), method="trpo")


def test_it_closes_what_it_wraps():
    closed = []

    class Closing(Counting):
        def close_extras(self, **kwargs):
            closed.append(self)

    OfOne(Closing(AutoresetMode.DISABLED)).close()
    assert len(closed) == 1
