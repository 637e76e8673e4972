"""What happens to the plant while a run goes on: what it is, when it begins and when it is over.

All numbers follow from the seed, for each repetition by itself, so a run can be repeated. Agents
learn nothing of a disturbance but what their devices report.
"""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from specc_runtime.distortion import Distortion, joined
from specc_runtime.examination import shortcomings
from specc_runtime.options import UsageError
from specc_runtime.random_streams import stream
from specc_runtime.requirements import Requirements
from specc_runtime.system import Disturbance
from specc_runtime.task import drawn

_ROUNDING_S = 1e-9  # times are multiples of a rounded tick


class Disturbable(Protocol):
    """What a plant has in addition that can be disturbed otherwise than by silent devices."""

    def put(self, positions: Mapping[str, float]) -> None:
        """Put joints somewhere, at rest: rad or m; `box.x` is a coordinate of a free one."""

    def shift(self, distances: Mapping[str, float]) -> None:
        """Move joints from where they are, likewise."""

    def push(self, body: str, force: Sequence[float]) -> None:
        """Let a force (3,) act on a body from now on, N in the axes of the world."""

    def block(self, joint: str, blocked: bool) -> None:
        """Let a joint be stuck from now on, or not any more."""


class DeviceReaders(Protocol):
    """What reads the elements of devices, and has the constants that may change and the panel."""

    def adjust(self, values: Mapping[str, float]) -> None:
        """Change constants that may change."""

    def press(self, names: Iterable[str]) -> None:
        """Press buttons of the panel, but for those that are held."""

    def hold(self, name: str, is_held: bool) -> None:
        """Hold a button of the panel from now on, or not any more."""

    def turn(self, values: Mapping[str, float]) -> None:
        """Give elements of the panel values; see `PanelElement.of_number`."""

    def silence(self, element: str, silent: bool) -> None:
        """Let an element have no samples from now on, or have them again."""

    def distort(self, element: str, distortion: Distortion | None) -> None:
        """Distort what is measured for an element from now on, or not any more."""


Numbers = tuple[float, ...]


class Now:
    """What goes on with one name: numbers, of each disturbance that does it now, by their verbs."""

    def __init__(self, plant: Any, devices: DeviceReaders, name: str) -> None:
        self.plant, self.devices, self.name = plant, devices, name
        self.done: defaultdict[str, list[Numbers]] = defaultdict(list)


def _push(now: Now) -> None:
    """Forces add up."""
    force = tuple(map(sum, zip((0.0, 0.0, 0.0), *now.done["push"], strict=True)))
    now.plant.push(now.name, force)


def _block(now: Now) -> None:
    now.plant.block(now.name, bool(now.done["block"]))


def _silence(now: Now) -> None:
    now.devices.silence(now.name, bool(now.done["silent"]))


def _distort(now: Now) -> None:
    now.devices.distort(now.name, joined(now.done["scale"], now.done["bias"]))


def _hold(now: Now) -> None:
    now.devices.hold(now.name, bool(now.done["press"]))


@dataclass(frozen=True, slots=True)
class Verb:
    """How a verb is done: `once`, to all names with a number each (1 if it has none), or as long
    as it `lasts`.

    `once` takes the plant, or what reads devices if it is not done `on_plant`.

    What lasts is brought about for each name where it begins and where it is over. Without
    `on_plant` it needs no `Disturbable`; what a plant `forgets` is done again once it is restored.
    """

    once: Callable[[Any, dict[str, float]], None] | None = None
    lasts: Callable[[Now], None] | None = None
    on_plant: bool = True
    forgets: bool = False


VERBS = {
    "move": Verb(once=lambda plant, positions: plant.put(positions)),
    "shift": Verb(once=lambda plant, distances: plant.shift(distances)),
    "push": Verb(lasts=_push, forgets=True),
    "block": Verb(lasts=_block),
    "silent": Verb(lasts=_silence, on_plant=False),
    "scale": Verb(lasts=_distort, on_plant=False),
    "bias": Verb(lasts=_distort, on_plant=False),
    "adjust": Verb(once=lambda readers, values: readers.adjust(values), on_plant=False),
    "press": Verb(once=lambda readers, names: readers.press(names), lasts=_hold, on_plant=False),
    "turn": Verb(once=lambda readers, values: readers.turn(values), on_plant=False),
}
"""All that a disturbance can do; the compiler has `specc.model.task.VERBS`."""


