"""agail reproduce: the grid, its records and its statistics, on a few short runs of CartPole."""

import csv
import json
import os
import shutil
import signal
import subprocess
import time

import numpy as np
import pytest
from program import BUILD
from rliable import library, metrics

GRID = [
    "reproduce", "table1", "--envs", "CartPole-v0", "--methods", "trpo", "agail", "--missing", 0.75,
    "--seeds", 0, 1, 2, "--timesteps", 3000,
]  # fmt: skip


def results(out):
    """Everything that is promised to be equal, by its name."""
    files = [*(out / "records").rglob("*.json"), *out.glob("table.*"), out / "experiment.json"]
    files += (out / "experts" / "records").glob("*.json")
    return {str(file.relative_to(out)): file.read_bytes() for file in files}


def assert_same(out, reference):
    ours, theirs = results(out), results(reference)
    assert ours.keys() == theirs.keys()
    for name in theirs:
        assert ours[name] == theirs[name], name


def assert_part_of(out, reference):
    ours, theirs = results(out), results(reference)
    assert ours
    for name in ours:
        assert ours[name] == theirs[name], name


@pytest.fixture(scope="module")
def grid(agail, tmp_path_factory):
    out = tmp_path_factory.mktemp("reproduce") / "grid"
    shown = agail(*GRID, "--out", out, "--jobs", 1)
    assert "6 runs" in shown
    return out


def records(out):
    return [json.loads(file.read_text()) for file in sorted((out / "records").glob("*.json"))]


def rows(out):
    with (out / "table.csv").open() as file:
        return list(csv.DictReader(file))


# --- Records and tables -------------------------------------------------------------------------


def test_records(grid):
    names = {file.name for file in (grid / "records").glob("*.json")}
    assert names == {
        *(f"CartPole-v0-trpo-{seed}.json" for seed in range(3)),
        *(f"CartPole-v0-agail-75-{seed}.json" for seed in range(3)),
    }
    for record in records(grid):
        assert record["budget"] == 3000 and record["timesteps"] >= 3000
        assert record["settings"]["policy.hidden"] == "[64, 64]"
        assert len(record["training"]["curve"]) == 65
        assert len(record["signature"]) == 8
        assert record["final_evaluation"]["episodes"] == 50
        if record["method"] == "agail":
            assert record["missing"] == 0.75
            assert record["demonstrations"]["missing_ratio"] == pytest.approx(0.75, abs=0.01)
            assert record["demonstrations"]["episodes"] == 10
            assert record["evaluations"][0][0] == 0, "a cloned start is evaluated before training"
    for file in (grid / "records").rglob("*.json"):
        assert file.stat().st_size < 20_000
        assert str(grid) not in file.read_text()


def test_the_expert_is_the_one_with_the_best_worst_episode(grid):
    chosen = json.loads((grid / "records/demonstrations/CartPole-v0.json").read_text())
    candidates = [
        json.loads(file.read_text()) for file in (grid / "experts/records").glob("*.json")
    ]
    assert sorted(c["seed"] for c in candidates) == [10, 11, 12]
    best = max(candidates, key=lambda c: c["final_evaluation"]["worst_return"])
    assert chosen["final_evaluation"]["worst_return"] == best["final_evaluation"]["worst_return"]


def test_table(grid):
    table = rows(grid)
    assert list(table[0]) == [
        "environment", "method", "missing", "paper_mean", "paper_standard_error", "mean",
        "standard_error", "deterministic_mean", "iqm", "iqm_low", "iqm_high", "worst_seed",
        "share_of_expert", "steps_to_95",
    ]  # fmt: skip
    assert [(row["method"], row["missing"]) for row in table] == [("trpo", ""), ("agail", "0.75")]
    assert [float(row["paper_mean"]) for row in table] == [196.4, 197.9]
    expert = json.loads((grid / "records/demonstrations/CartPole-v0.json").read_text())
    expert_return = expert["final_evaluation"]["mean_return"]
    for row in table:
        own = [r for r in records(grid) if r["method"] == row["method"]]
        returns = [r["final_evaluation"]["mean_return"] for r in own]
        assert float(row["deterministic_mean"]) == pytest.approx(np.mean(returns), abs=1e-4)
        assert float(row["worst_seed"]) == pytest.approx(min(returns), abs=1e-4)
        assert float(row["share_of_expert"]) == pytest.approx(
            np.mean(returns) / expert_return, abs=1e-4
        )
        reached = sorted(
            next((x for x, y in r["evaluations"] if y >= 0.95 * expert_return), np.inf) for r in own
        )
        assert row["steps_to_95"] == ("" if reached[1] == np.inf else str(reached[1]))
    assert "agail, 75 % missing | 3 |" in (grid / "table.md").read_text()


