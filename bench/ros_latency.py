"""What a node of specc takes, beside a bare relay in rclpy, in turns in one run.

A sender, out of phase, sends messages of 1 kB with the time in them; a relay or a run of specc,
whose effector passes on what it reads, sends them on to a receiver, all in processes of their own
and, where it is permitted, of the same priority. Of specc counts what is beyond logical execution
time: a period, and half of one, since all phases come as often. A message that nothing follows,
since a newer one came before it was read, counts as one that takes longest. CPU is that of the
process of the node, and of the relay, while messages come. Left out are other RMW.

    python bench/ros_latency.py --samples 10000
"""

from __future__ import annotations

import argparse
import math
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from threading import Thread

from bench.harness.tables import table

ROOT = Path(__file__).parents[1]
SPEC = Path(__file__).parent / "specs" / "passing.yaml"
ENDS = Path(__file__).parent / "harness" / "ros_ends.py"
_LAPS = 3
"""How often the phase of the sender comes around in a round: its period is as much longer."""
BARE, PASSED = "/bare", "/sent"
"""What the relay reads, and what the run of specc reads."""


@dataclass
class Taken:
    """Latencies, s, and the share of a processor that the node had in each round."""

    latencies_s: list[float] = field(default_factory=list)
    shares: list[float] = field(default_factory=list)


class Ends:
    """The sender and the receiver."""

    def __init__(self, stack: ExitStack, python: str) -> None:
        self._sender = stack.enter_context(_started([python, str(ENDS), "sender"]))
        receiver = stack.enter_context(_started([python, str(ENDS), "receiver"]))
        self._received: list[tuple[float, float]] = []
        Thread(target=self._listen, args=(receiver,), daemon=True).start()

    def _listen(self, receiver: subprocess.Popen[str]) -> None:
        assert receiver.stdout is not None
        for line in receiver.stdout:
            sent_s, latency_s = map(float, line.split())
            self._received.append((sent_s, latency_s))

    def send(self, topic: str, count: int, period_s: float) -> list[float]:
        """The latencies of so many messages, s."""
        assert self._sender.stdin is not None and self._sender.stdout is not None
        self._received.clear()
        print(topic, count, period_s, file=self._sender.stdin, flush=True)
        self._sender.stdout.readline()
        time.sleep(5 * period_s + 0.05)
        came = [latency_s for _, latency_s in self._received]
        return came + [math.inf] * (count - len(came))


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--samples", type=int, default=10_000, help="of each, in all")
    parser.add_argument("--rounds", type=int, default=8)
    parser.add_argument("--rate", type=int, default=500, help="Hz")
    parser.add_argument("--python", default=_python(), help="of a ROS 2; else of `make ros`")
    options = parser.parse_args(arguments)
    if not options.python:
        print("no relay to compare with: make ros, or --python of a ROS 2")
        return
    found = {BARE: Taken(), PASSED: Taken()}
    count, period_s = options.samples // options.rounds, 1.0 / options.rate
    with ExitStack() as stack:
        scratch = Path(stack.enter_context(TemporaryDirectory(prefix="specc-latency-")))
        ends = Ends(stack, options.python)
        relay = stack.enter_context(_started([options.python, str(ENDS), "relay"]))
        spec = _specification(scratch, options)
        for _ in range(options.rounds):
            _round(ends, BARE, count, period_s, relay.pid, found[BARE])
            with _running(spec) as node:
                _round(ends, PASSED, count, period_s, node, found[PASSED])
    print(_table(found, period_s))


def _table(found: dict[str, Taken], period_s: float) -> str:
    rows, bare_s = [], median(found[BARE].latencies_s)
    for name, topic, formula_s in (("relay", BARE, 0.0), ("specc", PASSED, 1.5 * period_s)):
        taken = found[topic]
        beyond_s = median(taken.latencies_s) - formula_s
        lost = taken.latencies_s.count(math.inf)
        cells = f"{1e3 * beyond_s:.2f}", f"{beyond_s / bare_s:.2f}", f"{median(taken.shares):.1%}"
        rows.append([name, str(len(taken.latencies_s)), str(lost), *cells])
    head = ("", "messages", "lost", "median, ms", "x relay", "CPU")
    title = f"Latency at {1 / period_s:g} Hz beyond logical execution time, with Fast DDS alone"
    return table(title, head, rows)


def _round(ends: Ends, topic: str, count: int, period_s: float, node: int, taken: Taken) -> None:
    until_s = time.monotonic() + 30.0
    while math.inf in ends.send(topic, 50, 2.1 * period_s):
        if time.monotonic() > until_s:
            raise SystemExit(f"nothing comes of what is sent on {topic}")
    begin_s, used_s = time.monotonic(), _cpu_s(node)
    taken.latencies_s += ends.send(topic, count, period_s * (1 + _LAPS / count))
    taken.shares.append((_cpu_s(node) - used_s) / (time.monotonic() - begin_s))


def _cpu_s(pid: int) -> float:
    """CPU seconds that a process has had."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _environment() -> dict[str, str]:
    """That of all processes: a domain of their own."""
    domain = str(1 + os.getpid() % 100)
    return os.environ | {"ROS_DOMAIN_ID": domain, "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}


def _python() -> str:
    return next(map(str, sorted(ROOT.glob("ros/*/bin/python"))), "")


def _specification(scratch: Path, options: argparse.Namespace) -> Path:
    text = SPEC.read_text(encoding="utf-8")
    text = text.replace("ros2: {", f"ros2: {{python: {options.python}, ")
    spec = scratch / SPEC.name
    spec.write_text(text.replace("500 Hz", f"{options.rate} Hz"), encoding="utf-8")
    return spec


@contextmanager
def _started(command: Sequence[str]) -> Iterator[subprocess.Popen[str]]:
    """A process that says when it is ready, until the end."""
    process = subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env=_environment(),
    )
    assert process.stdout is not None
    try:
        if process.stdout.readline() != "ready\n":
            raise SystemExit(f"{' '.join(command)} did not begin")
        yield process
    finally:
        process.kill()
        process.wait()


@contextmanager
def _running(spec: Path) -> Iterator[int]:
    """A run; gives the process of its node, which is there soon after."""
    command = [sys.executable, "-m", "specc", "run", str(spec), "--duration", "3600"]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, cwd=ROOT, env=_environment())
    try:
        yield _child(process.pid)
    finally:
        process.send_signal(signal.SIGINT)
        process.wait()


def _child(pid: int) -> int:
    listed = Path(f"/proc/{pid}/task/{pid}/children")
    until_s = time.monotonic() + 30.0
    while time.monotonic() < until_s:
        for child in listed.read_text(encoding="ascii").split():
            if b"host.py" in Path(f"/proc/{child}/cmdline").read_bytes():
                return int(child)
        time.sleep(0.05)
    raise SystemExit("the run of specc has no node")


if __name__ == "__main__":
    main()
