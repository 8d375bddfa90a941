"""A run and its folder: what is in it, and that no interruption, thread or lane count changes its bits."""

import csv
import json
import os
import random
import signal
import time
import tomllib

import h5py
import numpy as np
import pytest
from program import SMALL
from safetensors import safe_open
from safetensors.numpy import load_file
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

TASKS = {  # environment, demonstrations, options
    "trpo": ("CartPole-v1", None, ["--method", "trpo"]),
    "agail": ("CartPole-v1", "cartpole-part.hdf5", ["--method", "agail"]),
    "agail-paper": ("Hopper-v5", "hopper-part.hdf5", ["--method", "agail", "--preset", "paper"]),
    "gail-cloned": (
        "Hopper-v5",
        "hopper-part.hdf5",
        ["--method", "gail", "--set=start.method=clone", "--set=clone.weight=0.1"],
    ),
    "bco": (
        "Hopper-v5",
        "hopper-part.hdf5",
        ["--method", "bco", "--set=bco.every=2", "--set=bco.epochs=2", "--set=bco.buffer=700"],
    ),
}

# Only for some tests: without updates, and with a start that explores (no demonstration tells the foot's torque).
OTHER_TASKS = {
    "bc": ("CartPole-v1", "cartpole-part.hdf5", ["--method", "bc"]),
    "agail-exploring": ("Hopper-v5", "hopper-no-foot.hdf5", ["--method", "agail"]),
}


def train(small, task, out, timesteps, *more):
    """The arguments of `agail` for one of TASKS or OTHER_TASKS."""
    environment, demos, options = {**TASKS, **OTHER_TASKS}[task]
    given = ["--demos", small / demos] if demos else []
    return [
        "train", environment, "--out", out, "--timesteps", timesteps,
        *given, *options, *SMALL, *more,
    ]  # fmt: skip


