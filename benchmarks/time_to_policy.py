#!/usr/bin/env python3
"""Wall time from the start of the process to 95 % of the demonstrations' mean return; writes results/time_to_policy.csv
and the table in docs/performance.md.

Hopper-v5 and Walker2d-v5, half and three quarters of the actions missing, 10 and 3 demonstrations, seeds 0-4, 2 threads, preset
`default`; deterministic return over 20 episodes, of the cloned start and then every 2 updates. The demonstrations are
those of `benchmarks/measure.py imitation`, which must have run with the same --work. Finished runs are kept. Leave the machine alone meanwhile.

The time counted is that of starting, cloning, physics and learning; the evaluations made to measure are not part of it.
"""

import argparse
import csv
import json
import os
import signal
import subprocess
import time
from pathlib import Path
from statistics import median

from machine import fill
from measure import AGAIL, ROOT, SEEDS, STEPS, agail, demonstrated_return, demonstrations, write

SHARE = 0.95


def rows(run: Path) -> list[dict]:
    file = run / "progress.csv"
    if not file.exists():
        return []
    with file.open() as text:
        return [row for row in csv.DictReader(text) if row["time/learning"]]


def reached(run: Path, goal: float) -> dict | None:
    for row in rows(run):
        if row["eval/mean_reward"] and float(row["eval/mean_reward"]) >= goal:
            return row
    return None


def masked(work: Path, environment: str, trajectories: int, missing: float) -> Path:
    file = work / "demonstrations" / f"{environment}-{trajectories}-{missing}.hdf5"
    if not file.exists():
        demonstrations(work, environment, trajectories)
        whole = file.with_name(f"{environment}-{trajectories}-whole.hdf5")
        agail("mask", whole, "--missing", missing, "--out", file)
    return file


def learn(run: Path, environment: str, seed: int, demos: Path) -> dict:
    """Trains until an evaluation is good enough, or to the end."""
    if not (run / "summary.json").exists():
        subprocess.run(["rm", "-rf", run], check=True)
        run.parent.mkdir(parents=True, exist_ok=True)
        goal = SHARE * json.loads(agail("inspect", demos, "--json"))["mean_return"]
        settings = ["run.evaluate_every=2", "run.evaluation_episodes=20"]
        command = [AGAIL, "train", environment, "--method", "agail", "--demos", demos]
        command += ["--seed", seed, "--threads", 2, "--timesteps", STEPS[environment], "--out", run]
        command += [word for setting in settings for word in ("--set", setting)]
        process = subprocess.Popen(
            list(map(str, command)), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        while process.poll() is None:
            if reached(run, goal):
                process.send_signal(signal.SIGTERM)
                process.wait()
            time.sleep(0.2)
    return json.loads((run / "summary.json").read_text())


def one(work: Path, environment: str, trajectories: int, missing: float, seed: int) -> dict:
    run = work / "time" / environment / f"{trajectories}-{missing}" / str(seed)
    summary = learn(run, environment, seed, masked(work, environment, trajectories, missing))
    goal = SHARE * demonstrated_return(run)
    start = summary["start_seconds"]
    row = reached(run, goal)
    seconds: float | str = ""
    steps: int | str = ""
    if summary.get("cloned_evaluation", {}).get("mean_return", 0) >= goal:
        seconds, steps = round(start, 2), 0
    elif row:
        seconds = round(start + float(row["time/physics"]) + float(row["time/learning"]), 2)
        steps = int(float(row["time/total_timesteps"]))
    return {
        "environment": environment,
        "trajectories": trajectories,
        "missing": missing,
        "seed": seed,
        "seconds": seconds,
        "interactions": steps,
    }


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--work", type=Path, default=ROOT / "runs/measure")
    work = parser.parse_args().work
    if (os.cpu_count() or 1) < 2:
        parser.error("needs 2 cores")
    cells = [(e, n, m) for e in STEPS for n in (10, 3) for m in (0.5, 0.75)]
    table = [[one(work, *cell, seed) for seed in SEEDS] for cell in cells]
    write("time_to_policy", [row for cell in table for row in cell])
    lines = [
        "| environment | demonstrations | missing | median | worst | seeds that get there |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for (environment, trajectories, missing), cell in zip(cells, table, strict=True):
        times = [row["seconds"] if row["seconds"] != "" else float("inf") for row in cell]
        found = sum(t != float("inf") for t in times)
        middle, worst = (
            f"{t:.1f} s" if t != float("inf") else "-" for t in (median(times), max(times))
        )
        lines.append(
            f"| {environment} | {trajectories} | {missing:.0%} | {middle} | {worst} | {found} of {len(times)} |"
        )
    fill(ROOT / "docs/performance.md", "time to a policy", "\n".join(lines))


if __name__ == "__main__":
    main()
