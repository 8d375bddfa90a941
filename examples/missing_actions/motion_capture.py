"""Motion capture: eight episodes, of which two were recorded on the robot, with its actions and all of its state.

Of the other six there are the joints' positions only: no actions, no velocities. A demonstration must have whole
observations, so velocities are estimated by differences of positions and, where there is no position to take the
difference of (the way forward is not observed), by the mean of the two complete episodes. The discriminator sees
positions alone, and the policy starts from the measured actions alone: of the estimates only mean and deviation are
used, which scale the policy's observations.
"""

import numpy as np
from comparison import compare, options, recorded

import agail

POSITIONS, FORWARD, OTHERS = np.s_[:5], 5, np.s_[6:]  # height and four angles; then velocities
STEP = 0.008  # seconds


def captured(whole, complete):
    speed = np.mean([episode.observations[:, FORWARD].mean() for episode in whole[:complete]])
    observations = [episode.observations.copy() for episode in whole]
    for states in observations[complete:]:
        states[:, FORWARD] = speed
        states[:, OTHERS] = np.gradient(states[:, POSITIONS], STEP, axis=0).clip(-10, 10)
    arrays = whole.to_arrays()
    arrays["observations"] = np.concatenate([states[:-1] for states in observations])
    arrays["next_observations"] = np.concatenate([states[1:] for states in observations])
    arrays["actions"][arrays["episodes"] >= complete] = np.nan
    return agail.Demonstrations.from_arrays(**arrays, environment="Hopper-v5")


if __name__ == "__main__":
    arguments = options(__doc__)
    demonstrations = captured(recorded(arguments.work, 8), complete=2)
    print(demonstrations)
    positions = {"discriminator": {"features": [0, 1, 2, 3, 4]}}
    variants = {
        "agail": {"method": "agail", "start": {"method": "clone"}, **positions},
        "bc": {"method": "bc"},
        "state-gail": {"method": "state-gail", **positions},
        "agail on all": {"method": "agail"},
    }
    compare("motion-capture", {k: (demonstrations, v) for k, v in variants.items()}, arguments)