def progress(run):
    with (run / "progress.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def learned(run):
    """progress.csv without what depends on the clock."""
    clocked = {"time/time_elapsed", "time/fps", "time/physics", "time/learning"}
    return [{k: v for k, v in row.items() if k not in clocked} for row in progress(run)]


def evaluations(run):
    summary = json.loads((run / "summary.json").read_text())
    return {key: value for key, value in summary.items() if key.endswith("_evaluation")}


def assert_same_result(run, reference):
    for policy in reference.glob("*.safetensors"):
        if policy.name == "policy_best.safetensors":
            # It keeps the settings of its own time; a resumed run may have been made longer since.
            ours, theirs = load_file(run / policy.name), load_file(policy)
            assert ours.keys() == theirs.keys()
            assert all((ours[name] == theirs[name]).all() for name in ours), policy.name
        else:
            assert (run / policy.name).read_bytes() == policy.read_bytes(), policy.name
    checkpoint = "checkpoints/latest.safetensors"
    assert (run / checkpoint).read_bytes() == (reference / checkpoint).read_bytes()
    assert learned(run) == learned(reference)
    assert evaluations(run) == evaluations(reference)
    for name in ("config.toml", "episodes.csv"):
        assert (run / name).read_bytes() == (reference / name).read_bytes(), name


@pytest.fixture(scope="module")
def imitation(agail, small, tmp_path_factory):
    run = tmp_path_factory.mktemp("runs") / "imitation"
    agail(*train(small, "agail", run, 4096))
    return run


# --- The folder ---------------------------------------------------------------------------------


def test_contents(imitation, small):
    names = {path.name for path in imitation.iterdir()}
    (events,) = {name for name in names if name.startswith("events.out.tfevents.")}
    assert names - {events} == {
        "config.toml", "progress.csv", "episodes.csv", "checkpoints", "policy.safetensors",
        "summary.json",
    }  # fmt: skip
    assert (small / "cartpole-expert" / "policy_best.safetensors").exists()
    summary = json.loads((imitation / "summary.json").read_text())
    assert summary["finished"] and summary["timesteps"] == 4096 and summary["seed"] == 0
    assert {"version", "mujoco", "cpu", "threads", "ranks", "start_seconds", "wall_seconds"} <= set(
        summary
    )
    assert summary["demonstrations"]["missing_ratio"] == pytest.approx(0.5, abs=0.01)


def test_config_is_every_resolved_value(agail, imitation, small, tmp_path):
    config = tomllib.loads((imitation / "config.toml").read_text())
    assert config["run"]["batch_steps"] == 256 and config["run"]["timesteps"] == 4096
    assert config["policy"]["hidden"] == [8, 8] and "gamma" in config["trpo"]
    # It is a preset, and gives the same run.
    agail(
        "train", "CartPole-v1", "--method", "agail", "--demos", small / "cartpole-part.hdf5",
        "--out", tmp_path / "run", "--preset", imitation / "config.toml",
    )  # fmt: skip
    assert_same_result(tmp_path / "run", imitation)


def test_progress(imitation):
    rows = progress(imitation)
    assert [int(row["time/total_timesteps"]) for row in rows] == list(range(256, 4097, 256))
    assert [int(row["time/iterations"]) for row in rows] == list(range(1, 17))
    evaluated = [int(row["time/iterations"]) for row in rows if row["eval/mean_reward"]]
    assert evaluated == [4, 8, 12, 16]
    assert {"rollout/ep_rew_mean", "rollout/ep_len_mean", "time/fps", "discriminator/loss"} <= set(
        rows[0]
    )


def events_of(run):
    events = EventAccumulator(str(run), size_guidance={"scalars": 0})
    events.Reload()
    return {tag: events.Scalars(tag) for tag in events.Tags()["scalars"]}


def assert_tensorboard_agrees(run):
    rows, events = progress(run), events_of(run)
    for name in rows[0]:
        known = [row for row in rows if row[name]]
        if not known:
            continue
        steps = [int(row["time/total_timesteps"]) for row in known]
        assert [event.step for event in events[name]] == steps, name
        values = np.array([event.value for event in events[name]])
        np.testing.assert_array_equal(values, np.array([row[name] for row in known], np.float32))


def test_tensorboard_agrees_with_progress(imitation):
    assert_tensorboard_agrees(imitation)


def test_tensorboard_reads_a_run_under_way(agail, small, tmp_path):
    """One reader, as a browser that was opened early."""
    run = tmp_path / "run"
    process = agail.start(*train(small, "agail", run, 10**8))
    try:
        wait_for_rows(process, run, 3)
        reader = EventAccumulator(str(run), size_guidance={"scalars": 0})
        for rows in (3, 8, 13):
            wait_for_rows(process, run, rows + 1)  # the one before is written in full
            reader.Reload()
            assert process.poll() is None
            events = reader.Scalars("rollout/ep_rew_mean")
            assert len(events) >= rows
            assert [event.step for event in events] == [256 * (i + 1) for i in range(len(events))]
            known = [float(row["rollout/ep_rew_mean"]) for row in progress(run)[:rows]]
            np.testing.assert_array_equal(
                [event.value for event in events[:rows]], np.float32(known)
            )
    finally:
        process.terminate()
        process.wait(60)
    assert_tensorboard_agrees(run)


def test_policies_do_not_know_where_they_were_trained(imitation):
    with safe_open(imitation / "policy.safetensors", "numpy") as file:
        metadata = file.metadata()
    assert metadata["environment"] == "CartPole-v1" and metadata["method"] == "agail"
    assert "checksum" in metadata and "discriminator" in metadata["settings"]
    assert not {"threads", "ranks", "time", "path", "host"} & set(metadata)
    assert str(imitation.parent) not in json.dumps(metadata)


@pytest.mark.parametrize("name", ["cartpole", "hopper"])
def test_policy_tensors_give_the_recorded_actions(small, name):
    tensors = load_file(small / f"{name}-expert" / "policy_best.safetensors")
    with safe_open(small / f"{name}-expert" / "policy_best.safetensors", "numpy") as file:
        structure = json.loads(file.metadata()["structure"])
    layers = len(structure["hidden"]) + 1
    assert structure["activation"] == "tanh"
    with h5py.File(small / f"{name}.hdf5") as file:
        observations = np.concatenate([file[f"episode_{i}/observations"][:-1] for i in range(6)])
        actions = np.concatenate([file[f"episode_{i}/actions"][:] for i in range(6)])
    x = observations.astype(np.float32).astype(np.float64)
    if structure["normalize_observations"]:
        x = (x - tensors["observation.mean"]) / tensors["observation.std"]
        x = np.clip(x, -structure["observation_clip"], structure["observation_clip"])
    for layer in range(layers):
        x = x @ tensors[f"policy.{layer}.weight"].T.astype(float) + tensors[f"policy.{layer}.bias"]
        if layer + 1 < layers:
            x = np.tanh(x)
    if structure["discrete"]:
        clear = np.abs(x[:, 0] - x[:, 1]) > 1e-5
        assert clear.mean() > 0.99
        np.testing.assert_array_equal(x.argmax(1)[clear], actions.reshape(-1)[clear])
    else:
        mean = np.clip(x, structure["action_low"], structure["action_high"])
        np.testing.assert_allclose(mean, actions, rtol=0, atol=2e-5)


# --- Exactness ----------------------------------------------------------------------------------


@pytest.mark.parametrize("task", TASKS)
def test_threads_do_not_change_the_bits(agail, small, tmp_path, task):
    runs = {}
    for lanes in (1, 2):
        for threads in (1, 2, 3):
            run = runs[lanes, threads] = tmp_path / f"{lanes}-{threads}"
            agail(*train(small, task, run, 2048, "--threads", threads, "--lanes", lanes))
        assert_same_result(runs[lanes, 2], runs[lanes, 1])
        assert_same_result(runs[lanes, 3], runs[lanes, 1])
    policy = "policy.safetensors"
    assert (runs[1, 1] / policy).read_bytes() != (runs[2, 1] / policy).read_bytes()


def test_seeds_do_change_them(agail, small, tmp_path):
    for seed in (0, 1):
        agail(*train(small, "trpo", tmp_path / str(seed), 512, "--seed", seed))
    policies = [(tmp_path / str(seed) / "policy.safetensors").read_bytes() for seed in (0, 1)]
    assert policies[0] != policies[1]


# --- Interruption -------------------------------------------------------------------------------


def wait_for_rows(process, run, rows):
    deadline = time.monotonic() + 60
    while not (run / "progress.csv").exists() or len(progress(run)) < rows:
        assert process.poll() is None, "it ended too soon"
        assert time.monotonic() < deadline, "it makes no progress"
        time.sleep(0.005)


@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=lambda n: n.name)
def test_interrupted_and_resumed(agail, small, tmp_path, task, number):
    run, reference = tmp_path / "run", tmp_path / "reference"
    process = agail.start(*train(small, task, run, 10**8))
    wait_for_rows(process, run, 5)
    process.send_signal(number)
    assert process.wait(60) == 128 + number
    summary = json.loads((run / "summary.json").read_text())
    assert not summary["finished"]
    assert summary["timesteps"] == int(progress(run)[-1]["time/total_timesteps"])
    assert (run / "checkpoints" / "latest.safetensors").exists()
    assert agail.json("eval", run, "--episodes", 1)["episodes"] == 1

    end = summary["timesteps"] + 5 * 256
    agail(*train(small, task, run, end, "--resume", "--threads", 2))
    agail(*train(small, task, reference, end, "--threads", 1))
    assert_same_result(run, reference)
    assert_tensorboard_agrees(run)


