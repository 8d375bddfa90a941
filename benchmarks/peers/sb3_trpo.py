"""Samples a second of sb3-contrib's TRPO, with observations normalised: sb3_trpo.py ENV ENVIRONMENTS dummy|subproc THREADS UPDATES"""

import sys
import time

import torch
from sb3_settings import BATCH, PACKAGES, environments, trpo
from stable_baselines3.common.vec_env import VecNormalize
from versions import report

WARM_UP = 3


def main() -> None:
    name, count, kind, threads, updates = sys.argv[1:]
    torch.set_num_threads(int(threads))
    learner = trpo(VecNormalize(environments(name, int(count), kind), norm_reward=False))
    learner.learn(WARM_UP * BATCH)
    samples = int(updates) * BATCH
    start = time.perf_counter()
    learner.learn(samples, reset_num_timesteps=False)
    seconds = time.perf_counter() - start
    assert learner.num_timesteps == WARM_UP * BATCH + samples
    learner.env.close()
    report(samples / seconds, PACKAGES)


if __name__ == "__main__":
    main()
