"""What the three examples share: complete demonstrations, several seeds of each variant, and the table."""

import argparse
import csv
from pathlib import Path
from statistics import mean

import agail

DATA = Path(__file__).parents[2] / "data/hopper-v5.hdf5"


def options(description):
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--timesteps", type=int, default=40_000)
    parser.add_argument("--work", type=Path, default=Path("runs/missing-actions"))
    return parser.parse_args()


def recorded(work, episodes):
    """Complete Hopper episodes, of a policy learned from the demonstrations in data/."""
    return agail.record(finished(work / "demonstrator", DATA, timesteps=40_000), episodes, seed=7)


def finished(folder, demonstrations, **settings):
    """The run in this folder; trained, or trained on, only if it is not finished."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    resume = (folder / "config.toml").exists()
    if resume and agail.Run(folder).finished:
        return agail.Run(folder)
    settings |= {"out": folder, "threads": 1, "progress": False, "resume": resume}
    return agail.train("Hopper-v5", demonstrations, **settings)


def compare(name, variants, arguments):
    """variants: {label: (demonstrations, settings of agail.train)}. Writes NAME.csv to the work folder."""
    rows = []
    print(f"| {name} | mean of {arguments.seeds} seeds | worst |\n| --- | --- | --- |", flush=True)
    for label, (demonstrations, settings) in variants.items():
        settings = {"timesteps": arguments.timesteps, "run": {"evaluate_every": 0}, **settings}
        shares = []
        for seed in range(arguments.seeds):
            folder = arguments.work / name / label.replace(" ", "-") / str(seed)
            run = finished(folder, demonstrations, seed=seed, **settings)
            shares.append(agail.evaluate(run, 20, seed=1000, threads=1).share_of_demonstrations)
            rows.append((label, seed, f"{shares[-1]:.4f}"))
        print(f"| {label} | {mean(shares):.0%} | {min(shares):.0%} |", flush=True)
    with (arguments.work / f"{name}.csv").open("w", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([("variant", "seed", "share"), *rows])
