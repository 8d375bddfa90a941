"""From an expert of stable-baselines3 to a policy of agail, through a Minari dataset with most of the actions missing.

    pip install . stable-baselines3 'minari[hdf5]'
    python examples/sb3_to_agail.py [SEED]

Each cell (# %%) can be run on its own in a notebook. Under a minute, most of it for the expert.
"""

# %% An expert: PPO of stable-baselines3, with RL Zoo's settings for CartPole, until it balances for 475 steps.
import os
import sys
import tempfile
from pathlib import Path

import minari
import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import EvalCallback, StopTrainingOnRewardThreshold
from stable_baselines3.common.env_util import make_vec_env

import agail

torch.set_num_threads(1)  # a network this small is not quicker with more
seed = int(sys.argv[1]) if len(sys.argv) > 1 else 0
expert = PPO(
    "MlpPolicy",
    make_vec_env("CartPole-v1", n_envs=8, seed=seed),
    n_steps=32,
    batch_size=256,
    n_epochs=20,
    learning_rate=0.001,
    gamma=0.98,
    gae_lambda=0.8,
    device="cpu",
    seed=seed,
)
until = EvalCallback(
    make_vec_env("CartPole-v1", seed=seed + 1000),
    callback_on_new_best=StopTrainingOnRewardThreshold(475),
    eval_freq=256,  # steps of the 8 environments
    verbose=0,
)
expert.learn(200_000, until)

# %% Its episodes, as a Minari dataset (in a folder of this example's own; leave the variable out for Minari's usual one).
os.environ["MINARI_DATASETS_PATH"] = tempfile.mkdtemp()
recorded = agail.record(expert, 10, environment="CartPole-v1", seed=seed)
recorded.save(Path(os.environ["MINARI_DATASETS_PATH"]) / "cartpole" / "ppo-v0")
dataset = minari.load_dataset("cartpole/ppo-v0")
print(f"expert: {recorded.mean_return:.1f} over {dataset.total_episodes} episodes")

# %% Three quarters of its actions go missing.
demonstrations = agail.Demonstrations.from_minari(dataset).mask(0.75, seed=seed)
print(demonstrations)

# %% What is left is enough to imitate it.
run = agail.train("CartPole-v1", demonstrations, timesteps=20_000, seed=seed, progress=False)
result = agail.evaluate(run, episodes=50)
print(
    f"agail: {result.mean_return:.1f}, {result.share_of_demonstrations:.0%} of the expert's return"
)

# %% The policy acts as the expert does.
observations = np.concatenate([episode.observations[:-1] for episode in recorded])
actions = np.concatenate([episode.actions[:, 0] for episode in recorded])
agreement = np.mean(run.policy.predict(observations)[0] == actions)
print(f"same action in {agreement:.0%} of the expert's states")
