"""Several ranks (mpirun -n R agail train): the same bits as one, and no failure that hangs."""

import json
import os
import random
import re
import shutil
import signal
import subprocess
import time

import pytest
from program import BUILD, SMALL
from test_runs import assert_same_result, progress, train, wait_for_rows

MPIRUN = shutil.which("mpirun")


def has_mpi():
    cache = BUILD / "CMakeCache.txt"
    return cache.exists() and re.search(r"^AGAIL_MPI:\w+=(ON|TRUE|1)$", cache.read_text(), re.M)


pytestmark = pytest.mark.skipif(not (MPIRUN and has_mpi()), reason="built without MPI")

# Batches of 16 chunks, so that up to 4 ranks share their sums.
WIDE = ["--set=run.batch_steps=1024", "--set=run.lanes=4"]
ENVIRONMENT = {
    **os.environ,
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_btl": "self,vader,tcp",
    "OMPI_MCA_btl_tcp_if_include": "lo",
    "OMPI_MCA_oob_tcp_if_include": "lo",
}


def command(ranks, agail, arguments):
    return [
        MPIRUN, "--oversubscribe", "--bind-to", "none", "-n", str(ranks),
        str(agail.program), *map(str, arguments),
    ]  # fmt: skip


def run(ranks, agail, *arguments):
    done = subprocess.run(
        command(ranks, agail, arguments),
        capture_output=True,
        text=True,
        timeout=300,
        env=ENVIRONMENT,
    )
    return done


def start(ranks, agail, *arguments):
    return subprocess.Popen(
        command(ranks, agail, arguments),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        env=ENVIRONMENT,
    )


def rank_processes(process):
    """Process ids of the ranks that this mpirun started, by rank."""
    found = {}
    children = subprocess.run(
        ["ps", "-o", "pid=", "--ppid", str(process.pid)], capture_output=True, text=True
    ).stdout.split()
    for pid in children:
        try:
            with open(f"/proc/{pid}/environ") as file:  # noqa: PTH123
                variables = dict(v.split("=", 1) for v in file.read().split("\0") if "=" in v)
        except (FileNotFoundError, PermissionError):
            continue
        if "OMPI_COMM_WORLD_RANK" in variables:
            found[int(variables["OMPI_COMM_WORLD_RANK"])] = int(pid)
    return found


@pytest.mark.parametrize("task", ["trpo", "agail"])
def test_same_bits_for_any_number_of_ranks_and_threads(agail, small, tmp_path, task):
    reference = tmp_path / "reference"
    agail(*train(small, task, reference, 8192, *WIDE))
    for ranks in (1, 2, 3, 4):
        for threads in (1, 2):
            out = tmp_path / f"{ranks}-{threads}"
            done = run(ranks, agail, *train(small, task, out, 8192, *WIDE, "--threads", threads))
            assert done.returncode == 0, done.stderr
            assert done.stdout.count("mean return") == 1, "rank 0 alone tells"
            assert_same_result(out, reference)
            summary = json.loads((out / "summary.json").read_text())
            assert summary["ranks"] == ranks and summary["threads"] == threads
            if ranks > 1:
                assert summary["traffic"]["messages"] > 0


def test_resumed_with_other_numbers_of_ranks(agail, small, tmp_path):
    reference, out = tmp_path / "reference", tmp_path / "run"
    agail(*train(small, "agail", reference, 12 * 1024, *WIDE))
    for ranks, updates in ((2, 3), (3, 6), (1, 9), (4, 12)):
        done = run(ranks, agail, *train(small, "agail", out, updates * 1024, *WIDE, "--resume"))
        assert done.returncode == 0, done.stderr
    policy = "policy.safetensors"
    assert (out / policy).read_bytes() == (reference / policy).read_bytes()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT], ids=lambda n: n.name)
def test_signal_to_one_rank_stops_all_after_the_same_update(agail, small, tmp_path, number):
    out, reference = tmp_path / "run", tmp_path / "reference"
    process = start(3, agail, *train(small, "trpo", out, 10**8, *WIDE))
    wait_for_rows(process, out, 3)
    os.kill(rank_processes(process)[2], number)
    _, told = process.communicate(timeout=60)
    assert process.returncode == 128 + number, told
    assert told.count("go on with --resume") == 1
    summary = json.loads((out / "summary.json").read_text())
    end = summary["timesteps"] + 2 * 1024
    assert not summary["finished"]
    agail(*train(small, "trpo", out, end, *WIDE, "--resume"))
    agail(*train(small, "trpo", reference, end, *WIDE))
    assert_same_result(out, reference)


