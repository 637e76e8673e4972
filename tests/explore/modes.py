"""Modes for random machines: groups of states with timers, errors, and ways back into them."""

from __future__ import annotations

from random import Random
from typing import Any

Tree = dict[str, Any]
TIMED = (
    "elapsed({m}) > {t}[s]",
    "elapsed({m}) >= {t}[s] and not elapsed({m}) > {u}[s]",
    "elapsed({m}) > {t}[s] and elapsed > 0.3[s]",
    "elapsed({m}) + elapsed > {t}[s]",
    "elapsed({m}) > {t}[s] * {k}",
    "entered({m}) and elapsed > 0.3[s]",
    "{k} > 3 and elapsed({m}) < {u}[s]",
)
FUNCTIONS = ("{k} + 1 if entered({m}) else {k}", "1 if elapsed({m}) > {t}[s] else {k}")


NARROW = ("elapsed({m}) < {t}[s]", "not elapsed({m}) > {t}[s] or k > 3", "entered({m}) or k < 4")


def narrow_rows(rng: Random, control: Tree) -> None:
    """Let some rows that always apply depend on the time of a mode."""
    initial = control["conditions"].setdefault("initial", {})
    for row in control["transitions"]:
        if row[2] == "always" and rng.randrange(3) == 0:
            row[2] = f"narrow{len(initial)}"
            mode, time_s = rng.choice([*control["modes"]]), round(rng.uniform(0.1, 2), 2)
            initial[row[2]] = rng.choice(NARROW).format(m=mode, t=time_s)


def add_modes(rng: Random, control: Tree, *, longest_s: float, count: str = "k") -> None:
    """Put the states of a machine into one or two modes, and let rows leave and resume them."""
    states = [*control["states"]]
    members = rng.sample(states, rng.randrange(1, len(states)))
    modes: Tree = {"inner": {"states": members, "initial": rng.choice(members)}}
    if rng.randrange(2):
        others = [state for state in states if state not in members]
        around = rng.sample(others, rng.randrange(len(others)))
        modes["outer"] = {"states": ["inner", *around], "initial": rng.choice(["inner", *around])}
    outside = {"inner": [s for s in states if s not in members]}
    if "outer" in modes:
        outside["outer"] = [s for s in outside["inner"] if s not in modes["outer"]["states"]]

    def numbers(mode: str) -> dict[str, str]:
        early, late = sorted(round(rng.uniform(0.1, longest_s), 2) for _ in range(2))
        return {"m": mode, "t": str(early), "u": str(late), "k": count}

    def target() -> str:
        return rng.choice([*states, *modes])

    for mode in modes:
        if rng.randrange(4) == 0:
            continue
        error = rng.choice(TIMED).format(**numbers(mode))
        modes[mode]["error"] = {f"late_{mode}": error}
        control["transitions"].append([mode, f"late_{mode}", "always", target()])
    if rng.randrange(3) == 0:
        name = rng.choice([*control["conditions"].get("terminal", {"": ""})])
        if name:
            asked = rng.choice(TIMED).format(**numbers(rng.choice([*modes])))
            control["conditions"]["terminal"][name] += f" or {asked}"
    for row in control["transitions"]:
        ways = [m for m in modes if row[0] in outside[m]]
        if ways and rng.randrange(2):
            row[3] = f"resume({rng.choice(ways)})"
    if rng.randrange(3) == 0:
        text = rng.choice(FUNCTIONS).format(**numbers(rng.choice([*modes])))
        behaviour = rng.choice([*control["behaviours"].values()])
        behaviour["functions"] = [*behaviour.get("functions", ()), {"z": text}]
        control["memory"]["z"] = {"type": "int", "init": 0}
        modes["inner"].setdefault("error", {})["counted"] = "z > 20"
        control["transitions"].append(["inner", "counted", "always", rng.choice(states)])
    control["modes"] = modes
