"""Steps a second of EnvPool under uniformly random actions: envpool_steps.py ENV ENVIRONMENTS BATCH THREADS SECONDS

Counted are transitions. EnvPool spends a call of its own on each reset; with these frames it did `frames_per_second`.
"""

import sys
import time

import envpool
import numpy as np
from versions import report

WARM_UP = 0.5  # seconds


def main() -> None:
    name, count, batch, threads, seconds = sys.argv[1:]
    pool = envpool.make_gymnasium(
        name, num_envs=int(count), batch_size=int(batch), num_threads=int(threads), seed=0
    )
    space = pool.action_space
    drawn = np.random.default_rng(0).uniform(
        space.low, space.high, (1000, int(batch), *space.shape)
    )
    pool.async_reset()

    def steps(duration: float) -> tuple[int, int, float]:
        transitions = frames = calls = 0
        start = time.perf_counter()
        while time.perf_counter() - start < duration:
            info = pool.recv()[4]
            frames += len(info["env_id"])
            transitions += np.count_nonzero(info["elapsed_step"])
            pool.send(drawn[calls % len(drawn)], info["env_id"])
            calls += 1
        return int(transitions), frames, time.perf_counter() - start

    steps(WARM_UP)
    transitions, frames, took = steps(float(seconds))
    report(transitions / took, ["envpool", "numpy"], frames_per_second=frames / took)


if __name__ == "__main__":
    main()