class Disturbances:
    """Those of one run; `advance` before every tick."""

    def __init__(
        self,
        found: Sequence[Disturbance],
        triggers: Requirements | None,
        plant: Any,
        devices: DeviceReaders,
        seed: int,
    ) -> None:
        """Raises UsageError for a plant to which these things cannot happen."""
        on_plant = any(VERBS[deed.verb].on_plant for each in found for deed in each.deeds)
        if on_plant and (lacking := shortcomings(plant, Disturbable)):
            raise UsageError(f"the plant cannot be disturbed: it {'; '.join(lacking)}")
        count: Counter[str] = Counter()
        self._all = []
        for each in found:
            count[each.subject] += 1
            self._all.append(_Course(each, seed, count[each.subject]))
        self.on_begin: Callable[[float, str], None] = lambda time_s, because: None
        """Called when one begins, with why it is there."""
        self._triggers = triggers
        self._plant = plant
        self._devices = devices

    def advance(self, time_s: float) -> None:
        """Begin and end what is due at this time."""
        due_s = time_s + _ROUNDING_S
        for each in self._all:
            if each.goes_on and due_s >= each.ends_s:
                each.over = True
                self._act(each)
            if due_s >= each.next_s and not each.is_asked and self._holds(each.what.when):
                each.ask(time_s)
            if due_s >= each.begins_s and each.repeat(time_s):
                self._begin(each)
                self.on_begin(time_s, each.what.because)

    def saved(self) -> list[dict[str, Any]]:
        """What is under way and over."""
        return [each.saved() for each in self._all]

    def restore(self, saved: Any) -> list[str]:
        """Go on from there; what of it is not known here, and what is new, and begins in its time.

        Forces of now are given to the plant by `push_again`, once it is restored.

        Raises KeyError, TypeError, ValueError for other data.
        """
        known = {str(each["does"]): each for each in saved}
        for one in self._all:
            if (each := known.get(one.name)) is not None:
                one.restore(each)
        for one in self._all:
            if one.began_s is not None:
                self._act(one)
        mine = {one.name for one in self._all}
        began = [name for name, each in known.items() if each["began_s"] is not None]
        gone = [name for name in began if name not in mine]
        return [
            *(f"nothing is known of the disturbance: {name}" for name in sorted(mine - {*known})),
            *(f"there is no such disturbance, which began in the past: {name}" for name in gone),
        ]

    def push_again(self) -> None:
        """Let the forces of now act, whatever the plant remembers of forces."""
        for one in self._all:
            if one.began_s is not None:
                self._act(one, again=True)

    def as_data(self) -> list[dict[str, Any]]:
        """What the report says of each; `began_s`, of the first time, is null if it never began."""
        return [
            {"because": each.what.because, "began_s": each.first_s, "times": each.times}
            for each in self._all
        ]

    def _holds(self, trigger: int | None) -> bool:
        if trigger is None or self._triggers is None:
            return True
        return self._triggers.requirements[trigger].holds

    def _begin(self, each: _Course) -> None:
        for name, verb in VERBS.items():
            names = [deed.name for deed in each.what.deeds if deed.verb == name]
            if verb.once is not None and names:
                done_to = self._plant if verb.on_plant else self._devices
                verb.once(done_to, {of: (*each.now.of[name, of], 1.0)[0] for of in names})
        self._act(each)

    def _act(self, each: _Course, *, again: bool = False) -> None:
        """Bring what begins or ends about, with what others do to the same things."""
        verbs = ((VERBS[deed.verb], deed.name) for deed in each.what.deeds)
        acts = ((v.lasts, name) for v, name in verbs if v.lasts and (v.forgets or not again))
        for act, name in dict.fromkeys(acts):
            now = Now(self._plant, self._devices, name)
            for one in self._all:
                for deed in one.what.deeds if one.goes_on else ():
                    if deed.name == name:
                        now.done[deed.verb].append(one.now.of[deed.verb, name])
            act(now)


