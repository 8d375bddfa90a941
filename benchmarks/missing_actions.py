#!/usr/bin/env python3
"""Publishes what the scripts of examples/missing_actions measured (needs matplotlib).

    benchmarks/missing_actions.py --work runs/missing-actions

writes results/missing_actions.csv and, from it, the tables of docs/missing-actions.md (between its marks <!-- measured -->)
and docs/figures/missing_actions.svg: return as a share of the demonstrations', a bar to the mean of the seeds, a dot
for each. Without --work the numbers are those of results/missing_actions.csv.
"""

import argparse
import csv
import re
from collections import defaultdict
from pathlib import Path
from statistics import mean

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt
from figure import COLOURS
from machine import ROOT, fill

RESULTS = ROOT / "results/missing_actions.csv"
TITLES = {
    "dropout": "Drop-out in bursts",
    "dead-foot": "Foot never logged",
    "dead-thigh": "Thigh never logged",
    "motion-capture": "Motion capture",
}


def collect(work: Path) -> None:
    rows = []
    for name in TITLES:
        with (work / f"{name}.csv").open() as file:
            rows += [{"pattern": name, **row} for row in csv.DictReader(file)]
    with RESULTS.open("w", newline="") as file:
        writer = csv.DictWriter(file, ["pattern", "variant", "seed", "share"], lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def shares() -> dict[str, dict[str, list[float]]]:
    """By pattern and variant."""
    table: dict[str, dict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
    with RESULTS.open() as file:
        for row in csv.DictReader(file):
            table[row["pattern"]][row["variant"]].append(float(row["share"]))
    return table


def write_tables(table: dict[str, dict[str, list[float]]]) -> None:
    for pattern, variants in table.items():
        lines = ["| | mean | worst | each seed |", "| --- | --- | --- | --- |"]
        for variant, seeds in variants.items():
            each = ", ".join(f"{share:.0%}" for share in seeds)
            lines.append(f"| {variant} | {mean(seeds):.0%} | {min(seeds):.0%} | {each} |")
        fill(ROOT / "docs/missing-actions.md", f"measured {pattern}", "\n".join(lines))


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--work", type=Path, help="the examples' --work")
    arguments = parser.parse_args()
    if arguments.work:
        collect(arguments.work)
    table = shares()
    write_tables(table)
    plt.rcParams.update({"svg.hashsalt": "agail", "svg.fonttype": "none"})
    figure, axes = plt.subplots(2, 2, figsize=(8, 4.6), sharex=True, layout="constrained")
    for axis, (name, title) in zip(axes.flat, TITLES.items(), strict=True):
        variants = list(table[name])
        for row, variant in enumerate(variants):
            seeds = table[name][variant]
            colour = COLOURS[re.match(r"[a-z-]+", variant)[0]]
            axis.barh(row, mean(seeds), color=colour, alpha=0.45, height=0.7)
            axis.plot(seeds, [row] * len(seeds), "o", color=colour, ms=5)
        axis.set_yticks(range(len(variants)), variants)
        axis.invert_yaxis()
        axis.axvline(1, color="black", lw=0.8)
        axis.set_xlim(0, 1.08)
        axis.xaxis.set_major_formatter(lambda x, _: f"{x:.0%}")
        axis.set_title(title, fontsize=10)
    figure.supxlabel("return as a share of the demonstrations'", fontsize=9)
    out = ROOT / "docs/figures/missing_actions.svg"
    figure.savefig(out, metadata={"Date": None})
    print(out.relative_to(ROOT))


if __name__ == "__main__":
    main()