def symmetric_ema(x, y, low, high, points):
    """As OpenAI Baselines' plot_util has it, written from the recipe for these tests."""

    def one_sided(x, y, grid, spacing):
        weights = np.exp(-np.maximum(grid[:, None] - x[None, :], 0) / spacing)
        weights *= x[None, :] <= grid[:, None]
        return weights @ y, weights.sum(1)

    grid = np.linspace(low, high, points)
    spacing = (high - low) / (points - 1)
    forward, backward = one_sided(x, y, grid, spacing), one_sided(-x, y, -grid, spacing)
    return (forward[0] + backward[0]) / (forward[1] + backward[1])


def smoothed_episodes(run, budget):
    table = np.loadtxt(run / "episodes.csv", delimiter=",", skiprows=1)
    x, y = np.cumsum(table[:, 1]), table[:, 2]
    smooth = np.array([y[max(0, i - 10) : i + 11].mean() for i in range(len(y))])
    return x[x <= budget], smooth[x <= budget]


@pytest.mark.parametrize("method", ["trpo", "agail-75"])
def test_the_papers_statistic(grid, method):
    seeds = [
        smoothed_episodes(grid / "runs" / f"CartPole-v0-{method}-{seed}", 3000) for seed in range(3)
    ]
    low, high = max(x[0] for x, _ in seeds), min(x[-1] for x, _ in seeds)
    last = [symmetric_ema(x, y, low, high, 512)[-1] for x, y in seeds]
    (row,) = [row for row in rows(grid) if method.startswith(row["method"])]
    assert float(row["mean"]) == pytest.approx(np.mean(last), abs=1e-4)
    assert float(row["standard_error"]) == pytest.approx(np.std(last) / np.sqrt(3), abs=1e-4)


def test_the_curve_of_a_record(grid):
    x, y = smoothed_episodes(grid / "runs" / "CartPole-v0-trpo-0", 3000)
    expected = symmetric_ema(x, y, 0, 3000, 512)[[*range(0, 511, 8), 511]]
    record = json.loads((grid / "records" / "CartPole-v0-trpo-0.json").read_text())
    np.testing.assert_allclose(record["training"]["curve"], expected, atol=1e-3)


def with_returns(grid, out, returns):
    """A folder of records like the grid's, whose final evaluations have these means (a row a seed)."""
    (out / "records" / "demonstrations").mkdir(parents=True)
    template = json.loads((grid / "records" / "CartPole-v0-agail-75-0.json").read_text())
    expert = json.loads((grid / "records" / "demonstrations" / "CartPole-v0.json").read_text())
    for column, environment in enumerate(["CartPole-v0", "Hopper-v4"]):
        expert["environment"] = template["environment"] = environment
        expert["final_evaluation"]["mean_return"] = 100.0
        path = out / "records" / "demonstrations" / f"{environment}.json"
        path.write_text(json.dumps(expert))
        for seed, row in enumerate(returns):
            template["seed"] = seed
            template["final_evaluation"]["mean_return"] = row[column]
            path = out / "records" / f"{environment}-{seed}.json"
            path.write_text(json.dumps(template))


def test_intervals_are_rliables(agail, grid, tmp_path):
    returns = np.random.default_rng(3).gamma(3, 20, size=(6, 2)).round(3)
    with_returns(grid, tmp_path, returns.tolist())
    agail("reproduce", "table1", "--out", tmp_path, "--only-tables")

    def expected(scores):
        # What rliable draws from, whatever random_state it is given. Six runs have so few different
        # resamples that an interval's end could jump from one to the next with the draw.
        np.random.seed(0)
        point, interval = library.get_interval_estimates(
            {"agail": scores},
            lambda s: np.array([metrics.aggregate_iqm(s)]),
            reps=10_000,
        )
        return point["agail"][0], interval["agail"][:, 0]

    for row, column in zip(rows(tmp_path), returns.T, strict=True):
        iqm, interval = expected(column[:, None])
        assert float(row["iqm"]) == pytest.approx(iqm, abs=1e-4)
        # Both intervals come from random resamples: equal but for a few percent of their width.
        found = [float(row["iqm_low"]), float(row["iqm_high"])]
        np.testing.assert_allclose(found, interval, atol=0.03 * np.ptp(interval))

    # Both environments together, each resampled by itself.
    iqm, interval = expected(returns / 100)
    section = (tmp_path / "table.md").read_text().split("## All environments")[1]
    (line,) = [line for line in section.splitlines() if line.startswith("| agail")]
    words = line.replace("(", " ").replace(")", " ").split()
    found = [float(words[i - 1]) for i, word in enumerate(words) if word == "%"][1:]
    assert found[0] == pytest.approx(100 * iqm, abs=0.06)
    np.testing.assert_allclose(found[1:], 100 * interval, atol=0.03 * np.ptp(100 * interval) + 0.1)