class _Numbers:
    """The numbers of one repetition, which no other disturbance changes unless it does the same."""

    def __init__(self, what: Disturbance, seed: int, name: str) -> None:
        drawn_times = what.at, what.delay, what.lasts, what.every, what.probability
        times = [each for each in drawn_times if each]
        drawn_s = drawn(times, seed, name)
        self.at_s, self.delay_s = drawn_s.get("at", 0.0), drawn_s.get("delay", 0.0)
        self.lasts_s = drawn_s.get("lasts", math.inf)
        self.every_s = drawn_s.get("every", math.inf)
        self.happens = True
        if what.probability is not None:
            self.happens = stream(seed, f"{name} happens").random() < drawn_s["probability"]
        self.of = {
            (deed.verb, deed.name): tuple(drawn(deed.numbers, seed, f"{name} {deed.verb}").values())
            for deed in what.deeds
        }
        """What is drawn, by verb and name."""


class _Course:
    """A disturbance over a run, with the numbers of its present or its next repetition."""

    def __init__(self, what: Disturbance, seed: int, number: int) -> None:
        """`number` counts those that do the same."""
        self.what = what
        self.name = what.subject if number == 1 else f"{what.subject} ({number})"
        self._seed, self._stem = seed, f"disturb {what.subject} {number}"
        self.now = self._numbers(0)
        self.next_s = self.now.at_s
        self.begins_s = math.inf
        """When the repetition begins whose time had come, and whose `when` held."""
        self.first_s: float | None = None
        self.began_s: float | None = None
        """When the last repetition that happened began."""
        self.over = False
        self.times = 0
        """Repetitions that happened."""
        self._due = 0
        """Repetitions that were due."""
        self._present = 0
        """The number of the one that happened last."""

    def _next_numbers(self) -> _Numbers:
        return self._numbers(self._due) if self._due else self.now

    def _numbers(self, repetition: int) -> _Numbers:
        again = f" repetition {repetition}" if repetition else ""
        return _Numbers(self.what, self._seed, self._stem + again)

    @property
    def goes_on(self) -> bool:
        """Whether it has begun and is not over."""
        return self.began_s is not None and not self.over

    @property
    def ends_s(self) -> float:
        """When the present repetition is over."""
        return (self.began_s or 0.0) + self.now.lasts_s

    @property
    def is_asked(self) -> bool:
        """Whether a repetition is to begin, after its delay."""
        return self.begins_s < math.inf

    def ask(self, time_s: float) -> None:
        """Let the next repetition begin after its delay."""
        self.begins_s = time_s + (self._next_numbers().delay_s if self.what.delay else 0.0)

    def repeat(self, time_s: float) -> bool:
        """The next repetition is due: whether it happens. It is later that the one after it is."""
        numbers, self.begins_s = self._next_numbers(), math.inf
        begins_s = self.next_s if self.what.when is None else time_s
        self.next_s = begins_s + numbers.every_s
        self._due += 1
        if not numbers.happens:
            return False
        self.now, self._present = numbers, self._due - 1
        self.began_s, self.over = time_s, False
        self.first_s = time_s if self.first_s is None else self.first_s
        self.times += 1
        return True

    def saved(self) -> dict[str, Any]:
        """What is under way and over."""
        return {
            "does": self.name,
            "began_s": self.began_s,
            "over": self.over,
            "first_s": self.first_s,
            "times": self.times,
            "due": [self._due, self._present, None if math.isinf(self.next_s) else self.next_s],
            "begins_s": self.begins_s if self.is_asked else None,
        }

    def restore(self, saved: Any) -> None:
        """Go on from there; raises KeyError, TypeError, ValueError for other data."""
        began_s, begins_s = saved["began_s"], saved.get("begins_s")
        self.begins_s = math.inf if begins_s is None else float(begins_s)
        if began_s is not None:
            self.began_s, self.over = float(began_s), bool(saved["over"])
            # Older recordings have no repetitions.
            first_s = saved.get("first_s")
            self.first_s = self.began_s if first_s is None else float(first_s)
            self.times = int(saved.get("times", 1))
        due, present, next_s = saved.get("due", (int(began_s is not None), 0, None))
        if due:
            self._due, self._present = int(due), int(present)
            self.now = self._numbers(self._present)
            self.next_s = (self.began_s or 0.0) + self.now.every_s
            if next_s is not None and self.what.every is not None:
                self.next_s = float(next_s)
