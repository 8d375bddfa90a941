"""Hosts on one machine: network namespaces around a switch, each with its own address and host name.

    with Hosts(3) as hosts:
        subprocess.run([*hosts.mpirun(ranks=6), "agail", "train", ...], env=hosts.environment)
        hosts.cut(1)

They share processors, memory and files; what crosses the network really does. Needs root, Debian's iproute2 and Open MPI.
"""

import os
import secrets
import shutil
import subprocess
import tempfile
from pathlib import Path

# How mpirun starts its daemon on a host, in place of ssh: $1 is the host, the rest a shell's command line.
AGENT = """#!/bin/sh
host=$1
shift
exec ip netns exec "$host" unshare --uts sh -c 'hostname "$0"; eval "$*"' "$host" "$@"
"""

# docs/ranks.md says why.
KEEPALIVE = {
    "OMPI_MCA_oob_tcp_keepalive_time": "5",
    "OMPI_MCA_oob_tcp_keepalive_intvl": "2",
    "OMPI_MCA_oob_tcp_keepalive_probes": "3",
}


def run(*command: str) -> None:
    subprocess.run(command, check=True, capture_output=True, text=True)


def ip(*arguments: str) -> None:
    run("ip", *arguments)


def inside(host: str) -> list[str]:
    """The beginning of a command that runs on the host."""
    return ["ip", "netns", "exec", host]


def missing() -> str:
    """Why there can be no hosts here; empty if there can."""
    for program in ("ip", "tc", "unshare", "hostname", "mpirun"):
        if not shutil.which(program):
            return f"no {program}"
    try:
        with Hosts(1) as hosts:
            run(*inside(hosts.names[0]), "unshare", "--uts", "hostname", "agail")
            return ""
    except subprocess.CalledProcessError as error:
        return f"no network namespaces: {error.stderr.strip()}"


class Hosts:
    """`mbit`: what each host can send, in Mbit/s; None: what the machine can."""

    def __init__(self, count: int, mbit: float | None = None):
        common = f"agail-{secrets.token_hex(3)}"
        self.names = [f"{common}-{i}" for i in range(count)]
        self.switch = f"{common}-switch"
        self.mbit = mbit
        self.environment = {
            **os.environ,
            **KEEPALIVE,
            "OMPI_MCA_btl": "self,vader,tcp",
            "OMPI_MCA_btl_tcp_if_include": "eth0",
            "OMPI_MCA_oob_tcp_if_include": "eth0",
        }

    def __enter__(self) -> "Hosts":
        self.folder = tempfile.TemporaryDirectory(prefix="agail-hosts-")
        self.agent = Path(self.folder.name) / "agent"
        self.agent.write_text(AGENT)
        self.agent.chmod(0o755)
        self.environment["OMPI_MCA_plm_rsh_agent"] = str(self.agent)
        try:
            self.__build()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __build(self) -> None:
        ip("netns", "add", self.switch)
        ip("-n", self.switch, "link", "add", "switch", "type", "bridge")
        ip("-n", self.switch, "link", "set", "switch", "up")
        for i, host in enumerate(self.names):
            ip("netns", "add", host)
            cable = ["type", "veth", "peer", "name", "eth0", "netns", host]
            ip("-n", self.switch, "link", "add", f"port{i}", *cable)
            ip("-n", self.switch, "link", "set", f"port{i}", "master", "switch", "up")
            ip("-n", host, "address", "add", f"10.77.0.{i + 1}/24", "dev", "eth0")
            if self.mbit:
                # Frames as they are on a cable, so that a small bucket limits every message.
                frames = ["gso_max_size", "1500", "gso_max_segs", "1"]
                ip("-n", host, "link", "set", "eth0", *frames)
                limit = ["rate", f"{self.mbit}mbit", "burst", "10kb", "limit", "10mb"]
                run(*inside(host), "tc", "qdisc", "add", "dev", "eth0", "root", "tbf", *limit)
            ip("-n", host, "link", "set", "lo", "up")
            ip("-n", host, "link", "set", "eth0", "up")

    def __exit__(self, *_) -> None:
        for name in [*self.names, self.switch]:
            subprocess.run(["ip", "netns", "delete", name], capture_output=True)
        self.folder.cleanup()

    def mpirun(self, ranks: int) -> list[str]:
        """The beginning of a command that runs `ranks` processes, one host after the other; mpirun itself is on host 0."""
        slots = -(-ranks // len(self.names))
        places = ",".join(f"{name}:{slots}" for name in self.names)
        return [
            *inside(self.names[0]),
            "unshare", "--uts", "sh", "-c", 'hostname "$0"; exec "$@"', self.names[0],
            "mpirun", "--allow-run-as-root", "--host", places, "--bind-to", "none", "-n", str(ranks),
        ]  # fmt: skip

    def cut(self, host: int) -> None:
        """Pulls the cable of a host."""
        ip("-n", self.switch, "link", "set", f"port{host}", "down")
