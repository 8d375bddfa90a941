#!/usr/bin/env python3
"""What one action costs: agail.Policy.predict against onnxruntime with the same policy, exported.

One observation a call, from Python. In each of --rounds rounds both take --calls turns with the same observations (of an
episode of the policy), one call of each after the other; a round counts the medians. onnxruntime may use one thread or its
default, the quicker one counts, and is given the float32 batch of one that it wants. --act PROGRAM also runs the program of
examples/act, which is C++ alone. Needs the Python package with onnx and onnxruntime.
"""

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

import numpy as np
import onnxruntime

import agail
from agail.export import to_onnx


def make_policy(environment: str, folder: Path) -> agail.Policy:
    """As large as any of this environment; how well it acts does not matter here."""
    return agail.train(environment, method="trpo", timesteps=1024, out=folder / environment,
                       progress=False, run={"evaluation_episodes": 1}).policy  # fmt: skip


def session_of(policy: agail.Policy, threads: int) -> onnxruntime.InferenceSession:
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads  # 0: its default
    return onnxruntime.InferenceSession(
        to_onnx(policy).SerializeToString(), options, providers=["CPUExecutionProvider"]
    )


def one_round(policy, sessions, observations, calls: int) -> tuple[float, list[float]]:
    """Median microseconds of a call: ours, and of each session."""
    rows = [np.ascontiguousarray(row) for row in observations]
    batches = [row[None].astype(np.float32) for row in rows]
    times = np.empty((calls, 1 + len(sessions)))
    clock = time.perf_counter_ns
    for i in range(calls):
        row, batch = rows[i % len(rows)], batches[i % len(rows)]
        begin = clock()
        policy.predict(row)
        times[i, 0] = clock() - begin
        for j, session in enumerate(sessions):
            begin = clock()
            session.run(["action"], {"observation": batch})
            times[i, 1 + j] = clock() - begin
    ours, *theirs = np.median(times, 0) / 1000
    return ours, theirs


def in_cpp(program: str, run: Path, observations: np.ndarray) -> float:
    text = "\n".join(" ".join(map(repr, row.tolist())) for row in observations)
    done = subprocess.run([program, run], input=text, capture_output=True, text=True, check=True)
    return float(done.stderr.split()[-4])


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "environments", nargs="*", default=["CartPole-v1", "Hopper-v5", "Humanoid-v5"]
    )
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--calls", type=int, default=2000)
    parser.add_argument("--act", metavar="PROGRAM", help="examples/act, built")
    options = parser.parse_args()
    print(f"agail {agail.__version__}, onnxruntime {onnxruntime.__version__}", file=sys.stderr)
    print("| environment | predict, us | onnxruntime, us | predict / onnxruntime | C++, us |")
    print("| --- | --- | --- | --- | --- |")
    with tempfile.TemporaryDirectory() as folder:
        for environment in options.environments:
            policy = make_policy(environment, Path(folder))
            observations = agail.record(policy, 1)[0].observations
            sessions = [session_of(policy, threads) for threads in (1, 0)]
            one_round(policy, sessions, observations, 200)  # warm
            rounds = [
                one_round(policy, sessions, observations, options.calls)
                for _ in range(options.rounds)
            ]
            ours = median(mine for mine, _ in rounds)
            theirs = median(min(others) for _, others in rounds)
            ratios = sorted(mine / min(others) for mine, others in rounds)
            cpp = "-"
            if options.act:
                run = Path(folder) / environment
                long = np.tile(observations, (1 + options.calls // len(observations), 1))
                cpp = f"{median(in_cpp(options.act, run, long) for _ in range(5)):.2f}"
            spread = f"{median(ratios):.2f} ({ratios[0]:.2f} - {ratios[-1]:.2f})"
            print(f"| {environment} | {ours:.2f} | {theirs:.2f} | {spread} | {cpp} |", flush=True)


if __name__ == "__main__":
    main()
