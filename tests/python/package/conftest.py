"""Tests of the installed Python package: the wheel must be installed where they run (./run-tests does it)."""

import subprocess
import sys

import pytest
from small import train

import agail


@pytest.fixture(scope="session")
def hopper_run(tmp_path_factory):
    return train("Hopper-v5", method="trpo", out=tmp_path_factory.mktemp("runs") / "hopper")


@pytest.fixture(scope="session")
def hopper_demos(hopper_run):
    return agail.record(hopper_run, 6)


@pytest.fixture(scope="session")
def program():
    """Runs the package's `agail` with these words; returns what it prints."""

    def run(*words):
        command = [sys.executable, "-m", "agail", *map(str, words)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=300)
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run
