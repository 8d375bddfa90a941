#!/usr/bin/env python3
"""agail against others on this machine, in one run: samples a second; writes results/side_by_side.csv and .md.

    benchmarks/side_by_side.py [--work DIR] [--repeats N] [--quick]

The peers come from PyPI, each group into a virtual environment of its own under --work: sb3-contrib's TRPO with 1 and 8
environments, imitation's GAIL on top of it, and EnvPool, which only steps. Each measurement is a process of its own; all
are pinned to the same CPUs, and the contenders take turns. Of the ways in which a peer can be run (vectorised
environments in its process or in others, numbers of threads, of environments, sizes of batches) the quickest of a first round is measured.

What is timed: steady training after 3 TRPO steps of warming up (collecting, rewards, learning; no evaluation, no logging), or
stepping alone under uniformly random actions, resets included. The settings are those of preset `paper` with trpo.fisher_stride = 1, as
the peers know no other: batches of 1,024, two hidden layers of 100 tanh, 10 conjugate-gradient steps, damping 0.1, max. KL 0.01, 5
epochs of the value network in minibatches of 128, 8 minibatches of 128 for the discriminator every third step.

Measurements are kept in --work and not repeated: run it again after an interruption; remove DIR/measurements*.json to start
anew. --quick: once, briefly, to see that everything works. Leave the machine alone meanwhile.
"""

import argparse
import csv
import json
import os
import platform
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from statistics import median

from machine import AGAIL, ROOT, Kept, cpu_model

PEERS = ROOT / "benchmarks/peers"
ENVIRONMENTS = ["Hopper-v4", "Humanoid-v4"]
BATCH = 1024

PACKAGES = {
    "imitation": [
        "imitation==1.0.1",
        "gymnasium==0.29.1",
        "stable-baselines3==2.2.1",
        "sb3-contrib==2.2.1",
        "mujoco==2.3.7",
        "numpy<2",
        "pandas<2.3",
        "scipy<1.14",
        "scikit-learn<1.6",
        "imageio",
        "torch==2.13.0",
    ],
    "envpool": ["envpool"],
}


@dataclass(frozen=True)
class Length:
    """How long a measurement is."""

    updates: int  # TRPO steps of 1,024 samples; a multiple of 3
    seconds: float  # of EnvPool's stepping
    batches: int  # of our stepping


FULL, SHORT = Length(21, 5, 100), Length(3, 1, 20)

# Returns samples a second and the versions of what was measured.
Measure = Callable[[str, Length], tuple[float, dict]]


@dataclass
class Contender:
    name: str
    cpus: int
    ways: dict[str, Measure]  # the quickest counts
    chosen: dict[str, str] = field(default_factory=dict)  # environment -> way


class PeerFailed(Exception):
    pass


def pinned(command: list[str], cpus: int) -> dict | list:
    """Runs it on the first `cpus` CPUs; its JSON."""
    allowed = sorted(os.sched_getaffinity(0))[:cpus]
    done = subprocess.run(
        command,
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=lambda: os.sched_setaffinity(0, allowed),
        env=os.environ | {"OMP_NUM_THREADS": str(cpus), "PYTHONWARNINGS": "ignore"},
    )
    if done.returncode != 0:
        lines = [line for line in done.stderr.splitlines() if line.strip()]
        raise PeerFailed(f"{' '.join(command[1:])}: {lines[-1] if lines else done.returncode}")
    text = done.stdout.strip()
    return json.loads(text if text.startswith(("[", "{")) else text.splitlines()[-1])


def peer(work: Path, group: str, script: str, cpus: int, *arguments: object) -> Measure:
    """arguments: those of the script after the environment; "length" stands for how long."""

    def measure(environment: str, length: Length) -> tuple[float, dict]:
        much = length.seconds if group == "envpool" else length.updates
        command = [str(work / group / "bin/python"), str(PEERS / script), environment]
        result = pinned([*command, *map(str, arguments), str(much)], cpus)
        return result["samples_per_second"], result["versions"]

    return measure


def agail_version() -> str:
    return subprocess.run([AGAIL, "--version"], capture_output=True, text=True).stdout.split()[-1]


def agail(threads: int, lanes: int, *arguments: str) -> Measure:
    def measure(environment: str, length: Length) -> tuple[float, dict]:
        stepping = "--only-stepping" in arguments
        command = [AGAIL, "bench", environment, "--json", "--preset", "paper", *arguments]
        command += ["--threads", str(threads), f"--set=run.lanes={lanes}"]
        command += ["--updates", str(length.batches if stepping else length.updates)]
        result = pinned(command, threads)[0]
        return 1e6 / result["stepping_us" if stepping else "training_us"], {
            "agail": agail_version()
        }

    return measure


