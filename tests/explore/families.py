"""Random families: agents that are copies of one another, or nearly so, and a hub between them.

Each agent is written out. One of them may differ in one place, inside or outside of what
exploring follows, so that a reduction that overlooks the place merges agents that are no copies.
"""

from __future__ import annotations

from random import Random
from typing import Any

from tests.explore.modes import add_modes

Tree = dict[str, Any]
LAWS = ("x.R.d", "clamp(x.R.d, 0, {c})", "min(max(x.R.d, 0), {c})", "0.5 * x.R.d", "abs(x.R.d)")
LOOKS = (
    "x.r.v > 1.5",
    "x.r.v > {c}",
    "x.r.v > 1.5 or elapsed > 0.5[s]",
    "elapsed >= 0.{c}[s]",
    "k >= {c} and x.r.v > 1",
)
RESTS = ("fresh(x.hub.ack)", "present(x.hub.ack) and x.hub.ack", "elapsed >= 0.{c}[s]", "k < {c}")


def family(seed: int, *, backwards: bool = False, with_modes: bool = False) -> Tree:
    """The specification of a family; its agents in one order, or in the opposite one."""
    tree = _Author(Random(f"family {seed}")).tree(backwards=backwards)
    odd = Random(f"odd {seed}").choice(["", "", *sorted(tree["agents"])])
    for name, agent in tree["agents"].items() if with_modes else ():
        # One of the copies may have other modes.
        same = "hub" if name == "hub" else name if name == odd else "w"
        control = agent["control"]
        control.setdefault("conditions", {})
        control.setdefault("memory", {})
        count = "k" if name != "hub" else "2"
        add_modes(Random(f"modes {seed} {same}"), control, longest_s=1.5, count=count)
    return tree


