"""How an environment's observations and actions lie in the rows of numbers that the core and its policies see."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from agail._core import InputError


@dataclass(frozen=True)
class Observations:
    """Of a Box: its numbers in a row. Of a Discrete space, which has the shape (): one-hot."""

    size: int  # numbers of a row
    shape: tuple[int, ...]
    start: int | None = None  # of a Discrete space

    def rows(self, own: NDArray[Any]) -> NDArray[np.float64]:
        """(n, size) from (n, *shape). ValueError: a number that is not in the Discrete space."""
        if self.start is None:
            return np.ascontiguousarray(own, np.float64).reshape(len(own), self.size)
        index = own - self.start
        if ((np.floor(index) != index) | (index < 0) | (index >= self.size)).any():
            raise ValueError(f"not whole numbers from {self.start} to {self.start + self.size - 1}")
        rows = np.zeros((len(own), self.size))
        rows[np.arange(len(own)), index.astype(np.int64)] = 1
        return rows


@dataclass(frozen=True)
class Actions:
    """Of a Box: its numbers in a row. Of a Discrete space: counted from 0."""

    size: int
    shape: tuple[int, ...]
    start: int | None = None

    def own(self, rows: NDArray[Any]) -> NDArray[Any]:
        """(n, *shape) from (n, size); of a Discrete space (n,) from (n,)."""
        return rows.reshape(len(rows), *self.shape) if self.start is None else rows + self.start


def described(observations: Observations, actions: Actions) -> dict[str, list[int]]:
    """What a policy keeps: only what is not a row of numbers, or not counted from 0, already."""
    layout = {}
    if observations.start is not None:
        layout["observation_start"] = [observations.start]
    elif observations.shape != (observations.size,):
        layout["observation_shape"] = list(observations.shape)
    if actions.start:
        layout["action_start"] = [actions.start]
    elif actions.start is None and actions.shape != (actions.size,):
        layout["action_shape"] = list(actions.shape)
    return layout


class PolicyLayout:
    """The reverse of described(), for predict() (python/core/policy.cc)."""

    def __init__(
        self, layout: dict[str, list[int]], observation_dim: int, action_dim: int, discrete: bool
    ):
        start = layout.get("observation_start", [None])[0]
        shape = layout.get("observation_shape", [observation_dim]) if start is None else []
        self._observations = Observations(observation_dim, tuple(shape), start)
        start = layout.get("action_start", [0])[0] if discrete else None
        shape = layout.get("action_shape", [action_dim]) if start is None else []
        self._actions = Actions(action_dim, tuple(shape), start)

    def rows(self, observation: ArrayLike) -> tuple[NDArray[np.float64], bool]:
        """(n, observation_dim), and whether it was one observation rather than a batch. InputError."""
        shape, size = self._observations.shape, self._observations.size
        try:
            array = np.asarray(observation, np.float64)
            if array.shape == shape:
                return self._observations.rows(array[None]), True
            if array.shape[1:] == shape:
                return self._observations.rows(array), False
        except ValueError as error:
            raise InputError(f"the observations are {error}, as this policy takes them") from None
        if array.ndim in (1, 2) and array.shape[-1] == size:  # in rows already
            return array.reshape(-1, size), array.ndim == 1
        batch = f"(n, {', '.join(map(str, shape))})" if shape else "(n,)"
        raise InputError(
            f"this policy takes observations of shape {shape} or {batch}, or {size} numbers in a "
            f"row, not {array.shape}"
        )

    def own_actions(self, rows: NDArray[Any], single: bool) -> NDArray[Any]:
        """As the environment takes them, from those of as many rows; a single one without the batch."""
        own = self._actions.own(rows)
        if not single:
            return own
        # Of a Discrete space a number rather than an array, as some environments look it up.
        return own[0] if self._actions.start is not None else own.reshape(own.shape[1:])
