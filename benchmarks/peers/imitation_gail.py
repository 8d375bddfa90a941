"""Samples a second of imitation's GAIL with sb3-contrib's TRPO: imitation_gail.py ENV ENVIRONMENTS dummy|subproc THREADS UPDATES

As in agail's preset `paper`: three TRPO steps, then 8 minibatches of 128 for the discriminator of 2 x 100 tanh, which like the
policy normalises what it sees. 100 demonstrations of random actions: what they show does not matter here. UPDATES: TRPO steps, a multiple of 3.
"""

import sys
import tempfile
import time

import numpy as np
import torch
from imitation.algorithms.adversarial.gail import GAIL
from imitation.data import rollout
from imitation.data.wrappers import RolloutInfoWrapper
from imitation.policies.base import NormalizeFeaturesExtractor
from imitation.rewards.reward_nets import BasicRewardNet
from imitation.util import logger
from imitation.util.networks import RunningNorm
from sb3_settings import BATCH, PACKAGES, environments, trpo
from stable_baselines3.common.vec_env import DummyVecEnv
from versions import report

TRPO_STEPS = 3  # a round


def demonstrations(name: str) -> rollout.types.Transitions:
    import gymnasium

    environment = DummyVecEnv([lambda: RolloutInfoWrapper(gymnasium.make(name))])
    enough = rollout.make_min_episodes(100)
    episodes = rollout.rollout(None, environment, enough, rng=np.random.default_rng(0))
    return rollout.flatten_trajectories(episodes)


def main() -> None:
    name, count, kind, threads, updates = sys.argv[1:]
    torch.set_num_threads(int(threads))
    environment = environments(name, int(count), kind)
    learner = GAIL(
        demonstrations=demonstrations(name),
        demo_batch_size=128,
        n_disc_updates_per_round=8,
        gen_train_timesteps=TRPO_STEPS * BATCH,
        venv=environment,
        gen_algo=trpo(environment, features_extractor_class=NormalizeFeaturesExtractor),
        reward_net=BasicRewardNet(
            environment.observation_space,
            environment.action_space,
            hid_sizes=(100, 100),
            activation=torch.nn.Tanh,
            normalize_input_layer=RunningNorm,
        ),
        disc_opt_kwargs=dict(lr=1e-4),
        allow_variable_horizon=True,
        custom_logger=logger.configure(tempfile.mkdtemp(), format_strs=[]),
    )
    rounds = int(updates) // TRPO_STEPS
    ends = []
    learner.train(
        (1 + rounds) * TRPO_STEPS * BATCH, callback=lambda _: ends.append(time.perf_counter())
    )
    assert len(ends) == 1 + rounds
    environment.close()
    report(rounds * TRPO_STEPS * BATCH / (ends[-1] - ends[0]), [*PACKAGES, "imitation"])


if __name__ == "__main__":
    main()
