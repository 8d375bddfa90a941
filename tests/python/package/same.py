"""Equal demonstrations."""

import numpy as np


def same(one, other):
    assert len(one) == len(other)
    for a, b in zip(one, other):
        for name in ("observations", "actions", "available", "rewards", "terminations"):
            np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
