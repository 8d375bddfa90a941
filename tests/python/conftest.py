"""The program, and a folder of small files that many tests start from."""

import pytest
from program import SMALL, Agail


@pytest.fixture(scope="session")
def agail():
    if not Agail.program.exists():
        pytest.fail(f"{Agail.program} is not built; AGAIL_BUILD_DIR names the build folder")
    return Agail()


@pytest.fixture(scope="session")
def small(agail, tmp_path_factory):
    """A folder with an expert's small run, its demonstrations, and those with actions missing."""
    folder = tmp_path_factory.mktemp("small")
    for name, environment in {"cartpole": "CartPole-v1", "hopper": "Hopper-v5"}.items():
        expert, whole = folder / f"{name}-expert", folder / f"{name}.hdf5"
        agail(
            "train", environment, "--method", "trpo", "--out", expert, "--timesteps", 2000, *SMALL
        )
        agail("record", expert, "--episodes", 6, "--out", whole)
        agail("mask", whole, "--missing", 0.5, "--out", folder / f"{name}-part.hdf5")
    agail(
        "mask", folder / "hopper.hdf5", "--missing", 0.33, "--pattern", "dimension",
        "--dimension", 2, "--out", folder / "hopper-no-foot.hdf5",
    )  # fmt: skip
    return folder