class _Author:
    def __init__(self, rng: Random) -> None:
        self.rng = rng
        self.size = rng.choice((2, 2, 3))
        self.answers = rng.randrange(3) > 0
        self.is_event = rng.randrange(2) > 0
        self.common = {
            "c": rng.choice((1, 2, 3)),
            "law": rng.choice(LAWS),
            "look": rng.choice(LOOKS),
            "rest": rng.choice(RESTS if self.answers else RESTS[2:]),
            "init": rng.choice((0, 1)),
            "rate": rng.choice((10, 10, 20)),
            "ignores": rng.randrange(4) == 0,
            "resets": rng.randrange(2) > 0,
            "sends": rng.choice((True, False)),
            "assume": rng.choice(("", "", "k < 3", "x.r.v <= 2", "not x.r.v > 3")),
            "name": "told",
            "sporadic": False,
        }
        self.odd = rng.choice([*self.common]) if rng.randrange(2) else None

    def tree(self, *, backwards: bool) -> Tree:
        """The whole specification."""
        rng = self.rng
        names = [f"w_{n}" for n in range(1, self.size + 1)]
        agents: Tree = {}
        bound: Tree = {}
        odd = rng.choice(names)
        for name in names:
            choice = dict(self.common)
            if name == odd and self.odd is not None:
                choice[self.odd] = self._other(self.odd, choice[self.odd])
            agents[name] = self._worker(choice)
            bound[f"{name}.R.r.d"] = {"sporadic": True} if choice["sporadic"] else {}
        agents["hub"] = self._hub(names)
        order = [*agents][::-1] if backwards else [*agents]
        task = {"cycle": {"of": f"{names[0]}.c", "from": "rest", "to": "look"}}
        return {
            **({"task": task} if rng.randrange(3) == 0 else {}),
            "specc": 1.2,
            "system": "family",
            "agents": {name: agents[name] for name in order},
            "plant": {"python": "plant:Plant", "bind": bound},
        }

    def _other(self, key: str, value: Any) -> Any:
        if isinstance(value, bool):
            return not value
        if key == "name":
            return "called"
        options: dict[str, tuple[Any, ...]] = {
            "c": (1, 2, 3),
            "law": LAWS,
            "look": LOOKS,
            "rest": RESTS if self.answers else RESTS[2:],
            "init": (0, 1),
            "rate": (10, 20),
            "assume": ("", "k < 3", "x.r.v <= 2"),
        }
        return self.rng.choice([each for each in options[key] if each != value])

    def _worker(self, choice: dict[str, Any]) -> Tree:
        c, look = choice["c"], choice["look"].format(c=choice["c"])
        told = {"y.hub.hit": "True" if choice["sends"] else "k > 0"}
        reset = {"k": "0" if choice["resets"] else "k"}
        x: Tree = {"r": {"v": {"type": "real", "init": 0}}}
        if self.answers:
            x["hub"] = {"ack": "bool"}
        rest: Tree = {"behaviour": "rest"}
        if choice["ignores"] and self.answers and self.is_event:
            x["hub"] = {"ack": {"type": "bool", "event": True}}
            rest["ignores"] = ["x.hub.ack"]
        name = choice["name"]
        control: Tree = {
            "rate": f"{choice['rate']} Hz",
            "x": x,
            "y": {"hub": {"hit": "bool"}},
            "memory": {"k": {"type": "int", "init": choice["init"]}},
            "conditions": {"terminal": {name: look}},
            "behaviours": {
                "look": {"terminal": name},
                "tell": {
                    "functions": [{**told, "k": "k + 1 if k < 3 else k"}],
                    "terminal": "always",
                },
                "rest": {
                    "functions": [reset],
                    "terminal": {"when": choice["rest"].format(c=c)},
                },
            },
            "states": {"look": "look", "tell": "tell", "rest": rest},
            "initial_state": "look",
            "transitions": [
                ["look", "terminal", "always", "tell"],
                ["tell", "terminal", "always", "rest"],
                ["rest", "terminal", "always", "look"],
            ],
        }
        if choice["assume"]:
            control["assume"] = [{"that": choice["assume"], "because": "it is said"}]
        eye = {
            "rate": f"{choice['rate']} Hz",
            "x": {"R": {"d": "real"}},
            "y": {"c": {"v": "real"}},
            "through": {"y.c.v": choice["law"].format(c=c)},
        }
        return {
            "real_receptors": {"r": {"y": {"d": "real"}}},
            "virtual_receptors": {"r": eye},
            "control": control,
        }

    def _hub(self, names: list[str]) -> Tree:
        rng = self.rng
        hit = {"hit": {"type": "bool", "event": True} if self.is_event else "bool"}
        every = " and ".join(f"present(x.{name}.hit)" for name in names)
        some = " or ".join(f"fresh(x.{name}.hit)" for name in names)
        asked = rng.choice((some, some, some, every, every, f"fresh(x.{names[0]}.hit)"))
        favoured = rng.choice(names) if rng.randrange(5) == 0 else ""
        acks = {
            f"y.{name}.ack": "True" if favoured in (name, "") else "False"
            for name in names
            if self.answers
        }
        wait = rng.choice(("sit", "wait"))
        hub: Tree = {
            "rate": "10 Hz",
            "x": {name: dict(hit) for name in names},
            "behaviours": {
                "sit": {"terminal": {"when": "elapsed > 0.3[s]"}},
                "wait": {"terminal": {"when": asked}},
                "ack": {"functions": [acks] if acks else [], "terminal": "always"},
            },
            "states": {"sit": "sit", "wait": "wait", "ack": "ack"},
            "initial_state": wait,
            "transitions": [
                ["sit", "terminal", "always", "wait"],
                ["wait", "terminal", "always", "ack"],
                ["ack", "terminal", "always", rng.choice(("sit", "wait"))],
            ],
        }
        if self.answers:
            hub["y"] = {name: {"ack": "bool"} for name in names}
        if rng.randrange(3) == 0:
            hub["assume"] = [{"that": f"not ({some})", "because": "nobody hits"}]
        return {"control": hub}