def kill_and_resume(agail, small, tmp_path, task, kills, timesteps, seed):
    reference, run = tmp_path / "reference", tmp_path / "run"
    agail(*train(small, task, reference, timesteps))
    moments = random.Random(seed)
    stride = timesteps // 256 // (kills + 1)
    for kill in range(kills):
        process = agail.start(*train(small, task, run, timesteps, "--resume"))
        if kill % 4 != 3:
            before = len(progress(run)) if (run / "progress.csv").exists() else 0
            wait_for_rows(process, run, before + moments.randint(1, stride))
        time.sleep(moments.uniform(0, 0.02))
        process.kill()
        assert process.wait() == -signal.SIGKILL, "it ended before it was killed"
    agail(*train(small, task, run, timesteps, "--resume"))
    assert_same_result(run, reference)
    assert_tensorboard_agrees(run)
    assert not list(run.rglob("*.tmp")), "what a kill left behind is cleared away"


@pytest.mark.parametrize("task", ["trpo", "agail"])
def test_killed_and_resumed(agail, small, tmp_path, task):
    kill_and_resume(agail, small, tmp_path, task, kills=2, timesteps=20_000, seed=0)


@pytest.mark.long
@pytest.mark.parametrize("task", TASKS)
def test_killed_many_times(agail, small, tmp_path, task):
    seed = int.from_bytes(os.urandom(4))
    print("seed", seed)
    kill_and_resume(agail, small, tmp_path, task, kills=20, timesteps=100_000, seed=seed)


