"""Spaces of all kinds: what training takes, and what policies and environments say to each other."""

import pickle

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from small import Line, train

import agail


class Discretes(gymnasium.Env):
    """Numbers 5 to 7 seen, 2 to 4 done; right is to do what is seen, less 3."""

    observation_space = spaces.Discrete(3, start=5)
    action_space = spaces.Discrete(3, start=2)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.steps = 0
        return self.draw(), {}

    def draw(self):
        self.seen = self.np_random.integers(5, 8)
        return self.seen

    def step(self, action):
        assert self.action_space.contains(action)
        reward = float(action == self.seen - 3)
        self.steps += 1
        return self.draw(), reward, False, self.steps == 20, {}


def test_discrete_spaces():
    run = agail.train(Discretes, method="trpo", timesteps=20_000, progress=False)
    assert run.policy.n_actions == 3 and run.policy.observation_dim == 3
    assert np.nanmax(run.metrics["eval/mean_reward"]) == 20
    policy = run.policy
    # As the environment counts: one observation, a batch, one-hot rows.
    assert [policy.predict(seen)[0] for seen in (5, 6, np.int64(7))] == [2, 3, 4]
    action, _ = policy.predict(5)
    assert action.shape == () and action.dtype == np.int64
    for batch in ([5, 6, 7], np.eye(3)):
        np.testing.assert_array_equal(policy.predict(batch)[0], [2, 3, 4])
    assert agail.record(policy, 2, environment=Discretes)[0].actions.max() == 2  # from 0
    for wrong in (8, 5.5, np.zeros((2, 2))):
        with pytest.raises(agail.InputError, match="this policy takes"):
            policy.predict(wrong)
    again = pickle.loads(pickle.dumps(policy))
    np.testing.assert_array_equal(again.predict([7, 5])[0], [4, 2])


def test_discrete_observations_only():
    policy = train("FrozenLake-v1", method="trpo").policy
    environment = gymnasium.make("FrozenLake-v1")
    observation, _ = environment.reset(seed=0)
    for _ in range(3):
        observation = environment.step(policy.predict(observation)[0])[0]
        environment.reset()
    assert policy.predict([0, 3, 15])[0].shape == (3,)


class Shaped(Line):
    """Observations and actions of two dimensions, in double precision, within bounds."""

    def __init__(self):
        super().__init__()
        self.observation_space = spaces.Box(-1, 1, (2, 3), np.float64)
        self.action_space = spaces.Box(-0.1, 0.2, (2, 2), np.float64)

    def observation(self):
        return np.full((2, 3), np.tanh(self.at))

    def step(self, action):
        assert self.action_space.contains(action)
        return super().step(action.reshape(-1)) if False else self.move(action)

    def move(self, action):
        self.at += action.sum()
        self.steps += 1
        return self.observation(), 0.0, False, self.steps == 20, {}


def test_shaped_spaces_and_bounds():
    policy = train(Shaped, method="trpo").policy
    assert policy.observation_dim == 6 and policy.action_dim == 4
    observation, _ = Shaped().reset(seed=0)
    action, _ = policy.predict(observation)
    assert action.shape == (2, 2) and action.dtype == np.float32
    for shape, batch in (((6,), ()), ((5, 6), (5,)), ((5, 2, 3), (5,)), ((0, 2, 3), (0,))):
        assert policy.predict(np.zeros(shape))[0].shape == (*batch, 2, 2)
    np.testing.assert_array_equal(policy.predict(observation.reshape(6))[0], action)
    np.testing.assert_array_equal(policy.predict(observation[None])[0][0], action)
    with pytest.raises(agail.InputError, match=r"\(2, 3\) or \(n, 2, 3\)"):
        policy.predict(np.zeros((3, 2)))
    demos = agail.record(policy, 1, environment=Shaped)
    assert demos.observation_dim == 6 and demos.action_dim == 4


class Scalar(Line):
    """One number seen, one done, each without a dimension."""

    def __init__(self):
        super().__init__()
        self.observation_space, self.action_space = spaces.Box(-10, 10, ()), spaces.Box(-1, 1, ())

    def observation(self):
        return np.array(self.at, np.float32)

    def step(self, action):
        assert self.action_space.contains(np.asarray(action))
        self.at += 0.3 * float(action)
        self.steps += 1
        return self.observation(), 0.0, False, self.steps == 20, {}


def test_spaces_without_dimensions():
    policy = train(Scalar, method="trpo").policy
    assert policy.predict(0.5)[0].shape == () and policy.predict([0.5, 1])[0].shape == (2,)


@pytest.mark.parametrize(
    ("space", "kind", "told"),
    [
        (spaces.Dict(a=spaces.Box(0, 1)), "observation", "FlattenObservation"),
        (spaces.MultiBinary(3), "observation", "Box and Discrete"),
        (spaces.MultiDiscrete([2, 2]), "action", "number the combinations"),
        (spaces.Box(0, 5, (1,), np.int64), "action", "floating point"),
    ],
    ids=str,
)
def test_spaces_that_are_not_supported(space, kind, told):
    class Other(Line):
        def __init__(self):
            super().__init__()
            setattr(self, f"{kind}_space", space)

    with pytest.raises(agail.InputError, match=told):
        train(Other, method="trpo")


def test_an_environment_that_is_not_the_policys():
    run = train(Discretes, method="trpo")

    class Other(Discretes):
        action_space = spaces.Discrete(4)

    Other.__name__ = "Discretes"
    with pytest.raises(agail.InputError, match=r"3 discrete actions, .* 4 discrete actions; give"):
        agail.evaluate(run, 1, environment=Other)
