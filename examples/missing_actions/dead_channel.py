"""A dead channel: one actuator was never logged. Every action lacks the same entry, from the first step to the last.

No demonstrated step shows the whole action, so GAIL cannot start, and inverse dynamics cannot learn from the
demonstrations what the silent actuator did. Only interaction can tell, or a single episode in which it was logged.
"""

import numpy as np
from comparison import compare, options, recorded

import agail

JOINTS = {"foot": 2, "thigh": 0}  # Hopper's actions are torques at thigh, leg and foot


def silent(whole, channel, logged):
    """Without this channel in all episodes but the first `logged`."""
    arrays = whole.to_arrays()
    arrays["actions"][arrays["episodes"] >= logged, channel] = np.nan
    return agail.Demonstrations.from_arrays(**arrays, environment="Hopper-v5")


if __name__ == "__main__":
    arguments = options(__doc__)
    whole = recorded(arguments.work, 3)
    for joint, channel in JOINTS.items():
        demonstrations = silent(whole, channel, logged=0)
        print(f"{joint}: {demonstrations}")
        variants = {m: (demonstrations, {"method": m}) for m in ["agail", "bc", "bco"]}
        variants["agail, one whole"] = silent(whole, channel, logged=1), {}
        variants["state-gail"] = whole, {"method": "state-gail"}  # reads no action
        compare(f"dead-{joint}", variants, arguments)
