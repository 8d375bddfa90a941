"""A large file of demonstrations in Minari's layout, written in pieces (needs h5py): growth_file.py PATH TRANSITIONS"""

import os
import sys
from pathlib import Path

import h5py
import numpy as np

EPISODE = 1000
OBSERVATIONS, ACTIONS = 11, 3  # Hopper


def write_demonstrations(path: Path, transitions: int) -> None:
    """Random walks in episodes of 1,000 steps, half of the actions missing, not compressed; whole or absent. What is there is kept."""
    if path.exists():
        return
    partial = path.with_suffix(".partial")
    random = np.random.default_rng(0)
    with h5py.File(partial, "w") as file:
        for number in range(transitions // EPISODE):
            group = file.create_group(f"episode_{number}")
            walk = np.cumsum(0.05 * random.standard_normal((EPISODE + 1, OBSERVATIONS)), axis=0)
            actions = random.uniform(-1, 1, (EPISODE, ACTIONS)).astype(np.float32)
            actions[random.random(EPISODE) < 0.5] = np.nan
            group["observations"] = walk
            group["actions"] = actions
            group["rewards"] = random.random(EPISODE)
            group["terminations"] = np.zeros(EPISODE, bool)
            group["truncations"] = np.arange(EPISODE) == EPISODE - 1
    os.replace(partial, path)  # noqa: PTH105


if __name__ == "__main__":
    write_demonstrations(Path(sys.argv[1]), int(sys.argv[2]))