def contenders(work: Path) -> list[Contender]:
    def learner(script: str, cpus: int, environments: int) -> dict[str, Measure]:
        kinds = ["dummy"] if environments == 1 or cpus == 1 else ["dummy", "subproc"]
        return {
            f"{kind}, {threads} torch threads": peer(
                work, "imitation", script, cpus, environments, kind, threads
            )
            for kind in kinds
            for threads in range(1, cpus + 1)
        }

    def ours(threads: int, lanes: int, *arguments: str) -> dict[str, Measure]:
        return {f"{threads} threads, {lanes} lanes": agail(threads, lanes, *arguments)}

    stride = "--set=trpo.fisher_stride=1"
    pools = {
        f"{count} environments, batches of {batch}": peer(
            work, "envpool", "envpool_steps.py", 2, count, batch, 2
        )
        for count, batch in [(8, 8), (8, 4), (8, 2), (16, 8), (32, 16), (64, 32)]
    }
    return [
        Contender("agail TRPO, 1 CPU", 1, ours(1, 1, "--method=trpo", stride)),
        Contender("sb3-contrib TRPO, 1 environment, 1 CPU", 1, learner("sb3_trpo.py", 1, 1)),
        Contender("agail TRPO", 2, ours(2, 8, "--method=trpo", stride)),
        Contender("sb3-contrib TRPO, 1 environment", 2, learner("sb3_trpo.py", 2, 1)),
        Contender("sb3-contrib TRPO, 8 environments", 2, learner("sb3_trpo.py", 2, 8)),
        Contender("agail GAIL", 2, ours(2, 8, "--method=gail", "--missing=0", stride)),
        Contender("imitation GAIL, 1 environment", 2, learner("imitation_gail.py", 2, 1)),
        Contender("imitation GAIL, 8 environments", 2, learner("imitation_gail.py", 2, 8)),
        Contender("agail AGAIL", 2, ours(2, 8, "--method=agail")),
        Contender("agail stepping", 2, ours(2, 8, "--only-stepping")),
        Contender("EnvPool stepping", 2, pools),
    ]


# (what, ours, theirs (the quicker counts), goal on Hopper, goal on Humanoid)
RATIOS = [
    (
        "TRPO",
        "agail TRPO",
        ["sb3-contrib TRPO, 1 environment", "sb3-contrib TRPO, 8 environments"],
        (7, 7),
    ),
    (
        "TRPO, 1 environment, 1 CPU",
        "agail TRPO, 1 CPU",
        ["sb3-contrib TRPO, 1 environment, 1 CPU"],
        (None, None),
    ),
    (
        "GAIL",
        "agail GAIL",
        ["imitation GAIL, 1 environment", "imitation GAIL, 8 environments"],
        (20, 7),
    ),
    (
        "GAIL, their 1 environment",
        "agail GAIL",
        ["imitation GAIL, 1 environment"],
        (20, 7),
    ),
    ("stepping", "agail stepping", ["EnvPool stepping"], (1, 1)),
    ("training against bare stepping", "agail AGAIL", ["EnvPool stepping"], (0.9, 0.9)),
]


def install(work: Path, group: str) -> None:
    """Once; PeerFailed if it cannot be done."""
    folder, packages = work / group, PACKAGES[group]
    stamp = folder / "installed"
    if stamp.exists() and stamp.read_text() == "\n".join(packages):
        return
    print(f"installing {group} into {folder}", flush=True)
    for command in (
        [sys.executable, "-m", "venv", "--clear", str(folder)],
        [str(folder / "bin/python"), "-m", "pip", "install", "--quiet", *packages],
    ):
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            errors = [line for line in done.stderr.splitlines() if "ERROR" in line]
            raise PeerFailed(f"{group} cannot be installed: {(errors or ['?'])[-1]}")
    stamp.write_text("\n".join(packages))


def measured(
    kept: Kept, environment: str, contender: Contender, way: str, turn: int, length: Length
) -> dict:
    key = f"{environment} | {contender.name} | {way} | {turn}"
    if key not in kept:
        try:
            rate, versions = contender.ways[way](environment, length)
        except PeerFailed as failure:
            print(f"failed: {failure}", flush=True)
            return {"rate": 0, "versions": {}}
        print(f"{environment}, {contender.name} ({way}): {rate:,.0f} samples/s", flush=True)
        kept.put(key, {"rate": rate, "versions": versions})
    return kept[key]


