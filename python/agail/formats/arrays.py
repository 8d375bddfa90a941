"""Plain arrays with one row a step, which is what all formats come down to."""

from __future__ import annotations

from typing import Any

import numpy as np

from agail import _core
from agail._core import InputError
from agail.formats import Arrays, numbers


def _column(where: str, name: str, value: Any, rows: int) -> list[float]:
    if value is None:
        return []
    array = numbers(where, name, value, (1,))
    if len(array) != rows:
        raise InputError(f"{name} have the shape {array.shape}, the observations {rows} rows")
    return array.astype(np.float64).tolist()


def _actions(where: str, actions: Any, available: Any, rows: int) -> tuple[np.ndarray, bool]:
    """(N, A), missing entries NaN, and whether they are discrete."""
    act = np.empty((rows, 0)) if actions is None else numbers(where, "actions", actions, (1, 2))
    discrete = act.ndim == 1 and np.issubdtype(act.dtype, np.integer)
    act = act.astype(np.float64)
    act = act[:, None] if act.ndim == 1 else act
    if len(act) != rows:
        raise InputError(f"actions have the shape {act.shape}, the observations {rows} rows")
    if available is not None:
        known = numbers(where, "action_available", available, (1, 2))
        if not np.isin(known, (0, 1)).all():
            raise InputError(
                f"{where}: action_available has values other than 0 (missing) and 1 (known)"
            )
        known = known.astype(bool)
        known = known[:, None] if known.ndim == 1 else known
        if known.shape not in ((rows, 1), act.shape):
            raise InputError(f"action_available has the shape {known.shape}, not {act.shape}")
        act = np.where(known, act, np.nan)
    return act, discrete


def core_of(arrays: Arrays, environment: str, where: str = "the arrays") -> _core.Demonstrations:
    """arrays: what Demonstrations.from_arrays() takes, by name; where: what to call them in messages."""
    if environment.startswith("agail/") and environment[6:] in _core.environment_ids():
        environment = environment[6:]  # the core knows its own by this name, and checks their sizes
    table = numbers(where, "observations", arrays["observations"], (2,))
    rows = len(table)
    act, discrete = _actions(where, arrays.get("actions"), arrays.get("action_available"), rows)
    following = None
    if arrays.get("next_observations") is not None:
        following = numbers(where, "next_observations", arrays["next_observations"], (2,))
        if following.shape != table.shape:
            raise InputError(
                f"next_observations have the shape {following.shape}, not {table.shape}"
            )
        following = np.ascontiguousarray(following, np.float64)
    columns = ("rewards", "terminations", "truncations", "episodes")
    return _core.Demonstrations.from_table(
        np.ascontiguousarray(table, np.float64),
        np.ascontiguousarray(act),
        following,
        *(_column(where, name, arrays.get(name), rows) for name in columns),
        discrete,
        table.dtype == np.float32,
        environment,
        where,
    )


def arrays_of(core: _core.Demonstrations) -> Arrays:
    """The reverse."""
    episodes = [core.episode(i) for i in range(len(core))]
    kind = np.float32 if core.float32 else np.float64
    lengths = [len(each["terminations"]) for each in episodes]

    def joined(name: str) -> np.ndarray:
        return np.concatenate([each[name] for each in episodes])

    observations = [each["observations"].astype(kind) for each in episodes]
    arrays = {
        "observations": np.concatenate([each[:-1] for each in observations]),
        "next_observations": np.concatenate([each[1:] for each in observations]),
        "terminations": joined("terminations"),
        "truncations": joined("truncations"),
        "episodes": np.repeat(np.arange(len(lengths)), lengths),
    }
    if all(each["rewards"] is not None for each in episodes):
        arrays["rewards"] = joined("rewards")
    actions = joined("actions")
    if core.discrete:
        arrays["actions"] = actions[:, 0].astype(np.int64)
        if core.missing_ratio > 0:
            arrays["action_available"] = joined("available")[:, 0]
    elif actions.shape[1]:
        arrays["actions"] = actions.astype(np.float32)
    return arrays
