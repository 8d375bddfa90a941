"""Our files and the field's own readers and writers: safetensors, TensorBoard."""

import os
import pathlib
import subprocess

import numpy as np
import pytest
from safetensors import safe_open
from safetensors.numpy import load_file, save_file
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ.get("AGAIL_BUILD_DIR", ROOT / "build" / "release"))


def probe(*arguments):
    return subprocess.run(
        [BUILD / "tests" / "files_probe", *map(str, arguments)], capture_output=True, text=True
    )


def metadata(path):
    with safe_open(path, "numpy") as file:
        return file.metadata()


def test_safetensors_package_reads_ours(tmp_path):
    path = tmp_path / "ours.safetensors"
    assert probe("write-safetensors", path).returncode == 0
    arrays = load_file(path)
    np.testing.assert_array_equal(
        arrays["weights"], np.array([[0.5, -1, 3.25], [1e-30, 7, 8]], np.float32)
    )
    assert arrays["weights"].dtype == np.float32
    np.testing.assert_array_equal(arrays["steps"], np.array([-1, 2**40]))
    np.testing.assert_array_equal(arrays["scale"], np.array([0.1]))
    np.testing.assert_array_equal(arrays["flags"], np.array([1, 0, 1], np.uint8))
    assert metadata(path)["environment"] == "Hopper-v4"
    assert metadata(path)["checksum"].startswith("crc32c:")


def test_we_read_the_safetensors_package(tmp_path):
    random = np.random.default_rng(0)
    arrays = {
        "b": random.normal(size=(3, 4)).astype(np.float32),
        "a": random.normal(size=(2,)),
        "count": np.array([7], np.int64),
        "bytes": np.arange(5, dtype=np.uint8),
        "none": np.zeros((0, 3), np.float32),
    }
    theirs, ours = tmp_path / "theirs.safetensors", tmp_path / "ours.safetensors"
    save_file(arrays, theirs, metadata={"who": "package"})
    assert probe("copy-safetensors", theirs, ours).returncode == 0
    copies = load_file(ours)
    assert copies.keys() == arrays.keys()
    for name, array in arrays.items():
        np.testing.assert_array_equal(copies[name], array)
        assert copies[name].dtype == array.dtype and copies[name].shape == array.shape
    assert metadata(ours)["who"] == "package"


def test_checksum_survives_a_copy_through_the_package_and_notices_changes(tmp_path):
    ours, copy = tmp_path / "ours.safetensors", tmp_path / "copy.safetensors"
    probe("write-safetensors", ours)
    arrays = load_file(ours)
    save_file(arrays, copy, metadata=metadata(ours))
    assert probe("copy-safetensors", copy, tmp_path / "again.safetensors").returncode == 0
    assert (tmp_path / "again.safetensors").read_bytes() == ours.read_bytes()
    arrays["weights"][0, 0] += 1
    save_file(arrays, copy, metadata=metadata(ours))
    result = probe("copy-safetensors", copy, tmp_path / "again.safetensors")
    assert result.returncode == 2
    assert "checksum does not match" in result.stderr and result.stderr.count("\n") == 1


def test_unknown_types_are_refused(tmp_path):
    path = tmp_path / "half.safetensors"
    save_file({"x": np.zeros(2, np.float16)}, path)
    result = probe("copy-safetensors", path, tmp_path / "out.safetensors")
    assert result.returncode == 2 and "convert it to F32" in result.stderr


def test_tensorboard_reads_our_events(tmp_path):
    assert probe("write-events", tmp_path).returncode == 0
    assert len(list(tmp_path.glob("events.out.tfevents.*"))) == 2
    events = EventAccumulator(str(tmp_path))
    events.Reload()
    assert sorted(events.Tags()["scalars"]) == ["rollout/ep_rew_mean", "train/kl"]
    points = events.Scalars("rollout/ep_rew_mean")
    # Steps 6 to 10 of the first file were purged by the resume from step 5.
    assert [p.step for p in points] == [1, 2, 3, 4, 5, 6, 7, 8]
    assert [p.value for p in points] == [1, 2, 3, 4, 5, 106, 107, 108]
    assert points[0].wall_time > 1.6e9
    kl = [p.value for p in events.Scalars("train/kl")]
    assert kl == pytest.approx([0.01 * step for step in range(1, 9)])
