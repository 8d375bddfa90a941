"""Few runs, summed up as rliable does: interquartile mean, bootstrap intervals (Agarwal et al., 2021)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray


def share_of(value: float, reference: float | None) -> float | None:
    """None where the reference is not known or not above 0: a share of less than nothing says nothing."""
    return value / reference if reference is not None and reference > 0 else None


def iqm(values: NDArray[np.float64], axis: int = 0) -> NDArray[np.float64]:
    """Mean without the lowest and the highest quarter of n values, int(n / 4) each."""
    ordered = np.sort(np.asarray(values, np.float64), axis)
    cut = ordered.shape[axis] // 4
    kept = np.arange(cut, ordered.shape[axis] - cut)
    return np.take(ordered, kept, axis).mean(axis)


def bootstrap_interval(
    values: NDArray[np.float64],
    statistic: Callable[..., NDArray[np.float64]],
    resamples: int = 2000,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """95 % percentile interval of a statistic over the rows (runs), for each column."""
    rows = np.random.default_rng(0).integers(len(values), size=(resamples, len(values)))
    parts = np.array_split(rows, 1 + rows.size * values.shape[1] // 2**22)  # 32 MB at a time
    resampled = np.concatenate([statistic(values[chosen], axis=1) for chosen in parts])
    low, high = np.percentile(resampled, [2.5, 97.5], axis=0)
    return low, high
