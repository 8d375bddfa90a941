"""Demonstrations that do not fit: refused before they are read, in one line."""

import resource
import time
import zlib

import h5py
import numpy as np
import pytest

GIGABYTE = 10**9
COLUMNS = 11


def fill(dataset, value=b"\0"):
    """All chunks with one byte repeated, compressed once: quick, whatever they unpack to."""
    chunk = zlib.compress(value * (dataset.chunks[0] * COLUMNS * 8))
    for row in range(0, len(dataset), dataset.chunks[0]):
        dataset.id.write_direct_chunk((row, 0), chunk)


@pytest.fixture
def large(tmp_path):
    """A sound file of a few MB with one episode of 50 million steps; observations of 4.4 GB."""
    path = tmp_path / "large.hdf5"
    with h5py.File(path, "w") as file:
        observations = file.create_group("episode_0").create_dataset(
            "observations", (50_000_000, COLUMNS), "f8", chunks=(100_000, COLUMNS), compression=9
        )
        fill(observations)
    assert path.stat().st_size < 0.02 * GIGABYTE
    return path


def limit_address_space():
    resource.setrlimit(resource.RLIMIT_AS, (3 * GIGABYTE, 3 * GIGABYTE))


@pytest.mark.parametrize("command", ["inspect", "train"])
def test_a_file_larger_than_memory_is_refused(agail, large, tmp_path, command):
    arguments = {
        "inspect": ["inspect", large],
        "train": [
            "train", "Hopper-v5", "--method", "state-gail", "--demos", large, "--out", tmp_path / "run",
        ],
    }[command]  # fmt: skip
    start = time.monotonic()
    done = agail.run(*arguments, preexec_fn=limit_address_space)
    assert done.returncode == 2, done.stderr
    assert done.stdout == ""
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"agail: {large} needs about 4.4 GB of memory, and ")
    assert "fewer episodes" in line
    assert time.monotonic() - start < 60, "it was read before it was refused"
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("written", [0, 1])
def test_a_file_that_claims_more_than_it_holds_is_refused(agail, tmp_path, written):
    """10^12 rows in a few KiB: HDF5 stores no chunk that nobody wrote."""
    path = tmp_path / "empty.hdf5"
    with h5py.File(path, "w") as file:
        observations = file.create_group("episode_0").create_dataset(
            "observations", (10**12, COLUMNS), "f8", chunks=(1000, COLUMNS), compression=9
        )
        if written:
            observations[:1000] = np.zeros((1000, COLUMNS))
    assert path.stat().st_size < 100_000
    assert "claims more values than the file can hold" in agail.refused("inspect", path)