def test_only_tables(agail, grid, tmp_path):
    (tmp_path / "records").symlink_to(grid / "records")
    agail("reproduce", "table1", "--out", tmp_path, "--only-tables")
    for name in ("table.md", "table.csv"):
        assert (tmp_path / name).read_bytes() == (grid / name).read_bytes()


# --- The same bytes, however it is run ----------------------------------------------------------


def test_two_jobs(agail, grid, tmp_path):
    agail(*GRID, "--out", tmp_path, "--jobs", 2)
    assert_same(tmp_path, grid)


def test_two_shards_into_one_folder(agail, grid, tmp_path):
    shards = [
        agail.start(*GRID, "--out", tmp_path, "--jobs", 1, "--shard", f"{i}/2") for i in (1, 2)
    ]
    assert [shard.wait(120) for shard in shards] == [0, 0]
    agail(*GRID, "--out", tmp_path)  # nothing is missing
    assert_same(tmp_path, grid)


def test_shared_experts(agail, grid, tmp_path):
    experts = grid / "experts"
    before = {file: file.stat().st_mtime_ns for file in experts.rglob("*.json")}
    agail(*GRID, "--out", tmp_path, "--experts", experts)
    assert {file: file.stat().st_mtime_ns for file in experts.rglob("*.json")} == before
    assert not (tmp_path / "experts").exists()
    assert_part_of(tmp_path, grid)


def published(grid, out, without):
    """What a repository keeps of a grid: what it is and its records, here all but one."""
    shutil.copytree(grid / "records", out / "records")
    shutil.copy(grid / "experiment.json", out)
    (out / "records" / without).unlink(missing_ok=True)


@pytest.mark.parametrize("lost", ["none", "CartPole-v0-trpo-1.json"])
def test_experts_are_trained_for_who_needs_them_only(agail, grid, tmp_path, lost):
    published(grid, tmp_path, lost)
    agail(*GRID, "--out", tmp_path)
    assert not list((tmp_path / "experts/runs").iterdir())
    assert [run.name for run in (tmp_path / "runs").iterdir()] == [lost[:-5]] * (lost != "none")
    assert_part_of(tmp_path, grid)


@pytest.mark.parametrize("lost", ["CartPole-v0-agail-75-2.json", "demonstrations/CartPole-v0.json"])
def test_a_record_of_demonstrations_is_not_the_demonstrations(agail, grid, tmp_path, lost):
    published(grid, tmp_path, lost)
    agail(*GRID, "--out", tmp_path)
    assert_same(tmp_path, grid)
    assert (tmp_path / "demonstrations/CartPole-v0/missing-75.hdf5").exists()


def test_demonstrations_outlive_their_experts(agail, grid, tmp_path):
    published(grid, tmp_path, "CartPole-v0-agail-75-2.json")
    shutil.copytree(grid / "demonstrations", tmp_path / "demonstrations")
    agail(*GRID, "--out", tmp_path)
    assert not list((tmp_path / "experts/runs").iterdir())
    assert (tmp_path / "table.csv").read_bytes() == (grid / "table.csv").read_bytes()


def wait_for(condition, process):
    deadline = time.monotonic() + 60
    while not condition():
        assert process.poll() is None, "it ended too soon"
        assert time.monotonic() < deadline
        time.sleep(0.002)


@pytest.mark.parametrize(
    ("number", "code"),
    [(signal.SIGKILL, -signal.SIGKILL), (signal.SIGINT, 130)],
    ids=lambda value: getattr(value, "name", ""),
)
def test_stopped_and_started_again(agail, grid, tmp_path, number, code):
    for moment in ("experts/runs/*/progress.csv", "runs/*agail*/progress.csv"):
        process = agail.start(*GRID, "--out", tmp_path, "--jobs", 2)
        wait_for(lambda moment=moment: list(tmp_path.glob(moment)), process)
        process.send_signal(number)
        assert process.wait(60) == code
    assert len(list((tmp_path / "records").glob("*.json"))) < 6
    agail(*GRID, "--out", tmp_path)
    assert_same(tmp_path, grid)