def choose(kept: Kept, environment: str, contender: Contender) -> None:
    """The quickest way; none if all fail."""
    ways = list(contender.ways)
    if len(ways) == 1:
        contender.chosen[environment] = ways[0]
        return
    rates = {way: measured(kept, environment, contender, way, -1, SHORT)["rate"] for way in ways}
    best = max(ways, key=lambda way: rates[way])
    if rates[best] > 0:
        contender.chosen[environment] = best


def spread(values: list[float], digits: int = 0) -> str:
    low, mid, high = min(values), median(values), max(values)
    return f"{mid:,.{digits}f} ({low:,.{digits}f} - {high:,.{digits}f})"


def table_of_rates(rates: dict[tuple[str, str], list[float]], everyone: list[Contender]) -> str:
    lines = [
        "| environment | contender | run as | samples/s: median (lowest - highest) |",
        "| --- | --- | --- | --- |",
    ]
    for (environment, name), values in rates.items():
        way = next(c for c in everyone if c.name == name).chosen[environment]
        lines.append(f"| {environment} | {name} | {way} | {spread(values)} |")
    return "\n".join(lines)


def table_of_ratios(rates: dict[tuple[str, str], list[float]]) -> str:
    lines = [
        "| environment | what | against | ratio: median (lowest - highest) | goal |",
        "| --- | --- | --- | --- | --- |",
    ]
    for place, environment in enumerate(ENVIRONMENTS):
        for what, ours, theirs, goals in RATIOS:
            there = [name for name in theirs if (environment, name) in rates]
            if not there or (environment, ours) not in rates:
                continue
            best = max(there, key=lambda name: median(rates[environment, name]))
            pairs = zip(rates[environment, ours], rates[environment, best], strict=True)
            ratios = [a / b for a, b in pairs]
            goal = f">= {goals[place]}" if goals[place] else ""
            lines.append(f"| {environment} | {what} | {best} | {spread(ratios, 2)} | {goal} |")
    return "\n".join(lines)


def write(folder: Path, rows: list[dict], text: str) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "side_by_side.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0].keys(), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    (folder / "side_by_side.md").write_text(text)
    print(f"written: {folder}/side_by_side.csv and .md")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--work", type=Path, default=ROOT / "runs/side_by_side")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--quick", action="store_true", help="writes its tables to --work only")
    options = parser.parse_args()
    if len(os.sched_getaffinity(0)) < 2:
        parser.error("needs 2 CPUs")
    work = options.work.resolve()
    work.mkdir(parents=True, exist_ok=True)
    length, repeats = (SHORT, 1) if options.quick else (FULL, options.repeats)

    everyone = contenders(work)
    for group, name in {"imitation": ("sb3", "imitation"), "envpool": ("EnvPool",)}.items():
        try:
            install(work, group)
        except PeerFailed as failure:
            print(f"failed: {failure}", flush=True)
            everyone = [c for c in everyone if not c.name.startswith(name)]

    kept = Kept(work, options.quick)
    rates: dict[tuple[str, str], list[float]] = {}
    versions: dict[str, dict[str, str]] = {}  # of each project's own environment
    rows = []
    for environment in ENVIRONMENTS:
        for contender in everyone:
            choose(kept, environment, contender)
        running = [c for c in everyone if environment in c.chosen]
        for turn in range(repeats):
            for contender in running:
                way = contender.chosen[environment]
                entry = measured(kept, environment, contender, way, turn, length)
                if entry["rate"] == 0:
                    continue
                rates.setdefault((environment, contender.name), []).append(entry["rate"])
                versions[contender.name.split()[0]] = entry["versions"]
                rows.append(
                    {
                        "environment": environment,
                        "contender": contender.name,
                        "run_as": way,
                        "cpus": contender.cpus,
                        "repeat": turn,
                        "samples_per_second": round(entry["rate"], 1),
                    }
                )
    # A contender that failed in one turn has no spread that could be compared.
    rates = {key: values for key, values in rates.items() if len(values) == repeats}
    if not rows:
        sys.exit("nothing could be measured")
    command = "benchmarks/side_by_side.py" + (
        " --quick" if options.quick else f" --repeats {repeats}"
    )
    about = (
        f"`{command}`, {date.today()}, on {cpu_model()}, {os.cpu_count()} CPUs of which 2 (or 1) are used, "
        f"Linux {platform.release()}; "
        + "; ".join(
            f"{project}: " + ", ".join(f"{name} {version}" for name, version in sorted(own.items()))
            for project, own in versions.items()
        )
        + "."
    )
    if options.quick:
        about += " Too short to be quoted."
    text = "\n\n".join([about, table_of_ratios(rates), table_of_rates(rates, everyone)]) + "\n"
    print(f"\n{text}")
    write(work if options.quick else ROOT / "results", rows, text)


if __name__ == "__main__":
    main()
