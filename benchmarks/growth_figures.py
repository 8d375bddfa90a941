#!/usr/bin/env python3
"""Draws docs/figures/growth-*.svg from results/growth.csv (needs matplotlib)."""

import csv

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt
from growth import ROOT

COLOURS = ["#1b6ca8", "#d9822b", "#5a8f3c"]


def read() -> dict[str, dict[str, list[dict]]]:
    """part -> variant -> rows"""
    parts: dict[str, dict[str, list[dict]]] = {}
    with (ROOT / "results/growth.csv").open() as file:
        for row in csv.DictReader(file):
            parts.setdefault(row["part"], {}).setdefault(row["variant"], []).append(row)
    return parts


def draw(axis: plt.Axes, rows: list[dict], x: str, y: str, **style: object) -> None:
    points = sorted((float(row[x]), float(row[y])) for row in rows)
    axis.plot(*zip(*points, strict=True), marker="o", ms=4, **style)


def guide_line(axis: plt.Axes, rows: list[dict], x: str, y: str) -> None:
    """What linear growth from the first point on would be."""
    points = sorted((float(row[x]), float(row[y])) for row in rows)
    (x0, y0), (x1, _) = points[0], points[-1]
    axis.plot([x0, x1], [y0, y0 * x1 / x0], color="black", lw=0.8, ls=":", label="linear")


def panels(count: int) -> tuple[plt.Figure, list[plt.Axes]]:
    figure, axes = plt.subplots(1, count, figsize=(3.2 * count, 3), layout="constrained")
    for axis in axes:
        axis.set_xscale("log")
        axis.set_yscale("log")
    return figure, list(axes)


def save(figure: plt.Figure, name: str) -> None:
    out = ROOT / f"docs/figures/growth-{name}.svg"
    figure.savefig(out, metadata={"Date": None})
    print(out.relative_to(ROOT))


def learning(parts: dict) -> None:
    figure, axes = panels(3)
    labels = {"batch": "samples a batch", "width": "weights of the policy"}
    for axis, part in zip(axes, ["batch", "width", "observations"], strict=True):
        rows = [row for group in parts[part].values() for row in group]
        style = {"ls": "none"} if part == "observations" else {}
        draw(axis, rows, "size", "learning_us", color=COLOURS[0], **style)
        if part != "batch":
            guide_line(axis, rows, "size", "learning_us")
        axis.set_xlabel(labels.get(part, "observations"))
    axes[0].set_ylabel("learning, us a sample")
    axes[1].legend(fontsize=8)
    save(figure, "learning")


def demonstrations(parts: dict) -> None:
    figure, axes = panels(2)
    for colour, (variant, rows) in zip(COLOURS, parts["demonstrations"].items(), strict=False):
        draw(axes[0], rows, "x", "guide_us", color=colour, label=variant)
    for colour, (variant, rows) in zip(COLOURS, parts["file"].items(), strict=False):
        draw(axes[1], rows, "x", "peak_memory_mb", color=colour, label=f"agail {variant}")
    axes[0].set_ylabel("guide, us a sample")
    axes[1].set_ylabel("peak memory, MB")
    for axis in axes:
        axis.set_xlabel("transitions")
        axis.legend(fontsize=8)
    save(figure, "demonstrations")


def cores(parts: dict) -> None:
    names = [name for name in ("threads", "ranks") if name in parts]
    figure, axes = plt.subplots(1, 1, figsize=(3.6, 3), layout="constrained")
    for colour, name in zip(COLOURS, names, strict=False):
        rows = [row for group in parts[name].values() for row in group]
        draw(axes, rows, "x", "training_us", color=colour, label=name)
    axes.set_xlabel("threads or ranks")
    axes.set_ylabel("training, us a sample")
    axes.set_ylim(bottom=0)
    axes.legend(fontsize=8)
    save(figure, "cores")


def main() -> None:
    plt.rcParams["svg.hashsalt"] = "agail"
    parts = read()
    (ROOT / "docs/figures").mkdir(exist_ok=True)
    learning(parts)
    demonstrations(parts)
    cores(parts)


if __name__ == "__main__":
    main()
