"""Small runs, and an environment of the tests' own."""

import gymnasium

import agail

# Updates of a few milliseconds, as tests/python/program.py has them for the program.
SMALL = {
    "run": {
        "batch_steps": 256,
        "evaluate_every": 4,
        "evaluation_episodes": 3,
        "checkpoint_every": 2,
    },
    "policy": {"hidden": [8, 8]},
    "value": {"hidden": [8, 8]},
    "discriminator": {"hidden": [8, 8], "minibatches": 2, "minibatch": 32},
    "guide": {"hidden": 8},
    "bc": {"epochs": 5},
    "inverse_dynamics": {"epochs": 3},
}


def train(environment, demonstrations=None, **options):
    sections = {name: {**SMALL[name], **options.pop(name, {})} for name in SMALL}
    options.setdefault("progress", False)
    options.setdefault("timesteps", 1024)
    return agail.train(environment, demonstrations, **sections, **options)


class Line(gymnasium.Env):
    """A point that is pushed along a line; ends when it leaves it. Has no Gymnasium id."""

    def __init__(self):
        self.observation_space = gymnasium.spaces.Box(-10, 10, (2,))
        self.action_space = gymnasium.spaces.Box(-1, 1, (1,))

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.at = self.np_random.uniform(-1, 1)
        self.steps = 0
        return self.observation(), {}

    def observation(self):
        return self.observation_space.dtype.type([self.at, 1])

    def step(self, action):
        assert self.action_space.contains(action)
        self.at += 0.3 * float(action[0])
        self.steps += 1
        return self.observation(), -abs(self.at), abs(self.at) > 3, self.steps >= 50, {}
