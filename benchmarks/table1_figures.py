#!/usr/bin/env python3
"""Draws the paper's figures 2 and 3 from the records of `agail reproduce table1`, the paper's values beside (needs matplotlib).

    benchmarks/table1_figures.py DIR                        writes DIR/figure2.svg, .png and DIR/figure3.svg, .png
    benchmarks/table1_figures.py DIR --methods docs/figures  the curves of each method besides, for its page: curve-METHOD.svg
    benchmarks/table1_figures.py DIR --tables FILE.md ...    and the table between <!-- table1 NAME --> (the last part of DIR)
                                                            and <!-- end --> in each file

Figure 2: smoothed return of the training episodes against environment steps, mean over the seeds and its standard error;
left ours, right the paper's. Figure 3: the return at the end of that against the share of missing actions, TRPO and
GAIL as horizontal lines. The paper's MuJoCo environments were the older v2.
"""

import argparse
import csv
import json
from pathlib import Path

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt
import numpy as np
from machine import ROOT, fill, with_seeds

PAPER = ROOT / "results" / "paper"
ENVIRONMENTS = {  # ours: the paper's name
    "CartPole-v0": "CartPole",
    "Hopper-v4": "Hopper",
    "Walker2d-v4": "Walker2d",
    "Humanoid-v4": "Humanoid",
}
COLOURS = {
    "TRPO": "#333333",
    "GAIL": "#8f5fb0",
    "state-GAIL": "#d9822b",
    "AGAIL.00": "#0b3c5d",
    "AGAIL.25": "#1b6ca8",
    "AGAIL.50": "#4c9ed9",
    "AGAIL.75": "#8cc5ec",
}
METHODS = {"trpo": "TRPO", "gail": "GAIL", "state-gail": "state-GAIL", "agail": "AGAIL"}


def read(path: Path) -> list[dict]:
    with path.open() as file:
        return list(csv.DictReader(file))


def name_of(method: str, missing: float | None) -> str:
    if method == "agail":
        return f"AGAIL.{100 * missing:02.0f}"
    return {"trpo": "TRPO", "gail": "GAIL", "state-gail": "state-GAIL"}[method]


def our_curves(folder: Path) -> dict[tuple[str, str], tuple[np.ndarray, np.ndarray]]:
    """(environment, method): steps, and a curve a seed."""
    curves: dict[tuple[str, str], list] = {}
    steps = {}
    for path in sorted((folder / "records").glob("*.json")):
        record = json.loads(path.read_text())
        key = record["environment"], name_of(record["method"], record["missing"])
        curve = record["training"]["curve"]
        if not curve:  # no training episode ended
            continue
        curves.setdefault(key, []).append(curve)
        steps[key] = np.array([*range(0, 511, 8), 511]) / 511 * record["budget"]
    return {key: (steps[key], np.array(rows, float)) for key, rows in curves.items()}


def paper_curves() -> dict[tuple[str, str], np.ndarray]:
    """(environment, method): columns steps, mean, standard error."""
    curves: dict[tuple[str, str], list] = {}
    for row in read(PAPER / "paper_curves.csv"):
        method = {"state": "state-GAIL"}.get(row["method"], row["method"].replace("_0.", "."))
        key = row["env"], method
        curves.setdefault(key, []).append([float(row[c]) for c in ("real_steps", "mean", "sem")])
    return {key: np.array(rows) for key, rows in curves.items()}


def band(axis: plt.Axes, x, mean, error, label: str) -> None:
    axis.plot(x, mean, color=COLOURS[label], lw=1.2, label=label)
    axis.fill_between(x, mean - error, mean + error, color=COLOURS[label], alpha=0.15, lw=0)


def figure2(ours: dict, environments: list[str]) -> plt.Figure:
    figure, axes = plt.subplots(
        len(environments), 2, figsize=(9, 2.6 * len(environments)), layout="constrained",
        sharey="row", squeeze=False,
    )  # fmt: skip
    paper = paper_curves()
    for (left, right), environment in zip(axes, environments, strict=True):
        for label in COLOURS:
            if (environment, label) in ours:
                x, rows = ours[environment, label]
                error = rows.std(0) / np.sqrt(len(rows))
                band(left, x, rows.mean(0), error, label)
            points = paper.get((ENVIRONMENTS[environment], label))
            if points is not None:
                band(right, points[:, 0], points[:, 1], points[:, 2], label)
        left.set_title(f"{environment}, this project", fontsize=9)
        version = "v0" if environment.startswith("CartPole") else "v2"
        right.set_title(f"{ENVIRONMENTS[environment]}-{version}, the paper's logs", fontsize=9)
        left.set_ylabel("training return")
        for axis in (left, right):
            axis.xaxis.set_major_formatter(lambda x, _: f"{x / 1000:.0f}k")
    axes[-1][0].set_xlabel("environment steps")
    axes[-1][1].set_xlabel("environment steps")
    axes[0][1].legend(fontsize=7, loc="best")
    return figure


