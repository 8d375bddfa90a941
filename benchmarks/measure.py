#!/usr/bin/env python3
"""Trains and evaluates what docs/results.md reports; writes results/<experiment>.csv and the table there.

    benchmarks/measure.py imitation    agail and what it is compared with, 10 demonstrations, 75 % of the actions missing, seeds 0-4
    benchmarks/measure.py ablation     agail with one part off at a time, less exploration, or more interactions, 10 and 3 demonstrations, seeds 0-4

Runs go to --work (default runs/measure), --jobs at a time with one thread each; finished runs are kept, interrupted
ones resumed, so the command can be repeated until it is through. Results do not depend on --jobs.
Experts are chosen as `agail reproduce` does: TRPO, preset default, the best-evaluated policy of each of seeds 10 to 12; of
these the one whose worst of 50 deterministic episodes is best.
"""

import argparse
import csv
import json
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from statistics import mean

from machine import AGAIL, ROOT, fill

SEEDS = range(5)
EPISODES = 50
MISSING = 0.75
EXPERT_SEEDS = (10, 11, 12)
STEPS = {"Hopper-v5": 40_000, "Walker2d-v5": 80_000}
VARIANTS = {  # of agail: settings, and how many times STEPS
    "full": ([], 1),
    "no discriminator": (["reward.alpha=0"], 1),
    "no guide": (["reward.beta=0"], 1),
    "no warm start": (["start.method=random"], 1),
    "no cloning term": (["clone.weight=0"], 1),
    "less exploration": (["start.log_std=-3"], 1),
    "more interactions": ([], 2.5),
}


def agail(*arguments: object) -> str:
    command = [str(AGAIL), *map(str, arguments)]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"failed ({done.returncode}): {' '.join(command)}")
    return done.stdout


def train(run: Path, environment: str, method: str, seed: int, *options: object) -> None:
    summary = run / "summary.json"
    if summary.exists() and json.loads(summary.read_text())["finished"]:
        return
    run.parent.mkdir(parents=True, exist_ok=True)
    resume = ["--resume"] if (run / "config.toml").exists() else []
    agail(
        "train",
        environment,
        "--method",
        method,
        "--seed",
        seed,
        "--threads",
        1,
        "--out",
        run,
        *options,
        *resume,
    )


def evaluate(run: Path) -> dict:
    file = run / "evaluation.json"
    if not file.exists():
        file.write_text(agail("eval", run, "--episodes", EPISODES, "--seed", 1000, "--json"))
    return json.loads(file.read_text())


def curve(run: Path) -> list[tuple[int, float]]:
    """(timesteps, deterministic return) of the evaluations during training; at 0 that of a cloned start."""
    summary = json.loads((run / "summary.json").read_text())
    points = (
        [(0, summary["cloned_evaluation"]["mean_return"])] if "cloned_evaluation" in summary else []
    )
    with (run / "progress.csv").open() as file:
        for row in csv.DictReader(file):
            if row["eval/mean_reward"]:
                points.append(
                    (int(float(row["time/total_timesteps"])), float(row["eval/mean_reward"]))
                )
    return points


def demonstrated_return(run: Path) -> float:
    return json.loads((run / "summary.json").read_text())["demonstrations"]["mean_return"]


def write(name: str, rows: list[dict]) -> None:
    path = ROOT / "results" / f"{name}.csv"
    path.parent.mkdir(exist_ok=True)
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0].keys(), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    print(f"{path.relative_to(ROOT)} written")


def in_parallel(jobs: int, tasks: list) -> list:
    with ThreadPoolExecutor(jobs) as executor:
        return list(executor.map(lambda task: task(), tasks))


def expert(work: Path, environment: str, seed: int) -> Path:
    run = work / "experts" / environment / str(seed)
    train(run, environment, "trpo", seed)
    evaluate(run)
    return run


def demonstrations(work: Path, environment: str, trajectories: int) -> Path:
    """Of the expert's mean action; three quarters of the actions removed."""
    runs = [expert(work, environment, seed) for seed in EXPERT_SEEDS]
    best = max(runs, key=lambda run: (min(evaluate(run)["returns"]), evaluate(run)["mean_return"]))
    masked = work / "demonstrations" / f"{environment}-{trajectories}.hdf5"
    if not masked.exists():
        masked.parent.mkdir(parents=True, exist_ok=True)
        whole = masked.with_name(f"{environment}-{trajectories}-whole.hdf5")
        agail("record", best, "--episodes", trajectories, "--out", whole)
        agail("mask", whole, "--missing", MISSING, "--out", masked)
    return masked


