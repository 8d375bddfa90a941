"""The folder of a LeRobot dataset, v3.0: data/, meta/info.json, stats.json, tasks.parquet and episodes/."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np

from agail._core import InputError
from agail.formats import needed

FILE = "chunk-000/file-000.parquet"


def _flat(values: np.ndarray) -> np.ndarray:
    """LeRobot keeps vectors of one number as numbers."""
    return values[:, 0] if values.ndim == 2 and values.shape[1] == 1 else values


def _arrow(arrow: Any, values: np.ndarray, missing: np.ndarray | None) -> Any:
    values = _flat(values)
    if values.ndim == 1:
        return arrow.array(values, mask=missing)
    flat = arrow.array(np.ascontiguousarray(values).reshape(-1))
    return arrow.FixedSizeListArray.from_arrays(flat, values.shape[1])


def _statistics(values: np.ndarray) -> dict[str, list[float]]:
    """Of what is known: a missing entry is NaN."""
    table = values.reshape(len(values), -1).astype(np.float64)
    known = np.isfinite(table)
    count = np.maximum(known.sum(axis=0), 1)
    mean = np.where(known, table, 0).sum(axis=0) / count
    std = np.sqrt(np.where(known, (table - mean) ** 2, 0).sum(axis=0) / count)
    low = np.where(known, table, np.inf).min(axis=0)
    high = np.where(known, table, -np.inf).max(axis=0)
    any_known = known.any(axis=0)
    low, high = np.where(any_known, low, 0), np.where(any_known, high, 0)
    found = {"min": low, "max": high, "mean": mean, "std": std}
    return {name: value.tolist() for name, value in found.items()} | {"count": [len(values)]}


def _tasks(arrow: Any, task: str) -> Any:
    """As pandas writes a table whose index is the task's text, which is how LeRobot reads it."""
    table = arrow.table({"task_index": arrow.array([0]), "task": arrow.array([task])})
    kinds = {"task_index": ("int64", "int64"), "task": ("unicode", "object")}
    columns = [
        {"name": name, "field_name": name, "pandas_type": kind, "numpy_type": numpy, "metadata": None}
        for name, (kind, numpy) in kinds.items()
    ]  # fmt: skip
    about = {"index_columns": ["task"], "column_indexes": [], "columns": columns}
    return table.replace_schema_metadata({"pandas": json.dumps(about)})


def _episodes(arrow: Any, lengths: np.ndarray, task: str) -> Any:
    ends, zeros = np.cumsum(lengths), np.zeros(len(lengths), np.int64)
    return arrow.table(
        {
            "episode_index": np.arange(len(lengths)),
            "tasks": [[task]] * len(lengths),
            "length": lengths,
            "data/chunk_index": zeros,
            "data/file_index": zeros,
            "dataset_from_index": ends - lengths,
            "dataset_to_index": ends,
            "meta/episodes/chunk_index": zeros,
            "meta/episodes/file_index": zeros,
        }
    )


def write_folder(
    arrow: Any,
    path: Path,
    columns: dict[str, np.ndarray],
    missing: dict[str, np.ndarray],
    lengths: np.ndarray,
    task: str,
    fps: int,
) -> None:
    """columns: (N,) or (N, D) each, one row a frame; missing: where a column has none; whole or not at all."""
    parquet = needed("pyarrow.parquet", "writing Parquet files")
    if path.exists():
        raise InputError(f"{path} exists already; give another name, or remove it")
    features = {
        name: {
            "dtype": str(values.dtype),
            "shape": [values.shape[1] if values.ndim == 2 else 1],
            "names": None,
        }
        for name, values in columns.items()
    }
    info = {
        "codebase_version": "v3.0",
        "robot_type": None,
        "total_episodes": len(lengths),
        "total_frames": int(lengths.sum()),
        "total_tasks": 1,
        "chunks_size": 1000,
        "data_files_size_in_mb": 100,
        "video_files_size_in_mb": 500,
        "fps": fps,
        "splits": {"train": f"0:{len(lengths)}"},
        "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
        "video_path": None,
        "features": features,
    }
    stats = {
        name: _statistics(np.where(missing[name], np.nan, values) if name in missing else values)
        for name, values in columns.items()
    }
    partial = path.with_name(f"{path.name}.partial")
    data = {name: _arrow(arrow, values, missing.get(name)) for name, values in columns.items()}
    try:
        shutil.rmtree(partial, ignore_errors=True)
        for folder in ("data/chunk-000", "meta/episodes/chunk-000"):
            (partial / folder).mkdir(parents=True)
        parquet.write_table(arrow.table(data), partial / "data" / FILE)
        parquet.write_table(_episodes(arrow, lengths, task), partial / "meta/episodes" / FILE)
        parquet.write_table(_tasks(arrow, task), partial / "meta/tasks.parquet")
        (partial / "meta/info.json").write_text(json.dumps(info, indent=4))
        (partial / "meta/stats.json").write_text(json.dumps(stats, indent=4))
        partial.rename(path)
    except OSError as error:
        shutil.rmtree(partial, ignore_errors=True)
        raise InputError(f"{path} cannot be written: {error}") from error
