"""The packages that others use, themselves: those of tests/peers-requirements.txt. ./run-tests --long installs them."""

import runpy
import sys
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from same import same

import agail

pytestmark = pytest.mark.peers
WHY = "is not installed: tests/peers-requirements.txt, ./run-tests --long"
EXAMPLE = Path(__file__).resolve().parents[3] / "examples/sb3_to_agail.py"


def package(name):
    return pytest.importorskip(name, reason=f"{name} {WHY}")


@pytest.fixture
def imitation():
    package("imitation")
    return package("imitation.data.types")


@pytest.mark.parametrize("environment", ["Hopper-v5", "CartPole-v1"])
def test_trajectories_there_and_back(imitation, environment):
    demos = agail.record(Random(environment), 3, environment=environment)
    given = demos.to_trajectories()
    assert all(type(each) is imitation.TrajectoryWithRew for each in given)
    assert [len(each) for each in given] == [len(episode) for episode in demos]
    assert given[0].acts.dtype == (np.int64 if environment == "CartPole-v1" else np.float32)
    same(demos, agail.Demonstrations.from_trajectories(given, environment=environment))
    # As imitation stores them, and takes them apart for its algorithms.
    from imitation.data import rollout

    transitions = rollout.flatten_trajectories(given)
    assert len(transitions) == demos.transitions
    assert (
        np.flatnonzero(transitions.dones).tolist()
        == (np.cumsum(list(map(len, demos))) - 1).tolist()
    )


def test_trajectories_with_missing_actions(imitation):
    demos = agail.record(Random("Hopper-v5"), 2, environment="Hopper-v5").mask(0.5)
    given = demos.to_trajectories()
    same(demos, agail.Demonstrations.from_trajectories(given))
    discrete = agail.record(Random("CartPole-v1"), 2, environment="CartPole-v1").mask(0.5)
    with pytest.raises(agail.InputError, match="discrete action is missing"):
        discrete.to_trajectories()


class Random:
    """Random actions, by predict()."""

    def __init__(self, environment):
        self.space = gymnasium.make(f"agail/{environment}").action_space
        self.space.seed(0)

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        return self.space.sample(), None


def test_rollouts_of_imitation(imitation):
    """imitation's own recorder, of a model of stable-baselines3."""
    package("stable_baselines3")
    from imitation.data import rollout
    from imitation.data.wrappers import RolloutInfoWrapper
    from stable_baselines3 import PPO
    from stable_baselines3.common.vec_env import DummyVecEnv

    vector = DummyVecEnv([lambda: RolloutInfoWrapper(gymnasium.make("Pendulum-v1"))] * 2)
    model = PPO("MlpPolicy", vector, device="cpu", seed=0)
    for exclude in (True, False):
        recorded = rollout.rollout(model, vector, rollout.make_sample_until(min_episodes=4),
                                   np.random.default_rng(0), unwrap=True, exclude_infos=exclude)  # fmt: skip
        demos = agail.Demonstrations.from_trajectories(recorded, environment="Pendulum-v1")
        assert len(demos) == len(recorded) and demos.transitions == 200 * len(demos)
        for episode, trajectory in zip(demos, recorded):
            np.testing.assert_array_equal(episode.observations, trajectory.obs)
            np.testing.assert_array_equal(episode.actions, trajectory.acts)
            np.testing.assert_allclose(episode.rewards, trajectory.rews)
            assert episode.truncations[-1] != exclude  # only infos know that it is the time limit
    agail.train("Pendulum-v1", demos.mask(0.5), method="bc", timesteps=1, progress=False)


@pytest.mark.parametrize("algorithm", ["PPO", "SAC"])
def test_recording_a_model_of_stable_baselines3(algorithm):
    sb3 = package("stable_baselines3")
    model = getattr(sb3, algorithm)("MlpPolicy", "Pendulum-v1", device="cpu", seed=0)
    demos = agail.record(model, 2, environment="Pendulum-v1", seed=3)
    environment = gymnasium.make("Pendulum-v1")
    observation, _ = environment.reset(seed=4)
    for t in range(200):
        np.testing.assert_array_equal(demos[1].observations[t], observation)
        action, _ = model.predict(observation, deterministic=True)
        np.testing.assert_array_equal(demos[1].actions[t], action)
        observation, reward, *_ = environment.step(action)
        assert demos[1].rewards[t] == pytest.approx(reward)
    assert demos[1].truncations[-1] and demos.environment == "Pendulum-v1"


def test_the_example(capsys, monkeypatch):
    package("stable_baselines3")
    monkeypatch.setattr(sys, "argv", [str(EXAMPLE)])
    names = runpy.run_path(str(EXAMPLE))
    assert names["recorded"].mean_return > 300, "no expert"
    assert names["demonstrations"].missing_ratio == pytest.approx(0.75, abs=0.01)
    assert names["result"].share_of_demonstrations > 0.9
    assert names["agreement"] > 0.8
    assert "of the expert's return" in capsys.readouterr().out