def imitate(
    run: Path,
    environment: str,
    method: str,
    seed: int,
    demos: Path,
    assignments: list[str],
    timesteps: int,
) -> dict:
    options = ["--demos", demos, "--timesteps", timesteps, "--set", "run.evaluate_every=5"]
    options += ["--set", "run.evaluation_episodes=5"]
    for assignment in assignments:
        options += ["--set", assignment]
    train(run, environment, method, seed, *options)
    result = evaluate(run)
    demonstrated = demonstrated_return(run)
    reached = [steps for steps, value in curve(run) if value >= 0.95 * demonstrated]
    return {
        "share_of_demonstrations": round(result["share_of_demonstrations"], 4),
        "mean_return": round(result["mean_return"], 2),
        "standard_error": round(result["standard_error"], 2),
        "steps_to_95": reached[0] if reached else "",
        "demonstrations_mean_return": round(demonstrated, 2),
    }


def measure_imitation(
    work: Path,
    jobs: int,
    name: str,
    trajectories: list[int],
    variants: dict[str, tuple[str, list[str], float]],
) -> None:
    def one(environment: str, n: int, variant: str, seed: int) -> dict:
        method, assignments, times = variants[variant]
        # The full method is the same run in both experiments.
        folder, leaf = (
            ("imitation", "agail") if variant == "full" else (name, variant.replace(" ", "-"))
        )
        run = work / folder / environment / str(n) / leaf / str(seed)
        demos = demonstrations(work, environment, n)
        head = {
            "environment": environment,
            "trajectories": n,
            "variant": variant,
            "seed": seed,
        }
        timesteps = int(times * STEPS[environment])
        return head | imitate(run, environment, method, seed, demos, assignments, timesteps)

    in_parallel(jobs, [lambda e=e, s=s: expert(work, e, s) for e in STEPS for s in EXPERT_SEEDS])
    for environment in STEPS:
        for n in trajectories:
            demonstrations(work, environment, n)
    tasks = [
        (e, n, v, s) for e in reversed(STEPS) for n in trajectories for v in variants for s in SEEDS
    ]
    rows = in_parallel(jobs, [lambda t=t: one(*t) for t in tasks])
    write(name, rows)
    fill(ROOT / "docs/results.md", f"measured {name}", markdown(rows))


def markdown(rows: list[dict]) -> str:
    lines = [
        "| environment | demonstrations | variant | share, mean | worst seed | interactions to 95 %, median (seeds that reach it) |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    cells: dict[tuple, list[dict]] = {}
    for row in rows:
        cells.setdefault((row["environment"], row["trajectories"], row["variant"]), []).append(row)
    for (environment, n, variant), cell in sorted(cells.items(), key=lambda item: item[0][0]):
        shares = [row["share_of_demonstrations"] for row in cell]
        reached = sorted(row["steps_to_95"] for row in cell if row["steps_to_95"] != "")
        to_95 = "never"
        if variant == "bc":  # it does not interact
            to_95 = "-"
        elif reached:
            to_95 = f"{reached[(len(reached) - 1) // 2]:,} ({len(reached)} of {len(cell)})"
        lines.append(
            f"| {environment} | {n} | {variant} | {100 * mean(shares):.1f} % | {100 * min(shares):.1f} % | {to_95} |"
        )
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("experiment", choices=["imitation", "ablation"])
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--work", type=Path, default=ROOT / "runs/measure")
    options = parser.parse_args()
    if options.experiment == "imitation":
        methods = ["agail", "gail", "state-gail", "bc", "bco"]
        variants = {method: (method, [], 1) for method in methods}
        measure_imitation(options.work, options.jobs, "imitation", [10], variants)
    else:
        variants = {name: ("agail", *variant) for name, variant in VARIANTS.items()}
        measure_imitation(options.work, options.jobs, "ablation", [10, 3], variants)


if __name__ == "__main__":
    main()
