#!/usr/bin/env python3
"""What ranks send each other: a model of messages and bytes an update, checked and used to predict.

    benchmarks/traffic.py check      runs agail bench on 1-8 ranks of this machine and compares
    benchmarks/traffic.py check --hosts --mbit 20    the same with a host and a slow cable for each rank; the time, too
    benchmarks/traffic.py predict    messages, bytes and time an update on 16, 256 and 4,096 ranks

The model follows the code: the shares of src/agail/comm/team.h, the collectives of comm/collectives.cc and the tree of
nn/rank_tree.h. Its free parameters are lengths that depend on the run: episodes (how many final observations travel) and
the tries of the line search.
"""

import argparse
import json
import math
import subprocess
from dataclasses import dataclass, replace

from hosts import Hosts
from machine import AGAIL

CHUNK = 64


@dataclass(frozen=True)
class Task:
    """Defaults: Hopper, preset paper."""

    batch: int = 8192
    lanes: int = 16
    observations: int = 11
    actions: int = 3
    hidden: int = 100
    cg_iterations: int = 10
    fisher_stride: int = 5
    value_minibatch: int = 128
    value_epochs: int = 5
    reward_sums: int = 2  # forward passes over the batch for rewards: discriminator, guide
    episode: float = 20  # steps; an untrained Hopper falls after about as many
    line_search_tries: float = 1

    def mlp(self, outputs):
        h = self.hidden
        return (self.observations + 1) * h + (h + 1) * h + (h + 1) * outputs

    @property
    def policy_parameters(self):
        return self.mlp(self.actions) + self.actions

    @property
    def value_parameters(self):
        return self.mlp(1)


