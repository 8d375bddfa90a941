"""Ranks on several hosts, which are network namespaces of this machine: the same bits, and what becomes of a cut cable."""

import subprocess
import time

import pytest
from hosts import Hosts, missing
from test_ranks import WIDE, has_mpi
from test_runs import assert_same_result, progress, train, wait_for_rows


@pytest.fixture
def hosts():
    if not has_mpi():
        pytest.skip("built without MPI")
    if reason := missing():
        pytest.skip(reason)
    with Hosts(3) as found:
        yield found


def test_same_bits_on_several_hosts(agail, hosts, small, tmp_path):
    reference, out = tmp_path / "reference", tmp_path / "run"
    agail(*train(small, "agail", reference, 4096, *WIDE))
    command = [*hosts.mpirun(4), str(agail.program), *train(small, "agail", out, 4096, *WIDE)]
    done = subprocess.run(
        list(map(str, command)), env=hosts.environment, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    assert_same_result(out, reference)


def test_a_host_cut_off_ends_the_job(agail, hosts, small, tmp_path):
    out, reference = tmp_path / "run", tmp_path / "reference"
    command = [*hosts.mpirun(3), str(agail.program), *train(small, "trpo", out, 10**8, *WIDE)]
    process = subprocess.Popen(
        list(map(str, command)),
        env=hosts.environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    wait_for_rows(process, out, 3)
    hosts.cut(1)
    begin = time.monotonic()
    _, told = process.communicate(timeout=60)
    assert time.monotonic() - begin < 30
    assert process.returncode != 0
    assert hosts.names[1] in told, told
    end = int(progress(out)[-1]["time/total_timesteps"]) + 2 * 1024
    agail(*train(small, "trpo", out, end, *WIDE, "--resume"))
    agail(*train(small, "trpo", reference, end, *WIDE))
    assert_same_result(out, reference)
