"""LeRobot's datasets of vectors: Parquet files with one row a frame, below a folder's data/; needs pyarrow.

Read are v2's data/chunk-000/episode_000000.parquet and v3's data/chunk-000/file-000.parquet; written is v3.0.
Images and videos are left alone.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from agail._core import InputError
from agail.formats import Arrays, needed, numbers, rows
from agail.formats.lerobot_folder import write_folder

STATE, NEXT_STATE, ACTION = "observation.state", "next.observation.state", "action"
# How an episode ended is not LeRobot's: its next.done stands at the end of each. Ours to keep.
TERMINATED = "next.terminated"
COLUMNS = (STATE, NEXT_STATE, ACTION, "episode_index", "frame_index", "next.reward", TERMINATED)


def _files(path: Path) -> list[Path]:
    if path.is_file():
        return [path]
    found = sorted((path / "data").glob("**/*.parquet"))
    if not found:
        raise InputError(
            f"{path} has no data/**/*.parquet; give a LeRobot dataset's folder, or one Parquet file"
        )
    return found


def _table(path: Path) -> Any:
    """All files' frames, only the columns that are used."""
    arrow = needed("pyarrow", "reading Parquet files")
    parquet = needed("pyarrow.parquet", "reading Parquet files")
    tables = []
    for file in _files(path):
        try:
            table = parquet.ParquetFile(file).read()
        except (OSError, arrow.ArrowException) as error:
            first = str(error).splitlines()[0]
            raise InputError(f"{file} cannot be read as Parquet: {first}") from error
        for name in (STATE, "episode_index"):
            if name not in table.column_names:
                shown = ", ".join(table.column_names[:8])
                raise InputError(f"{file} has no column {name} but {shown}; LeRobot's files do")
        tables.append(table.select([name for name in COLUMNS if name in table.column_names]))
    try:
        return arrow.concat_tables(tables)
    except arrow.ArrowException as error:
        first = str(error).splitlines()[0]
        raise InputError(f"{path}: its files' columns differ: {first}") from error


def _values(where: str, name: str, column: Any) -> np.ndarray:
    """A column of numbers (N,), or of equally long lists of them (N, D); a null is NaN."""
    arrow = needed("pyarrow", "reading Parquet files")
    array = arrow.concat_arrays(column.chunks)
    kind = array.type
    if not (
        arrow.types.is_list(kind)
        or arrow.types.is_large_list(kind)
        or arrow.types.is_fixed_size_list(kind)
    ):
        return numbers(where, name, array.to_numpy(zero_copy_only=False), (1,))
    valid = array.is_valid().to_numpy(zero_copy_only=False)
    flat = numbers(where, name, array.flatten().to_numpy(zero_copy_only=False), (1,))
    lengths = needed("pyarrow.compute", "reading Parquet files").list_value_length(array)
    widths = np.unique(lengths.drop_null().to_numpy(zero_copy_only=False))
    if len(widths) > 1:
        raise InputError(f"{where}: {name} has {widths[0]} to {widths[-1]} numbers in a frame")
    values = flat.reshape(int(valid.sum()), widths[0] if len(widths) else 0)
    if valid.all():
        return values
    whole = np.full((len(valid), values.shape[1]), np.nan, np.result_type(values, np.float32))
    whole[valid] = values
    return whole


def _check_frames(where: Path, episodes: np.ndarray, frames: np.ndarray) -> None:
    new = np.concatenate([[True], episodes[1:] != episodes[:-1]])
    expected = np.where(new, frames, np.concatenate([[0], frames[:-1] + 1]))
    wrong = np.flatnonzero(frames != expected)
    if len(wrong):
        row = int(wrong[0])
        raise InputError(
            f"{where}: episode {int(episodes[row])} has frame {int(frames[row])} after frame "
            f"{int(frames[row - 1])}; the frames of an episode must have no gaps and no doubles"
        )


def read(path: str | os.PathLike[str]) -> Arrays:
    path = Path(path)
    if not path.exists():
        raise InputError(f"{path} does not exist; give a LeRobot dataset's folder")
    table, where = _table(path), str(path)
    if table.num_rows == 0:
        raise InputError(f"{path} has no frames")
    count = table.num_rows
    names = table.column_names
    if ACTION in names and table[ACTION].null_count == count:  # nothing tells how many they are
        names.remove(ACTION)
    found = {name: _values(where, name, table[name]) for name in names}
    episodes = rows(where, "episode_index", found["episode_index"], count)
    frames = rows(where, "frame_index", found.get("frame_index", np.arange(count)), count)
    order = np.lexsort((frames, episodes))
    episodes, frames = episodes[order], frames[order]
    if "frame_index" in found:
        _check_frames(path, episodes, frames)

    def column(name: str) -> np.ndarray:
        return found[name][order]

    def matrix(name: str) -> np.ndarray:
        values = column(name)
        return values[:, None] if values.ndim == 1 else values

    arrays: Arrays = {"observations": matrix(STATE), "episodes": episodes}
    if ACTION in found:
        actions = column(ACTION)
        if table.schema.field(ACTION).type in _integers() and actions.dtype.kind == "f":
            # Discrete ones of which some are null.
            arrays["action_available"] = ~np.isnan(actions)
            actions = np.nan_to_num(actions).astype(np.int64)
        arrays["actions"] = actions
    if NEXT_STATE in found:
        arrays["next_observations"] = matrix(NEXT_STATE)
    if "next.reward" in found:
        arrays["rewards"] = rows(where, "next.reward", column("next.reward"), count)
    if TERMINATED in found:
        arrays["terminations"] = rows(where, TERMINATED, column(TERMINATED), count)
    return arrays


def _integers() -> tuple[Any, ...]:
    arrow = needed("pyarrow", "reading Parquet files")
    return (arrow.int64(), arrow.int32(), arrow.int16(), arrow.int8(), arrow.uint8())


def write(arrays: Arrays, path: str | os.PathLike[str], task: str, fps: int) -> None:
    arrow = needed("pyarrow", "writing Parquet files")
    if isinstance(fps, bool) or not isinstance(fps, int) or fps < 1:
        raise InputError(f"fps = {fps!r} should be a whole number of at least 1")
    if "actions" not in arrays:
        raise InputError("these demonstrations have no actions; LeRobot's datasets need a column")
    episodes = np.asarray(arrays["episodes"])
    lengths = np.bincount(episodes)
    frames = np.concatenate([np.arange(length) for length in lengths])
    count = len(episodes)
    columns: dict[str, np.ndarray] = {
        STATE: arrays["observations"],
        ACTION: arrays["actions"],
        NEXT_STATE: arrays["next_observations"],
        "next.done": np.asarray(arrays["terminations"]) | np.asarray(arrays["truncations"]),
        TERMINATED: np.asarray(arrays["terminations"]),
    }
    if "rewards" in arrays:
        columns["next.reward"] = np.asarray(arrays["rewards"], np.float32)
    columns |= {
        "timestamp": (frames / fps).astype(np.float32),
        "frame_index": frames,
        "episode_index": episodes,
        "index": np.arange(count),
        "task_index": np.zeros(count, np.int64),
    }
    missing = {}
    if "action_available" in arrays:
        missing[ACTION] = ~np.asarray(arrays["action_available"])
    write_folder(arrow, Path(path), columns, missing, lengths, task, fps)
