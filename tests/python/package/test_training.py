"""agail.train: the same runs as the command line, callbacks, interruptions, errors."""

import signal
import subprocess
import sys
import textwrap
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from small import SMALL, Line, train

import agail


def test_run(hopper_run):
    metrics = hopper_run.metrics
    assert metrics["time/total_timesteps"].tolist() == [256, 512, 768, 1024]
    assert np.isnan(metrics["eval/mean_reward"]).tolist() == [True, True, True, False]
    assert metrics["train/kl_divergence_loss"].dtype == np.float64
    assert hopper_run.finished and hopper_run.summary["environment"] == "Hopper-v5"
    assert hopper_run.settings["policy"]["hidden"] == [8, 8]
    assert hopper_run.policy.timesteps == 1024
    assert "trpo Hopper-v5, finished" in repr(hopper_run)


@pytest.mark.parametrize("method", ["agail", "gail", "state-gail", "bc"])
def test_methods(hopper_demos, method):
    run = train("Hopper-v5", hopper_demos.mask(0.5), method=method, timesteps=512)
    assert run.policy.method == method
    assert run.policy.demonstrations_mean_return == pytest.approx(hopper_demos.mean_return)
    assert agail.evaluate(run, 2).share_of_demonstrations is not None


def test_same_bytes_as_the_command_line(hopper_demos, tmp_path):
    hopper_demos.save(tmp_path / "demos.hdf5")
    run = train("Hopper-v5", tmp_path / "demos.hdf5", seed=3, out=tmp_path / "api")
    words = [f"{s}.{k}={v}" for s, values in SMALL.items() for k, v in values.items()]
    command = [sys.executable, "-m", "agail", "train", "Hopper-v5", "--method", "agail", "--seed",
               "3", "--demos", tmp_path / "demos.hdf5", "--out", tmp_path / "cli", "--timesteps",
               "1024", *[f"--set={word.replace(' ', '')}" for word in words]]  # fmt: skip
    subprocess.run(command, check=True, capture_output=True)
    name = "policy.safetensors"
    assert (run.folder / name).read_bytes() == (tmp_path / "cli" / name).read_bytes()


def test_settings():
    for settings in ({"trpo": {"max_kl": 0.02}}, {"trpo.max_kl": 0.02}):
        run = train("CartPole-v1", method="trpo", timesteps=256, **settings)
        assert run.settings["trpo"]["max_kl"] == 0.02
    with pytest.raises(agail.InputError, match=r"trpo\.max_kl"):
        train("CartPole-v1", method="trpo", trpo={"max_kll": 0.02})
    with pytest.raises(agail.InputError, match="above 0"):
        train("CartPole-v1", method="trpo", trpo={"max_kl": -1})


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ({"environment": "CartPol-v1"}, "did you mean 'CartPole-v1'"),
        ({"method": "tropo"}, "did you mean 'trpo'"),
        ({"method": "agail"}, "learns from demonstrations"),
        ({"timesteps": 0}, "timesteps"),
        ({"seed": -1}, "seed"),
        ({"threads": 0}, "threads"),
        ({"threads": "2"}, "threads = '2' should be a whole number"),
        ({"threads": 2.0}, "threads"),
        ({"seed": 2**64}, "seed"),
        ({"timesteps": True}, "timesteps = True"),
        ({"preset": Path("absent.toml")}, r"absent\.toml"),
        ({"resume": True}, "out"),
        ({"preset": "papr"}, "paper"),
        ({"environment": 3}, "no environment"),
    ],
    ids=str,
)
def test_wrong_arguments(arguments, told):
    with pytest.raises(ValueError, match=told):
        train(**{"environment": "CartPole-v1", "method": "trpo", **arguments})


def test_preset_may_be_a_path(hopper_run):
    preset = hopper_run.folder / "config.toml"
    run = agail.train("Hopper-v5", method="trpo", preset=preset, progress=False)
    assert run.settings == hopper_run.settings


def test_callback_sees_the_log():
    rows = []
    run = train("CartPole-v1", method="trpo", callback=rows.append)
    for name, column in run.metrics.items():
        np.testing.assert_allclose([row[name] for row in rows], column)


@pytest.mark.parametrize("answer", [bool, np.bool_, int])
def test_callback_stops_and_the_run_goes_on(tmp_path, answer):
    whole = train("CartPole-v1", method="trpo", out=tmp_path / "whole")
    out = tmp_path / "stopped"
    stopped = train(
        "CartPole-v1",
        method="trpo",
        out=out,
        callback=lambda row: answer(row["time/iterations"] < 2),
    )
    assert not stopped.finished and len(stopped.metrics["time/iterations"]) == 2
    resumed = train("CartPole-v1", method="trpo", out=out, resume=True)
    assert resumed.finished
    name = "policy.safetensors"
    assert (out / name).read_bytes() == (whole.folder / name).read_bytes()


def test_callback_that_fails(tmp_path):
    def fail(row):
        raise LookupError("mine")

    with pytest.raises(LookupError, match="mine") as caught:
        train("CartPole-v1", method="trpo", out=tmp_path / "run", callback=fail)
    assert caught.traceback[-1].name == "fail"
    assert len(agail.Run(tmp_path / "run").metrics["time/iterations"]) == 1
    assert train("CartPole-v1", method="trpo", out=tmp_path / "run", resume=True).finished


def test_other_threads_go_on():
    """C++ learns without the GIL."""
    counted = []

    def count():
        while not done.is_set():
            counted.append(time.perf_counter())
            time.sleep(0.002)

    done = threading.Event()
    thread = threading.Thread(target=count)
    thread.start()
    train("Hopper-v5", method="trpo", timesteps=4096, threads=1, run={"batch_steps": 2048})
    done.set()
    thread.join()
    assert len(counted) > 20 and np.diff(counted).max() < 1


