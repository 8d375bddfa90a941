"""Few runs, summed up: the interquartile mean and bootstrap intervals (Agarwal et al., 2021)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

RESAMPLES = 2000


def iqm(values: NDArray[np.float64], axis: int = 0) -> NDArray[np.float64]:
    """Mean of the middle half; the values at its ends count in part."""
    ordered = np.sort(np.asarray(values, np.float64), axis)
    n = ordered.shape[axis]
    weights = np.diff(np.clip(np.arange(n + 1) / n, 0.25, 0.75))
    return np.tensordot(weights / weights.sum(), ordered, (0, axis))


def bootstrap_interval(
    values: NDArray[np.float64], statistic: Callable[..., NDArray[np.float64]], seed: int = 0
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """95 % percentile interval of a statistic over the rows (runs), for each column."""
    random = np.random.default_rng(seed)
    rows = random.integers(len(values), size=(RESAMPLES, len(values)))
    resampled = np.array([statistic(values[chosen], axis=0) for chosen in rows])
    low, high = np.percentile(resampled, [2.5, 97.5], axis=0)
    return low, high