def test_nothing_is_left_running_after_a_stop(agail, tmp_path):
    long = [*GRID[:-1], 10**8]
    process = agail.start(*long, "--out", tmp_path, "--jobs", 2)
    wait_for(lambda: len(list(tmp_path.glob("experts/runs/*/progress.csv"))) == 2, process)
    process.send_signal(signal.SIGINT)
    assert process.wait(60) == 130
    summaries = list(tmp_path.glob("experts/runs/*/summary.json"))
    assert len(summaries) == 2, "each run saved where it was"
    assert not any(json.loads(s.read_text())["finished"] for s in summaries)
    # Nobody holds a lock any more.
    for lock in tmp_path.glob("experts/locks/*"):
        subprocess.run(["flock", "--nonblock", lock, "true"], check=True)


def test_ranks_are_shards(agail, grid, tmp_path):
    launched = dict(os.environ, OMPI_COMM_WORLD_SIZE="2")
    command = [str(BUILD / "agail"), *map(str, GRID), "--out", str(tmp_path), "--jobs", "1"]
    ranks = [
        subprocess.Popen(command, env={**launched, "OMPI_COMM_WORLD_RANK": str(rank)})
        for rank in (0, 1)
    ]
    assert [rank.wait(120) for rank in ranks] == [0, 0]
    agail(*GRID, "--out", tmp_path, "--only-tables")
    assert_same(tmp_path, grid)


# --- Failures and wrong input -------------------------------------------------------------------


def test_a_run_that_fails_does_not_stop_the_others(agail, grid, tmp_path):
    (tmp_path / "runs").mkdir(parents=True)
    (tmp_path / "runs" / "CartPole-v0-trpo-1").write_text("in the way")
    done = agail.run(*GRID, "--out", tmp_path)
    assert done.returncode == 1
    (line,) = [line for line in done.stderr.splitlines() if "seed 1" in line]
    assert "CartPole-v0 trpo seed 1" in line and "logs/CartPole-v0-trpo-1.log" in line
    assert done.stderr.splitlines()[-1].startswith("agail: 1 of ")
    assert len(list((tmp_path / "records").glob("*.json"))) == 5
    assert "| trpo | 2 |" in (tmp_path / "table.md").read_text()
    (tmp_path / "runs" / "CartPole-v0-trpo-1").unlink()
    agail(*GRID, "--out", tmp_path)
    assert_same(tmp_path, grid)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["table2"], "'table1'"),
        (["table1", "--envs", "Hoper-v4"], "'Hopper-v4'"),
        (["table1", "--methods", "galil"], "'gail'"),
        (["table1", "--missing", "0.3"], "0.25"),
        (["table1", "--preset", "papr"], "paper"),
        (["table1", "--set", "trpo.gama=1"], "trpo.gamma"),
        (["table1", "--set", "run.evaluate_every=3"], "run.evaluate_every"),
        (["table1", "--set", "run.lanes=7"], "run.lanes"),
        (["table1", "--set", "discriminator.features=[4]", *GRID[2:7]], "from 0 to 3"),
        (["table1", "--seeds", "-1"], "--seeds"),
        (["table1", "--seeds", "010"], "--seeds"),
        (["table1", "--jobs", "0"], "--jobs"),
        (["table1", "--timesteps", "0"], "--timesteps"),
        (["table1", "--shard", "3/2"], "--shard 3/2"),
        (["table1", "--shard", "0/2"], "--shard 0/2"),
        (["table1", "--shard", "1"], "--shard 1"),
        (["table1", "--only-tables"], "records"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_wrong_input(agail, tmp_path, arguments, told):
    out = tmp_path / "out"
    assert told in agail.refused("reproduce", *arguments, "--out", out)
    assert not out.exists()


def test_settings_that_only_other_methods_have(agail, grid, tmp_path):
    """No discriminator is in a trpo run, so its features may be another environment's."""
    agail(
        *GRID[:5], "trpo", "--seeds", 0, "--timesteps", 1000, "--out", tmp_path,
        "--set", "discriminator.features=[300]",
    )  # fmt: skip


def test_out_without_a_name(agail):
    assert "--out" in agail.refused("reproduce", "table1", "--out", "")
    assert "File name too long" in agail.refused("reproduce", "table1", "--out", "x" * 300)
    told = agail.refused("reproduce", "table1", "--only-tables", "--out", "x" * 300)
    assert "File name too long" in told


def test_another_experiment_in_the_same_folder(agail, grid):
    assert "experiment.json" in agail.refused(*GRID[:-1], 4000, "--out", grid)
    assert "experiment.json" in agail.refused(*GRID, "--preset", "paper", "--out", grid)
    agail.refused(*GRID, "--out", grid / "table.md")