def test_cut_off_before_the_first_checkpoint(agail, small, tmp_path):
    """What a kill at the very start leaves is no obstacle, with or without --resume."""
    reference = tmp_path / "reference"
    agail(*train(small, "trpo", reference, 512))
    for more in ([], ["--resume"]):
        run = tmp_path / f"run{len(more)}"
        (run / "checkpoints").mkdir(parents=True)
        agail(*train(small, "trpo", run, 512, *more))
        assert_same_result(run, reference)


@pytest.mark.parametrize("task", ["trpo", "gail-cloned", "bc"])
def test_resume_of_a_finished_run_changes_nothing(agail, small, tmp_path, task):
    run = tmp_path / "run"
    told = agail(*train(small, task, run, 1024))
    policy, rows, before = (run / "policy.safetensors").read_bytes(), learned(run), evaluations(run)
    assert "last_evaluation" in before and ("best_evaluation" in before) == (task == "trpo")
    assert agail(*train(small, task, run, 1024, "--resume")) == told
    assert (run / "policy.safetensors").read_bytes() == policy and learned(run) == rows
    assert evaluations(run) == before
    assert "seed" in agail.refused(*train(small, task, run, 1024, "--resume", "--seed", 1))


@pytest.mark.parametrize("task", [*TASKS, "agail-exploring"])
def test_killed_before_the_first_regular_checkpoint(agail, small, tmp_path, task):
    """It goes on from its start, with the same bits, and only as what it was started as."""
    run, reference = tmp_path / "run", tmp_path / "reference"
    process = agail.start(*train(small, task, run, 10**8, "--set=run.checkpoint_every=1000000"))
    wait_for_rows(process, run, 1)
    process.kill()
    process.wait()

    def whole_files():
        files = (path for path in run.rglob("*") if path.is_file() and path.suffix != ".tmp")
        return {path: path.read_bytes() for path in files}

    before = whole_files()
    assert "seed" in agail.refused(*train(small, task, run, 1024, "--resume", "--seed", 1))
    assert whole_files() == before
    agail(*train(small, task, run, 1024, "--resume", "--threads", 2))
    agail(*train(small, task, reference, 1024))
    assert_same_result(run, reference)
    assert_tensorboard_agrees(run)


def test_two_processes_in_one_folder(agail, small, tmp_path):
    run = tmp_path / "run"
    process = agail.start(*train(small, "trpo", run, 10**8))
    try:
        wait_for_rows(process, run, 3)
        for more in ([], ["--resume"], ["--resume", "--seed", 1]):
            told = agail.refused(*train(small, "trpo", run, 1024, *more))
            assert "another agail is training in this folder" in told
    finally:
        process.terminate()
        assert process.wait(60) == 128 + signal.SIGTERM
    end = int(progress(run)[-1]["time/total_timesteps"]) + 256
    agail(*train(small, "trpo", run, end, "--resume"))
    assert_tensorboard_agrees(run)


def test_resume_takes_its_settings_from_the_run(agail, small, tmp_path):
    run, reference = tmp_path / "run", tmp_path / "reference"
    agail(*train(small, "trpo", run, 1024))
    agail(*train(small, "trpo", reference, 2048))
    # No --set this time: config.toml knows them.
    agail("train", "CartPole-v1", "--method", "trpo", "--out", run, "--timesteps", 2048, "--resume")
    # The evaluation at 1024 steps, the end of the first part, is none of the longer run's.
    assert (run / "policy.safetensors").read_bytes() == (
        reference / "policy.safetensors"
    ).read_bytes()


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (["--seed", 1], "seed"),
        (["--set=trpo.gamma=0.9"], "settings"),
        (["--method", "gail"], "method"),
        (["--demos", "cartpole.hdf5"], "demonstrations"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_resume_with_another_task_is_refused(agail, small, tmp_path, change, told):
    run = tmp_path / "run"
    agail(*train(small, "agail", run, 1024))
    before = {path: path.read_bytes() for path in run.rglob("*") if path.is_file()}
    arguments = [str(a) for a in train(small, "agail", run, 2048, "--resume")]
    for name, value in zip(change[::2], change[1::2] or [None], strict=True):
        if name in ("--method", "--demos"):
            at = arguments.index(name) + 1
            arguments[at] = str(small / value) if name == "--demos" else value
        else:
            arguments += [name, str(value)] if value is not None else [name]
    assert told in agail.refused(*arguments)
    assert {path: path.read_bytes() for path in run.rglob("*") if path.is_file()} == before
