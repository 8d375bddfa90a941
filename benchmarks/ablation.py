#!/usr/bin/env python3
"""AGAIL with 75 % of the actions missing, one part off at a time, on the environments of the paper's Table 1.

    benchmarks/ablation.py                    everything: 4 environments, 4 parts, 6 seeds, beside the full method
    benchmarks/ablation.py --envs CartPole-v0 --seeds 0 1 2
    benchmarks/ablation.py --only-tables      from what has been run

Each part is a grid of `agail reproduce table1` in results/table1/ablation/<part>, which goes on from the records there. The
full method is the same cell of the experiment itself: FULL (default results/table1/default), with its experts in EXPERTS
(default FULL/experts), which are trained again if a run needs them and they are not there. Writes table.csv (the columns of
`agail reproduce`, after the part that was off and the number of seeds) and table.md beside the parts; fills the table in
docs/results.md.
"""

import argparse
import csv
import subprocess
import sys
from pathlib import Path

from machine import AGAIL, ROOT, fill, with_seeds

RESULTS = ROOT / "results/table1/ablation"
MISSING = "0.75"
OFF = {
    "discriminator": "reward.alpha=0",
    "guide": "reward.beta=0",
    "warm-start": "start.method=random",
    "cloning-term": "clone.weight=0",
}
FULL = "none"


def reproduce(part: str, *arguments: str | Path) -> None:
    command = [AGAIL, "reproduce", "table1", "--out", RESULTS / part, *arguments]
    done = subprocess.run(command, check=False)
    if done.returncode != 0:
        sys.exit(done.returncode)


def run(part: str, setting: str, options: argparse.Namespace) -> None:
    arguments = ["--experts", options.experts or options.full / "experts"]
    arguments += ["--methods", "agail", "--missing", MISSING, "--set", setting]
    if options.envs:
        arguments += ["--envs", *options.envs]
    if options.seeds:
        arguments += ["--seeds", *map(str, options.seeds)]
    if options.jobs:
        arguments += ["--jobs", str(options.jobs)]
    print(f"without {part}", flush=True)
    reproduce(part, *arguments)


def rows(part: str, folder: Path) -> list[dict]:
    def seeds(environment: str) -> int:
        ratio = round(100 * float(MISSING))
        return len(list((folder / "records").glob(f"{environment}-agail-{ratio}-*.json")))

    with (folder / "table.csv").open() as file:
        return [
            {"off": part, "seeds": seeds(row["environment"]), **row}
            for row in csv.DictReader(file)
            if row["method"] == "agail" and float(row["missing"]) == float(MISSING)
        ]


def markdown(table: list[dict]) -> str:
    lines = [
        "| environment | off | seeds | training return | deterministic IQM [95 %] | worst seed | of the expert | steps to 95 % |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for row in table:
        steps = f"{float(row['steps_to_95']):,.0f}" if row["steps_to_95"] else "never"
        lines.append(
            f"| {row['environment']} | {row['off'].replace('-', ' ')} | {row['seeds']} "
            f"| {float(row['mean']):.1f} ± {float(row['standard_error']):.1f} "
            f"| {float(row['iqm']):.1f} [{float(row['iqm_low']):.1f}, {float(row['iqm_high']):.1f}] "
            f"| {float(row['worst_seed']):.1f} | {float(row['share_of_expert']):.1%} | {steps} |"
        )
    return "\n".join(lines) + "\n"


def overview(table: list[dict]) -> str:
    """For docs/results.md: what is off by row, the environments on which it can tell by column."""
    environments = ["Hopper-v4", "Walker2d-v4", "Humanoid-v4"]
    cell = {(row["off"], row["environment"]): row for row in table}

    def heading(environment: str) -> str:
        parts = [cell[part, environment] for part in OFF if (part, environment) in cell]
        return with_seeds(environment, {row["seeds"] for row in parts})

    lines = [
        f"| off | {' | | | '.join(map(heading, environments))} | | |",
        "| --- " * (1 + 3 * len(environments)) + "|",
    ]
    for off in [FULL, *OFF]:
        cells = ["nothing" if off == FULL else off.replace("-", " ")]
        for environment in environments:
            row = cell.get((off, environment))
            if row is None:  # not run
                cells += ["-"] * 3
                continue
            share = float(row["share_of_expert"])
            worst = share * float(row["worst_seed"]) / float(row["deterministic_mean"])
            error = f" ± {float(row['standard_error']):.0f}" if row["seeds"] > 1 else ""
            cells += [
                f"{float(row['mean']):,.0f}{error}",
                f"{100 * share:.1f} % ({100 * worst:.1f})",
                f"{float(row['steps_to_95']):,.0f}" if row["steps_to_95"] else "never",
            ]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--full", type=Path, default=ROOT / "results/table1/default")
    parser.add_argument("--experts", type=Path)
    parser.add_argument("--envs", nargs="+")
    parser.add_argument("--seeds", nargs="+", type=int)
    parser.add_argument("--jobs", type=int)
    parser.add_argument("--only-tables", action="store_true")
    options = parser.parse_args()

    table = rows(FULL, options.full)
    for part, setting in OFF.items():
        if options.only_tables:
            reproduce(part, "--only-tables")
        else:
            run(part, setting, options)
        table += rows(part, RESULTS / part)
    environments = list(dict.fromkeys(row["environment"] for row in table))
    table.sort(key=lambda row: environments.index(row["environment"]))
    with (RESULTS / "table.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, table[0].keys(), lineterminator="\n")
        writer.writeheader()
        writer.writerows(table)
    (RESULTS / "table.md").write_text(markdown(table))
    fill(ROOT / "docs/results.md", "ablation", overview(table))
    print(markdown(table), end="")


if __name__ == "__main__":
    main()