def test_two_at_once():
    results = {}

    def work(seed):
        results[seed] = train("CartPole-v1", method="trpo", seed=seed, timesteps=2048).policy

    threads = [threading.Thread(target=work, args=(seed,)) for seed in (1, 2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    rows = np.random.default_rng(0).normal(size=(20, 4))
    for seed, policy in results.items():
        alone = train("CartPole-v1", method="trpo", seed=seed, timesteps=2048).policy
        np.testing.assert_array_equal(policy.predict(rows)[0], alone.predict(rows)[0])


SCRIPT = """
    import sys, agail
    try:
        agail.train("{env}", method="trpo", out=sys.argv[1], timesteps=10**8, threads=1,
                    callback=lambda row: print("update", flush=True), progress=False)
    except KeyboardInterrupt:
        print("interrupted", agail.Run(sys.argv[1]).policy.timesteps > 0, flush=True)
"""


@pytest.mark.parametrize("environment", ["CartPole-v1", "Acrobot-v1"])
def test_ctrl_c(tmp_path, environment):
    script = textwrap.dedent(SCRIPT).format(env=environment)
    process = subprocess.Popen([sys.executable, "-c", script, tmp_path / "run"],
                               stdout=subprocess.PIPE, text=True)  # fmt: skip
    assert process.stdout.readline() == "update\n"
    process.send_signal(signal.SIGINT)
    rest, _ = process.communicate(timeout=60)
    assert rest.splitlines()[-1] == "interrupted True" and process.returncode == 0
    assert not agail.Run(tmp_path / "run").finished


def test_terminated(tmp_path):
    script = textwrap.dedent(SCRIPT).format(env="CartPole-v1")
    process = subprocess.Popen([sys.executable, "-c", script, tmp_path / "run"],
                               stdout=subprocess.PIPE, text=True)  # fmt: skip
    assert process.stdout.readline() == "update\n"
    process.terminate()
    process.communicate(timeout=60)
    assert process.returncode == -signal.SIGTERM
    assert agail.Run(tmp_path / "run").policy.timesteps > 0


ENDLESS = """
    import sys
    sys.path.insert(0, {tests!r})
    import agail
    from small import Line, train

    class Told(Line):
        def step(self, action):
            if self.steps == 2:
                print("step", flush=True)
            observation, reward, *_, info = super().step(action)
            self.at = 0.0
            return observation, reward, False, {truncates}, info

    try:
        {work}
    except KeyboardInterrupt:
        print("interrupted", flush=True)
"""


def start_python(script):
    """With SIGINT as a terminal has it: a shell ignores it for what it runs in the background."""
    return subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(script)],
        stdout=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("function", ["evaluate", "record"])
def test_episodes_can_be_interrupted(tmp_path, function, number):
    """Those of C++ and those of Python, in the midst of an episode."""
    train("CartPole-v1", method="trpo", out=tmp_path / "built-in", timesteps=256)
    train(Line, method="trpo", out=tmp_path / "own", timesteps=256)
    for run, environment in (("built-in", None), ("own", "Told")):
        work = (
            f'print("step", flush=True); Told.__name__ = "Line"; '
            f"agail.{function}({str(tmp_path / run)!r}, 10**6, environment={environment}, threads=1)"
        )
        script = ENDLESS.format(tests=str(Path(__file__).parent), truncates=False, work=work)
        process = start_python(script)
        assert process.stdout.readline() == "step\n"
        if environment is None:
            time.sleep(0.5)  # the episodes have begun
        else:
            assert process.stdout.readline() == "step\n"
        process.send_signal(number)
        rest, _ = process.communicate(timeout=60)
        if number == signal.SIGINT:
            assert rest.splitlines()[-1] == "interrupted" and process.returncode == 0
        else:
            assert process.returncode == -signal.SIGTERM


def test_second_ctrl_c_ends_an_evaluation_that_never_ends():
    """The evaluation of an update is whole for the first one; the second one aborts all its episodes."""
    work = 'train(Told, method="trpo", timesteps=256, run={"evaluate_every": 1})'
    script = ENDLESS.format(tests=str(Path(__file__).parent), truncates=False, work=work)
    process = start_python(script)
    for _ in range(2):  # the episode of the batch, and that of the evaluation
        assert process.stdout.readline() == "step\n"
    process.send_signal(signal.SIGINT)
    with pytest.raises(subprocess.TimeoutExpired):
        process.wait(1)
    process.send_signal(signal.SIGINT)
    rest, _ = process.communicate(timeout=60)
    assert rest.splitlines()[-1] == "interrupted" and process.returncode == 0


def test_temporary_run_goes_with_the_object():
    run = train("CartPole-v1", method="trpo", timesteps=256)
    folder = run.folder
    assert folder.exists()
    del run
    assert not folder.exists()
    with pytest.raises(agail.InputError, match="no run"):
        agail.Run(folder)


def test_progress_goes_to_stderr(capfd):
    train("CartPole-v1", method="trpo", progress=True)
    told = capfd.readouterr()
    assert told.out == "" and "1024/1024 steps" in told.err
    train("CartPole-v1", method="trpo")
    assert capfd.readouterr().err == ""


def test_out_that_is_taken(hopper_run):
    before = sorted(hopper_run.folder.iterdir())
    with pytest.raises(agail.InputError, match="there is a run in this folder"):
        train("Hopper-v5", method="trpo", out=hopper_run.folder)
    assert sorted(hopper_run.folder.iterdir()) == before
