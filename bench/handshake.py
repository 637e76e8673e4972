"""Two handshaking machines with a counter to 1000: the verdicts of SPIN and of `specc explore`.

bench/spin has the same machines for both. SPIN searches the model once for each property, and once
for deadlocks; its states are those of the product with the property's automaton, its seconds those
of the verifier, and apart from them those in which it is generated and compiled. `specc explore`
looks at all properties in one command; its seconds are those of the whole command, the start of
Python and all checks included. Both are CPU seconds. SPIN knows no time: of `answered` it says that
the answer comes, if both machines go on, and specc that it comes within 2 s. Where SPIN or a C
compiler is missing (on Debian and Ubuntu: apt-get install spin gcc), only what specc says is
printed.

    python bench/handshake.py
"""

from __future__ import annotations

import json
import re
import resource
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from bench.harness.tables import table

HERE = Path(__file__).parent / "spin"
MODEL = HERE / "handshake.pml"
DEADLOCK = "no deadlock"
STUCK = "no deadlock, with a fault at 500"
WAITING = {"W1001", "W1002", "W1003", "W1004"}
VERDICTS = {"proved": "holds", "violated": "fails", "may be violated": "fails"}
"""Of specc in the words of SPIN, whose errors are those of some run."""
_STATES = re.compile(r"(\d+) states, stored")
_ERRORS = re.compile(r"errors: (\d+)")


class Answer(NamedTuple):
    """A verdict, and what it took."""

    verdict: str
    states: int
    seconds: float


def ran(command: Sequence[str], folder: Path | None = None) -> tuple[str, float]:
    """The output of a command and its CPU seconds."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return done.stdout, seconds


def of_spin(folder: Path, *, claim: str = "", stuck: bool = False) -> tuple[Answer, float]:
    """What SPIN says of a property, or of deadlocks, and the seconds that it compiles."""
    defined = ["-DSTUCK"] if stuck else []
    _, generated_s = ran(["spin", "-a", *defined, str(MODEL)], folder)
    # Without a claim all properties are left out, and ends that are not valid are errors.
    options = [] if claim else ["-DNOCLAIM", "-DSAFETY"]
    _, compiled_s = ran(["gcc", "-O2", "-DNFAIR=3", *options, "-o", "pan", "pan.c"], folder)
    asked = ["-a", "-f", "-N", claim] if claim else []
    text, seconds = ran(["./pan", "-m1000000", *asked], folder)
    errors, states = _ERRORS.search(text), _STATES.search(text)
    if not errors or not states:
        raise SystemExit(f"the verifier says nothing of {claim or DEADLOCK}:\n{text}")
    verdict = "holds" if errors[1] == "0" else "fails"
    return Answer(verdict, int(states[1]), seconds), generated_s + compiled_s


def of_specc(spec: str) -> tuple[dict[str, str], int, float]:
    """The verdicts of specc on all properties, states of the slice, and seconds."""
    command = [sys.executable, "-m", "specc", "explore", str(HERE / spec), "--format", "json"]
    text, seconds = ran(command)
    said = json.loads(text)
    verdicts = {each["name"]: each["verdict"] for each in said["requirements"]}
    waits = any(finding["code"] in WAITING for finding in said["findings"])
    sure = said["status"] != "ended at the bound"
    verdicts[DEADLOCK] = "violated" if waits else "proved" if sure else "not explored"
    return verdicts, sum(each["states"] for each in said["slices"]), seconds


def main() -> None:
    """Print both, property by property."""
    verdicts, states, seconds = of_specc("handshake.yaml")
    stuck, stuck_states, stuck_s = of_specc("handshake_stuck.yaml")
    verdicts[STUCK] = stuck[DEADLOCK]
    missing = [tool for tool in ("spin", "gcc") if shutil.which(tool) is None]
    rows, agree, compiled_s = list[Sequence[str]](), 0, 0.0
    with TemporaryDirectory() as folder:
        for name, verdict in verdicts.items():
            cells = ["-", "-", "-"]
            if not missing:
                claim = "" if name in (DEADLOCK, STUCK) else name
                answer, extra_s = of_spin(Path(folder), claim=claim, stuck=name == STUCK)
                compiled_s += extra_s
                cells = [answer.verdict, str(answer.states), f"{answer.seconds:.2f}"]
                agree += VERDICTS.get(verdict) == answer.verdict
            rows.append([name, *cells, verdict])
    print(table("A handshake counted to 1000", ["", "SPIN", "states", "s", "specc"], rows))
    print(f"specc: {states} states and {seconds:.2f} s for all properties of handshake.yaml")
    print(f"specc: {stuck_states} states and {stuck_s:.2f} s for handshake_stuck.yaml")
    if missing:
        print(f"SPIN was not asked: {' and '.join(missing)} not found; apt-get install spin gcc")
        return
    print(f"SPIN: {compiled_s:.2f} s to generate and compile its {len(rows)} verifiers")
    print(f"the same verdict: {agree} of {len(rows)}")


if __name__ == "__main__":
    main()
