"""A dead channel: one actuator was never logged. Every action lacks the same entry, from the first step to the last.

No demonstrated step shows the whole action, so GAIL cannot start, and inverse dynamics cannot learn from the
demonstrations what the silent actuator did. Only interaction can tell.
"""

from comparison import compare, options, recorded

JOINTS = {"foot": 2, "thigh": 0}  # Hopper's actions are torques at thigh, leg and foot

if __name__ == "__main__":
    arguments = options(__doc__)
    whole = recorded(arguments.work, 3)
    for joint, channel in JOINTS.items():
        demonstrations = whole.mask(1 / 3, "dimension", dimension=channel)
        print(demonstrations)
        methods = ["agail", "bc", "bco"]
        compare(f"dead-{joint}", {m: (demonstrations, {"method": m}) for m in methods}, arguments)
