"""Tests of the installed Python package: the wheel must be installed where they run (./run-tests does it)."""

import pytest
from small import train

import agail


@pytest.fixture(scope="session")
def hopper_run(tmp_path_factory):
    return train("Hopper-v5", method="trpo", out=tmp_path_factory.mktemp("runs") / "hopper")


@pytest.fixture(scope="session")
def hopper_demos(hopper_run):
    return agail.record(hopper_run, 6)
