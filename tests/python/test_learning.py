"""That it learns, not only that it runs. The bars are far below what docs/results.md reports."""

from pathlib import Path

import pytest

DATA = Path(__file__).resolve().parents[2] / "data"


def train_and_evaluate(agail, tmp_path: Path, environment: str, method: str, *options) -> dict:
    run = tmp_path / f"{environment}-{method}-{len(list(tmp_path.iterdir()))}"
    command = ["train", environment, "--method", method, "--threads", 1, "--out", run, *options]
    agail(*command, timeout=3600)  # a million steps of Humanoid
    return agail.json("eval", run, "--episodes", 50)


@pytest.mark.parametrize("seed", [0, 1])
def test_trpo_balances_the_pole(agail, tmp_path, seed):
    result = train_and_evaluate(agail, tmp_path, "CartPole-v0", "trpo", "--seed", seed)
    assert result["mean_return"] >= 195


def test_agail_hops_from_a_quarter_of_the_actions(agail, tmp_path):
    options = ["--demos", DATA / "hopper-v5.hdf5", "--timesteps", 20_000]
    result = train_and_evaluate(agail, tmp_path, "Hopper-v5", "agail", *options)
    assert result["share_of_demonstrations"] >= 0.9


def without_actions(agail, tmp_path, demos):
    agail("mask", demos, "--missing", 1, "--out", tmp_path / "states.hdf5")
    return tmp_path / "states.hdf5"


def test_bco_balances_the_pole_without_a_demonstrated_action(agail, tmp_path):
    expert, demos = tmp_path / "expert", tmp_path / "whole.hdf5"
    agail("train", "CartPole-v0", "--method", "trpo", "--out", expert, "--timesteps", 30_000)
    agail("record", expert, "--episodes", 10, "--out", demos)
    demos = without_actions(agail, tmp_path, demos)
    options = ["--demos", demos, "--timesteps", 15_000]
    result = train_and_evaluate(agail, tmp_path, "CartPole-v0", "bco", *options)
    assert result["mean_return"] >= 150  # a random policy: 22


def test_bco_hops_without_a_demonstrated_action(agail, tmp_path):
    demos = without_actions(agail, tmp_path, DATA / "hopper-v5.hdf5")
    options = ["--demos", demos, "--timesteps", 40_000]
    result = train_and_evaluate(agail, tmp_path, "Hopper-v5", "bco", *options)
    assert result["share_of_demonstrations"] >= 0.25  # a random policy: 0.005


@pytest.mark.long
@pytest.mark.parametrize(
    ("environment", "bar"), [("Hopper-v5", 3200), ("Walker2d-v5", 3800), ("Humanoid-v4", 550)]
)
def test_trpo_reaches_the_bar(agail, tmp_path, environment, bar):
    results = [
        train_and_evaluate(agail, tmp_path, environment, "trpo", "--seed", seed)
        for seed in range(5)
    ]
    assert sum(result["mean_return"] for result in results) / 5 >= bar