def test_a_killed_rank_ends_the_job(agail, small, tmp_path):
    out, reference = tmp_path / "run", tmp_path / "reference"
    process = start(3, agail, *train(small, "trpo", out, 10**8, *WIDE))
    wait_for_rows(process, out, 5)
    os.kill(rank_processes(process)[1], signal.SIGKILL)
    _, told = process.communicate(timeout=30)
    assert process.returncode != 0
    assert "process rank 1" in told and "signal 9" in told, told
    end = int(progress(out)[-1]["time/total_timesteps"]) + 2 * 1024
    done = run(2, agail, *train(small, "trpo", out, end, *WIDE, "--resume"))
    assert done.returncode == 0, done.stderr
    agail(*train(small, "trpo", reference, end, *WIDE))
    assert_same_result(out, reference)


@pytest.mark.long
@pytest.mark.parametrize("victim", [0, 2])
def test_a_stopped_rank_ends_the_job(agail, small, tmp_path, victim):
    out, reference = tmp_path / "run", tmp_path / "reference"
    process = start(3, agail, *train(small, "trpo", out, 10**8, *WIDE))
    wait_for_rows(process, out, 5)
    os.kill(rank_processes(process)[victim], signal.SIGSTOP)
    begin = time.monotonic()
    _, told = process.communicate(timeout=60)
    assert time.monotonic() - begin < 30
    assert process.returncode != 0
    told_of = [line for line in told.splitlines() if "has not been heard of" in line]
    assert len(told_of) == 1 and f"rank {victim} on " in told_of[0], told
    end = int(progress(out)[-1]["time/total_timesteps"]) + 2 * 1024
    agail(*train(small, "trpo", out, end, *WIDE, "--resume"))
    agail(*train(small, "trpo", reference, end, *WIDE))
    assert_same_result(out, reference)


@pytest.mark.long
def test_ranks_killed_many_times(agail, small, tmp_path):
    seed = int.from_bytes(os.urandom(4))
    print("seed", seed)
    moments = random.Random(seed)
    out, reference = tmp_path / "run", tmp_path / "reference"
    timesteps = 150 * 1024
    agail(*train(small, "agail", reference, timesteps, *WIDE))
    for _ in range(20):
        ranks = moments.randint(1, 4)
        process = start(ranks, agail, *train(small, "agail", out, timesteps, *WIDE, "--resume"))
        time.sleep(moments.uniform(0.3, 2))
        victims = rank_processes(process)
        if victims:
            os.kill(moments.choice(list(victims.values())), signal.SIGKILL)
        else:
            process.kill()
        process.communicate(timeout=30)
    done = run(2, agail, *train(small, "agail", out, timesteps, *WIDE, "--resume"))
    assert done.returncode == 0, done.stderr
    assert_same_result(out, reference)
    assert not list(out.rglob("*.tmp"))


def ours(told):
    return [line for line in told.splitlines() if line.startswith("agail: ")]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--lanes", "2"], "run.lanes = 2 is less than the 3 ranks"),
        (["--set=trpo.gama=1"], "trpo.gama"),
        (["--demos", "nowhere.hdf5"], "nowhere.hdf5"),
        (["--sedd", "1"], "--sedd"),
    ],
    ids=["lanes", "setting", "demonstrations", "argument"],
)
def test_bad_input_is_told_once(agail, tmp_path, arguments, message):
    out = tmp_path / "run"
    done = run(
        3,
        agail,
        "train",
        "CartPole-v1",
        "--method",
        "agail",
        "--out",
        out,
        *SMALL,
        *WIDE,
        *arguments,
    )
    assert done.returncode == 2, done.stderr
    lines = ours(done.stderr)
    assert len(lines) == 1 and message in lines[0], done.stderr
    assert not out.exists()


def test_other_commands_refuse_several_ranks(agail):
    done = run(2, agail, "eval", "run")
    assert done.returncode == 2
    assert len(ours(done.stderr)) == 1 and "one process" in done.stderr


def test_bench_counts_the_traffic(agail):
    arguments = [
        "CartPole-v1",
        "--method",
        "trpo",
        "--updates",
        3,
        "--json",
        *WIDE,
    ]
    alone = json.loads(agail("bench", *arguments))
    done = run(2, agail, "bench", *arguments)
    assert done.returncode == 0, done.stderr
    (ours_,), (theirs,) = json.loads(done.stdout), alone
    assert ours_["signature"] == theirs["signature"]
    assert ours_["ranks"] == 2 and ours_["traffic_an_update"]["bytes"] > 0