def chunks(samples):
    return -(-int(samples) // CHUNK)


def cut(count, ranks, rank):
    """share_of_chunks"""
    grain = 1
    while 16 * grain <= count // ranks:
        grain *= 2
    return count if rank >= ranks else count * rank // ranks // grain * grain


def spreads(samples, ranks):
    return ranks > 1 and chunks(samples) >= 2 * ranks


def nodes(begin, end, count):
    """for_each_node"""
    found, c = 0, begin
    while c < end:
        size = 1
        while c % (2 * size) == 0 and size < count and min(c + 2 * size, count) <= end:
            size *= 2
        c = min(c + size, count)
        found += 1
    return found


@dataclass(frozen=True)
class Cost:
    messages: float = 0  # of all ranks
    bytes: float = 0  # of all ranks
    steps: float = 0  # messages that follow each other
    critical_bytes: float = 0  # on the way of those

    def __add__(self, other):
        return Cost(*(a + b for a, b in zip(self.__tuple(), other.__tuple())))

    def __mul__(self, factor):
        return Cost(*(a * factor for a in self.__tuple()))

    def __tuple(self):
        return self.messages, self.bytes, self.steps, self.critical_bytes


def allgather(total, ranks):
    """Of `total` bytes that all ranks have together."""
    depth = math.ceil(math.log2(ranks))
    volume = (ranks - 1) * (total + 8 * ranks)
    return Cost(ranks * depth, volume, depth, volume / ranks)


def tree_sum(samples, numbers, width, ranks):
    if not spreads(samples, ranks):
        return Cost()
    count = chunks(samples)
    up = steps = critical = 0
    step = 1
    while step < ranks:
        largest = 0
        for rank in range(step, ranks, 2 * step):
            sent = nodes(cut(count, ranks, rank), cut(count, ranks, rank + step), count)
            up += sent
            largest = max(largest, sent)
        steps += 2
        critical += largest + 1
        step *= 2
    size = numbers * width
    return Cost(2 * (ranks - 1), (up + ranks - 1) * size, steps, critical * size)


def gather(samples, ranks):
    return allgather(4 * samples, ranks) if spreads(samples, ranks) else Cost()


def update(task, ranks):
    """Of one update; what is exchanged, by name."""
    if ranks == 1:
        return {}
    n, t = task.batch, task
    finals = n / t.episode + t.lanes
    batch = (
        n * (4 * (t.observations + t.actions + 1) + 1)
        + finals * 4 * t.observations
        + t.lanes * 16
        + n / t.episode * 16
    )
    fisher = -(-n // t.fisher_stride)
    minibatches = t.value_epochs * -(-n // t.value_minibatch)
    return {
        "batch": allgather(batch, ranks),
        "values and rewards": gather(n, ranks) * (1 + t.reward_sums) + gather(t.lanes, ranks),
        "gradient": tree_sum(n, t.policy_parameters, 4, ranks),
        "conjugate gradients": tree_sum(fisher, t.policy_parameters, 4, ranks) * t.cg_iterations,
        "line search": tree_sum(n, 3, 8, ranks) * (1 + t.line_search_tries),
        "value fit": tree_sum(t.value_minibatch, t.value_parameters, 4, ranks) * minibatches,
    }


def total(parts):
    return sum(parts.values(), Cost())


def measured(task, ranks, updates, hosts=None):
    arguments = [
        str(AGAIL), "bench", "Hopper-v5", "--json", "--updates", str(updates),
        f"--set=run.batch_steps={task.batch}", f"--set=run.lanes={task.lanes}",
        "--set=discriminator.every=1", f"--set=value.minibatch={task.value_minibatch}",
    ]  # fmt: skip
    if hosts:
        launcher, environment = hosts.mpirun(ranks), hosts.environment
    else:
        launcher = ["mpirun", "--allow-run-as-root", "--oversubscribe", "--bind-to", "none"]
        launcher, environment = [*launcher, "-n", str(ranks)], None
    command = [*launcher, *arguments]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, env=environment, check=True)
    return json.loads(done.stdout)[0]


def measured_on_hosts(task, ranks, updates, mbit):
    with Hosts(ranks, mbit) as hosts:
        return measured(task, ranks, updates, hosts)


def check(arguments):
    task = Task(batch=arguments.batch, value_minibatch=arguments.value_minibatch)
    columns = ["ranks", "messages", "measured", "bytes", "measured", "bytes, error", "signature"]
    if arguments.mbit:
        columns += ["seconds of the bytes", "measured"]
    print("Messages and bytes an update, all ranks together; model against agail bench.\n")
    print("| " + " | ".join(columns) + " |")
    print("| " + "---: | " * len(columns))
    for ranks in range(1, arguments.ranks + 1):
        if ranks == 1 or not arguments.hosts:
            result = measured(task, ranks, arguments.updates)
        else:
            result = measured_on_hosts(task, ranks, arguments.updates, None)
        ours = total(update(task, ranks))
        seen = result["traffic_an_update"] if ranks > 1 else {"messages": 0, "bytes": 0}
        error = f"{100 * (ours.bytes / seen['bytes'] - 1):+.1f} %" if ranks > 1 else ""
        row = [
            ranks, f"{ours.messages:,.0f}", f"{seen['messages']:,.1f}",
            f"{ours.bytes:,.0f}", f"{seen['bytes']:,.0f}", error, result["signature"],
        ]  # fmt: skip
        if arguments.mbit and ranks > 1:
            # What the slow cable adds to rank 0's waiting: whatever else it waits for is in both.
            slow = measured_on_hosts(task, ranks, arguments.updates, arguments.mbit)
            added = slow["traffic_an_update"]["seconds_of_rank_0"] - seen["seconds_of_rank_0"]
            row += [f"{ours.critical_bytes * 8 / (arguments.mbit * 1e6):.2f}", f"{added:.2f}"]
        print("| " + " | ".join(map(str, row)) + " |", flush=True)


def seconds(task, ranks, a):
    """(collecting, learning that is spread, learning that every rank repeats, exchange)."""
    n, micro = task.batch, 1e-6
    collecting = n / min(ranks, task.lanes) * a.collect_us * micro
    spread = n * a.spread_us * micro
    fit = n * a.value_us * micro
    repeated = n * a.repeated_us * micro
    cost = total(update(task, ranks))
    if spreads(n, ranks):
        spread /= ranks
    if spreads(task.value_minibatch, ranks):
        fit /= ranks
    exchange = cost.steps * a.latency_us * micro + cost.critical_bytes / (a.bandwidth * 1e9)
    return collecting, spread + fit, repeated, exchange


def predict(a):
    print(
        f"Assumed: {a.latency_us:g} us a message, {a.bandwidth:g} GB/s a rank; a sample costs {a.collect_us:g} us to "
        f"collect, {a.spread_us:g} us of learning on chunks, {a.value_us:g} us of the value fit and {a.repeated_us:g} us "
        "that every rank repeats.\n"
    )
    print(
        "| ranks | batch | value minibatch | messages | MB | collect, s | learn, s | repeat, s | exchange, s | speed-up |"
    )
    print("| ---: " * 10 + "|")
    for ranks in (2, 16, 256, 4096):
        for a_rank, minibatch_chunks in ((0, 2), (2048, 2), (2048, 2 * ranks)):
            task = Task(
                batch=a_rank * ranks or 8192,
                lanes=max(16, ranks),
                value_minibatch=64 * minibatch_chunks,
            )
            if minibatch_chunks > 2 and 64 * minibatch_chunks > task.batch:
                continue
            task = replace(task, episode=200)
            cost = total(update(task, ranks))
            parts = seconds(task, ranks, a)
            alone = seconds(replace(task, lanes=ranks), 1, a)
            print(
                f"| {ranks:,} | {task.batch:,} | {task.value_minibatch:,} | {cost.messages:,.0f} | {cost.bytes / 1e6:,.0f} | "
                + " | ".join(f"{p:.3g}" for p in parts)
                + f" | {sum(alone) / sum(parts):,.1f} |"
            )


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    commands = parser.add_subparsers(required=True)
    checking = commands.add_parser("check")
    checking.set_defaults(run=check)
    checking.add_argument("--ranks", type=int, default=8, help="up to this many")
    checking.add_argument("--updates", type=int, default=2)
    checking.add_argument("--batch", type=int, default=8192)
    checking.add_argument("--value-minibatch", type=int, default=128)
    checking.add_argument("--hosts", action="store_true", help="a network namespace for each rank")
    checking.add_argument("--mbit", type=float, help="what a host can send, Mbit/s")
    predicting = commands.add_parser("predict")
    predicting.set_defaults(run=predict)
    predicting.add_argument("--latency-us", type=float, default=20)
    predicting.add_argument("--bandwidth", type=float, default=1.25, help="GB/s a rank")
    # docs/results.md: Hopper, preset paper.
    predicting.add_argument("--collect-us", type=float, default=95)
    predicting.add_argument("--spread-us", type=float, default=7)
    predicting.add_argument("--value-us", type=float, default=5.5)
    predicting.add_argument("--repeated-us", type=float, default=0.3)
    arguments = parser.parse_args()
    if getattr(arguments, "mbit", None) and not arguments.hosts:
        parser.error("--mbit needs --hosts")
    arguments.run(arguments)


if __name__ == "__main__":
    main()
