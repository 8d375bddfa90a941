"""Demonstrations from somebody else's policy: whatever has stable-baselines3's predict()."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from agail import _core
from agail._core import InputError
from agail._source import EnvironmentLike, Lane, Source
from agail.formats.arrays import core_of


class Predictor(Protocol):
    """A model of stable-baselines3, or anything with this method."""

    def predict(
        self, observation: Any, state: Any, episode_start: Any, deterministic: bool
    ) -> tuple[Any, Any]: ...


class _Seen(Lane):
    """A lane that keeps the last observation as the environment gave it, which is what predict() takes."""

    seen: Any

    def _numbers(self, call: str, observation: Any) -> np.ndarray:
        self.seen = observation
        return super()._numbers(call, observation)


def _executed(action: Any, source: Source) -> np.ndarray | None:
    """As the lane takes it: within the bounds, discrete ones counted from 0. None: not of the space."""
    try:
        flat = np.asarray(action, np.float32).reshape(-1)
    except (TypeError, ValueError):
        return None
    if flat.size != source.actions.size or not np.isfinite(flat).all():
        return None
    spec = source.actions.spec()
    if "n" not in spec:
        return np.clip(flat, spec["low"], spec["high"])
    index = flat - source.actions.layout.start
    return index if index[0] in range(spec["n"]) else None


def _act(model: Predictor, lane: _Seen, source: Source, state: Any, deterministic: bool) -> Any:
    """Asks for the next action and puts it into the lane; returns the model's new state."""
    start = np.array([lane.steps == 0])
    action, state = model.predict(
        lane.seen, state=state, episode_start=start, deterministic=deterministic
    )
    executed = _executed(action, source)
    if executed is None:
        raise InputError(
            f"predict() of {type(model).__name__} returned {action!r}, but the action space of "
            f"{source.name} is {source.actions.space}; give a model of this environment"
        )
    lane.action[:] = executed
    return state


def record(
    model: Predictor, environment: EnvironmentLike, episodes: int, seed: int, deterministic: bool
) -> _core.Demonstrations:
    """Whole episodes; the i-th is reset with the seed seed + i."""
    if isinstance(environment, str) and environment in _core.environment_ids():
        environment = f"agail/{environment}"
    source = Source(environment)
    rows: dict[str, list[Any]] = {
        key: []
        for key in ("observations", "next_observations", "actions", "rewards", "terminations",
                    "truncations", "episodes")
    }  # fmt: skip
    try:
        lane = source.lane(_Seen)
        for episode in range(episodes):
            observation, state, ended = lane.reset(seed + episode), None, False
            while not ended:
                state = _act(model, lane, source, state, deterministic)
                following, reward, terminated, truncated = lane.step()
                ended = terminated or truncated
                values = (observation, following, lane.action.copy(), reward, terminated, truncated)
                for column, value in zip(rows.values(), (*values, episode)):
                    column.append(value)
                observation = following
    finally:
        source.close()
    arrays: dict[str, Any] = {key: np.array(column) for key, column in rows.items()}
    dtype = np.float32 if source.observations.float32 else np.float64
    arrays["observations"] = arrays["observations"].astype(dtype)
    if "n" in source.actions.spec():
        arrays["actions"] = arrays["actions"][:, 0].astype(np.int64)
    return core_of(arrays, source.name.removeprefix("agail/"), "the recorded episodes")
