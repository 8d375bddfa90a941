"""Teleoperation over a bad link: the link fails for seconds at a time, and with it go the commands; states keep coming.

The link is Gilbert's two-state model: it fails with probability 1/50 a step and returns with 1/150, so that commands
come in runs of 50 steps (0.4 s) and are lost in runs of 150 (1.2 s): three quarters are missing.
"""

import numpy as np
from comparison import compare, options, recorded

import agail


def link(steps, random):
    """Whether each step's command arrived."""
    up = np.empty(steps, bool)
    state = random.random() < 0.25
    for t in range(steps):
        up[t] = state
        state = random.random() >= 1 / 50 if state else random.random() < 1 / 150
    return up


def lost(whole, random):
    """The demonstrations as they would be logged: NaN where no command arrived."""
    arrays = whole.to_arrays()
    arrived = np.concatenate([link(len(episode), random) for episode in whole])
    arrays["actions"][~arrived] = np.nan
    return agail.Demonstrations.from_arrays(**arrays, environment="Hopper-v5")


if __name__ == "__main__":
    arguments = options(__doc__)
    demonstrations = lost(recorded(arguments.work, 3), np.random.default_rng(0))
    print(demonstrations)
    methods = ["agail", "bc", "state-gail", "gail"]
    compare("dropout", {m: (demonstrations, {"method": m}) for m in methods}, arguments)