def method_figure(ours: dict, environments: list[str], labels: list[str]) -> plt.Figure:
    figure, axes = plt.subplots(
        1, len(environments), figsize=(2.8 * len(environments), 2.4), layout="constrained",
        squeeze=False,
    )  # fmt: skip
    for axis, environment in zip(axes[0], environments, strict=True):
        for label in labels:
            if (environment, label) in ours:
                x, rows = ours[environment, label]
                band(axis, x, rows.mean(0), rows.std(0) / np.sqrt(len(rows)), label)
        axis.set_title(environment, fontsize=9)
        axis.set_xlabel("environment steps")
        axis.xaxis.set_major_formatter(lambda x, _: f"{x / 1000:.0f}k")
        axis.set_ylim(bottom=0)
    axes[0][0].set_ylabel("training return")
    if len(labels) > 1:
        axes[0][0].legend(fontsize=6, loc="lower right")
    return figure


def figure3(table: list[dict], environments: list[str]) -> plt.Figure:
    figure, axes = plt.subplots(
        1, len(environments), figsize=(3.2 * len(environments), 3.2), layout="constrained",
        squeeze=False,
    )  # fmt: skip
    for axis, environment in zip(axes[0], environments, strict=True):
        rows = [row for row in table if row["environment"] == environment and row["mean"]]
        for prefix, colour, style in (("", "#1b6ca8", "-"), ("paper_", "#999999", ":")):
            whose = "paper" if prefix else "ours"
            agail = [r for r in rows if r["method"] == "agail"]
            axis.errorbar(
                [100 * float(r["missing"]) for r in agail],
                [float(r[f"{prefix}mean"]) for r in agail],
                [float(r[f"{prefix}standard_error"]) for r in agail],
                color=colour, linestyle=style, marker="o", ms=3, capsize=2, label=f"AGAIL, {whose}",
            )  # fmt: skip
            for method, line in (("trpo", "#333333"), ("gail", "#8f5fb0")):
                for row in rows:
                    if row["method"] == method:
                        axis.axhline(
                            float(row[f"{prefix}mean"]), color=line, linestyle=style, lw=0.9,
                            label=f"{name_of(method, None)}, {whose}",
                        )  # fmt: skip
        axis.set_title(environment, fontsize=9)
        axis.set_xlabel("missing actions, %")
    axes[0][0].set_ylabel("return (the paper's statistic)")
    figure.legend(
        *axes[0][0].get_legend_handles_labels(), loc="outside lower center", ncols=6, fontsize=7
    )
    return figure


def markdown_table(table: list[dict], ours: dict, environments: list[str]) -> str:
    """The paper's statistic, ours and in brackets the paper's; an environment of fewer than six seeds says so."""

    def heading(environment: str) -> str:
        seeds = {len(curves) for (e, _), (_, curves) in ours.items() if e == environment}
        return with_seeds(environment, seeds)

    def cell(environment: str, label: str) -> str:
        for row in table:
            missing = float(row["missing"]) if row["missing"] else None
            if (row["environment"], name_of(row["method"], missing)) == (environment, label):
                form = ",.1f" if environment.startswith("CartPole") else ",.0f"
                values = row["mean"], row["standard_error"], row["paper_mean"]
                return "{} ± {} ({})".format(*(format(float(v), form) for v in values))
        return ""

    names = {"GAIL": "GAIL, all actions", "state-GAIL": "state-GAIL, no actions"}
    for label in COLOURS:
        if label.startswith("AGAIL"):
            share = int(label[-2:])
            names[label] = f"**AGAIL**, {f'{share} % missing' if share else 'all actions'}"
    rows = [["", *map(heading, environments)], ["---"] * (len(environments) + 1)]
    for label in COLOURS:
        rows.append([names.get(label, label), *(cell(e, label) for e in environments)])
    return "\n".join(f"| {' | '.join(row)} |".replace("|  |", "| |") for row in rows)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path, help="the --out of agail reproduce table1")
    parser.add_argument("--methods", type=Path, metavar="DIR", help="curves of each method, too")
    parser.add_argument("--tables", type=Path, nargs="+", default=[], metavar="FILE")
    options = parser.parse_args()
    folder = options.folder
    if not (folder / "table.csv").exists():
        parser.error(f"{folder}/table.csv: no such file; run agail reproduce table1 first")
    table = read(folder / "table.csv")
    environments = [e for e in ENVIRONMENTS if any(row["environment"] == e for row in table)]
    plt.rcParams["svg.hashsalt"] = "agail"
    ours = our_curves(folder)
    for name, figure in {
        "figure2": figure2(ours, environments),
        "figure3": figure3(table, environments),
    }.items():
        figure.savefig(folder / f"{name}.svg", metadata={"Date": None})
        figure.savefig(folder / f"{name}.png", dpi=150)
        print(folder / f"{name}.svg", folder / f"{name}.png")
    if options.methods:
        for method, prefix in METHODS.items():
            labels = [label for label in COLOURS if label.startswith(prefix)]
            file = options.methods / f"curve-{method}.svg"
            method_figure(ours, environments, labels).savefig(file, metadata={"Date": None})
            print(file)
    for file in options.tables:
        fill(file, f"table1 {folder.resolve().name}", markdown_table(table, ours, environments))
        print(file)


if __name__ == "__main__":
    main()
