#!/usr/bin/env python3
"""Draws docs/figures/hopper_75.svg from the runs of `benchmarks/measure.py imitation` (needs matplotlib).

Deterministic return as a share of the demonstrations' mean against environment steps: mean over the seeds, and the range
from the worst to the best.
"""

import argparse
from pathlib import Path
from statistics import mean

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt
from measure import ROOT, SEEDS, curve, demonstrated_return, evaluate

COLOURS = {
    "agail": "#1b6ca8",
    "gail": "#8f5fb0",
    "state-gail": "#d9822b",
    "bc": "#5a8f3c",
    "bco": "#b0413e",
}


def draw(axis: plt.Axes, runs: Path) -> None:
    for method, colour in COLOURS.items():
        folders = [runs / method / str(seed) for seed in SEEDS]
        if method == "bc":
            share = mean(evaluate(folder)["share_of_demonstrations"] for folder in folders)
            axis.axhline(share, color=colour, linestyle="--", label="behaviour cloning (mean)")
            continue
        demonstrated = demonstrated_return(folders[0])
        curves = [[(x, y / demonstrated) for x, y in curve(folder)] for folder in folders]
        steps = [x for x, _ in curves[0]]
        shares = [[c[i][1] for c in curves] for i in range(len(steps))]
        axis.plot(steps, [mean(s) for s in shares], color=colour, label=method)
        axis.fill_between(
            steps,
            [min(s) for s in shares],
            [max(s) for s in shares],
            color=colour,
            alpha=0.15,
            lw=0,
        )
    axis.axhline(1, color="black", lw=0.8)
    axis.set_xlabel("environment steps")
    axis.set_ylim(0, 1.1)
    axis.xaxis.set_major_formatter(lambda x, _: f"{x / 1000:.0f}k")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--work", type=Path, default=ROOT / "runs/measure")
    work = parser.parse_args().work
    plt.rcParams["svg.hashsalt"] = "agail"
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.2), sharey=True, layout="constrained")
    for axis, environment in zip(axes, ["Hopper-v5", "Walker2d-v5"], strict=True):
        draw(axis, work / "imitation" / environment / "10")
        axis.set_title(f"{environment}, 10 demonstrations, 75 % of the actions missing", fontsize=9)
    axes[0].set_ylabel("return / demonstrations' return")
    axes[1].legend(fontsize=8, loc="center right")
    out = ROOT / "docs/figures/hopper_75.svg"
    out.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(out, metadata={"Date": None})
    print(out.relative_to(ROOT))


if __name__ == "__main__":
    main()
