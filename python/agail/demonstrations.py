"""Demonstrations: trajectories of observations, with actions of which some may be missing."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from agail import _core
from agail._core import InputError

if TYPE_CHECKING:
    import minari


@dataclass(frozen=True)
class Episode:
    """One trajectory of T steps."""

    observations: NDArray[np.float64]  # (T + 1, observation_dim)
    actions: NDArray[np.float64]  # (T, action_dim); missing: NaN, discrete ones 0
    available: NDArray[np.bool_]  # (T, action_dim): whether the entry is known
    rewards: NDArray[np.float64] | None  # (T,)
    terminations: NDArray[np.bool_]  # (T,)
    truncations: NDArray[np.bool_]  # (T,)

    def __len__(self) -> int:
        return len(self.actions)


class Demonstrations(Sequence[Episode]):
    """A sequence of episodes. Does not change; mask() gives another one. Picklable."""

    def __init__(self, core: _core.Demonstrations):
        self._core = core

    @classmethod
    def load(cls, path_or_id: str | os.PathLike[str]) -> Demonstrations:
        """A .hdf5 file, a Minari dataset folder, or the id of a dataset that Minari has here."""
        return cls(_core.Demonstrations.load(os.fspath(path_or_id)))

    def save(self, path: str | os.PathLike[str]) -> None:
        """x.hdf5: one file; any other name: a Minari dataset folder."""
        _core.Demonstrations.save(self._core, os.fspath(path))

    @classmethod
    def from_arrays(
        cls,
        observations: ArrayLike,
        actions: ArrayLike | None = None,
        *,
        episodes: ArrayLike | None = None,
        environment: str = "",
        next_observations: ArrayLike | None = None,
        rewards: ArrayLike | None = None,
        terminations: ArrayLike | None = None,
        truncations: ArrayLike | None = None,
        action_available: ArrayLike | None = None,
    ) -> Demonstrations:
        """From arrays with one row a step, episode after episode.

        observations (N, D); actions (N, A), or (N,) for one dimension, discrete if they are integers;
        a missing entry is NaN, or False in action_available (N,) or (N, A); None: all are missing.
        episodes (N,): a number that names each row's episode; without it episodes end where
        terminations or truncations (N,) say so. Without next_observations (N, D) the last row of an
        episode is its final state, and that row's action and reward are not used. environment: the
        Gymnasium id, which gives the action space.
        """
        table = np.asarray(observations)
        if table.ndim != 2:
            raise InputError(f"observations have the shape {table.shape}, not (steps, numbers)")
        rows = len(table)

        def column(name: str, value: ArrayLike | None) -> list[float]:
            if value is None:
                return []
            array = np.asarray(value, np.float64)
            if array.shape != (rows,):
                raise InputError(
                    f"{name} have the shape {array.shape}, the observations {rows} rows"
                )
            return array.tolist()

        act = np.empty((rows, 0)) if actions is None else np.asarray(actions)
        discrete = act.ndim == 1 and np.issubdtype(act.dtype, np.integer)
        act = act.astype(np.float64).reshape(len(act), -1) if act.ndim < 3 else act
        if act.shape[:1] != (rows,) or act.ndim != 2:
            raise InputError(f"actions have the shape {act.shape}, the observations {rows} rows")
        if action_available is not None:
            known = np.asarray(action_available, bool)
            known = known[:, None] if known.ndim == 1 else known
            if known.shape not in ((rows, 1), act.shape):
                raise InputError(f"action_available has the shape {known.shape}, not {act.shape}")
            act = np.where(known, act, np.nan)
        following = None
        if next_observations is not None:
            following = np.ascontiguousarray(next_observations, np.float64)
            if following.shape != table.shape:
                raise InputError(
                    f"next_observations have the shape {following.shape}, not {table.shape}"
                )
        return cls(
            _core.Demonstrations.from_table(
                np.ascontiguousarray(table, np.float64),
                np.ascontiguousarray(act),
                following,
                column("rewards", rewards),
                column("terminations", terminations),
                column("truncations", truncations),
                column("episodes", episodes),
                discrete,
                table.dtype == np.float32,
                environment,
            )
        )

    @classmethod
    def from_minari(cls, dataset: str | minari.MinariDataset) -> Demonstrations:
        """A Minari dataset, or the id of one that is on this machine (nothing is downloaded)."""
        if isinstance(dataset, str):
            return cls.load(dataset)
        path = Path(dataset.spec.data_path)
        if not (path / "main_data.hdf5").exists():
            raise InputError(
                f"{dataset.spec.dataset_id} is not stored as HDF5 but as "
                f"{dataset.spec.data_format}; make it again with data_format='hdf5'"
            )
        chosen = sorted(int(index) for index in dataset.episode_indices)
        whole = cls.load(path)
        if len(chosen) != len(whole):
            raise InputError(
                f"this dataset is a part ({len(chosen)} of {len(whole)} episodes) of "
                f"{dataset.spec.dataset_id}, which is read as a whole; give the whole dataset"
            )
        return whole

    def mask(
        self,
        missing: float,
        pattern: str = "step",
        *,
        seed: int = 0,
        dimension: int | None = None,
    ) -> Demonstrations:
        """The same with the share `missing` of the actions removed, as `agail mask` does it.

        pattern: "step" single steps, "block" runs of 20 steps, "episode" whole episodes, "dimension"
        whole action channels (`dimension` first, if it is given). With one seed a larger share's
        mask contains a smaller one's.
        """
        return Demonstrations(self._core.masked(missing, pattern, seed, dimension))

    @property
    def missing_ratio(self) -> float:
        """Missing action entries / all entries."""
        return self._core.missing_ratio

    @property
    def environment(self) -> str:
        """Gymnasium id, empty if unknown."""
        return self._core.environment

    @property
    def transitions(self) -> int:
        """Steps of all episodes."""
        return self._core.transitions

    @property
    def observation_dim(self) -> int:
        """Numbers of an observation."""
        return self._core.observation_dim

    @property
    def action_dim(self) -> int:
        """Numbers of an action; 1 if discrete."""
        return self._core.action_dim

    @property
    def mean_return(self) -> float | None:
        """Mean undiscounted return of the episodes; None if rewards are unknown."""
        return self._core.mean_return

    def __len__(self) -> int:
        return len(self._core)

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        position = index + len(self) if index < 0 else index
        if not 0 <= position < len(self):
            raise IndexError(f"episode {index} of {len(self)}")
        return Episode(**self._core.episode(position))

    def __iter__(self) -> Iterator[Episode]:
        return (self[i] for i in range(len(self)))

    def __repr__(self) -> str:
        name = f" of {self.environment}" if self.environment else ""
        return (
            f"<Demonstrations{name}: {len(self)} episodes, {self.transitions} transitions, "
            f"{100 * self.missing_ratio:.3g} % of the actions missing>"
        )

    def __getstate__(self) -> bytes:
        return self._core.encode()

    def __setstate__(self, state: bytes) -> None:
        self._core = _core.Demonstrations.decode(state)
