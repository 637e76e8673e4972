"""Modes written out: the flat Moore machine that groups of states stand for.

A row of a mode is a row of each of its states. A row that resumes a mode is one row for each state
that may have been left, under the condition that it was. Proofs, generated code and exploration
know the flat machine only; what the work cycle keeps for a mode is named by the rows.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction

from specc.diagnostics import Related
from specc.limits import MAX_DEPTH
from specc.model.expr import FALSE, TRUE, Binary, Expr, LetRef, Member, MemoryRef, Number, walk
from specc.model.fsm import NEVER_LEFT, Assignment, Cause, Function, Trace, mode_name
from specc.model.system import Let, Memory
from specc.model.types import Bool, Enum, Int, Real
from specc.model.units import DIMENSIONLESS, SECOND, parse_unit
from specc.reachable import grouped, reachable
from specc.resolve.context import Findings, YamlNode
from specc.schema.subsystem import SubsystemDef
from specc.source import Place

_RESUME = re.compile(r"\s*resume\s*\(\s*([^()]*?)\s*\)\s*")


@dataclass(frozen=True, slots=True)
class Target:
    """What a row names as the next state: a state, a mode, or a mode that it resumes."""

    name: str
    is_resumed: bool
    start: int | None = None
    """Where the name of the mode begins in `resume(mode)`."""

    @property
    def end(self) -> int | None:
        """Where the name ends."""
        return None if self.start is None else self.start + len(self.name)


def target_of(text: str) -> Target:
    """The target that a row writes."""
    resumed = _RESUME.fullmatch(text)
    if resumed is None:
        return Target(text, is_resumed=False)
    return Target(resumed[1], is_resumed=True, start=resumed.start(1))


@dataclass(frozen=True, slots=True)
class FlatRow:
    """A row of the flat machine, which the row `index` of the file stands for.

    `source_mode` and `target_mode` are the modes that the file names there, "" where it names the
    state. If it `resumes` a mode, it applies where `left(mode)` is one of those `remembered`.
    """

    index: int
    source: str
    source_mode: str
    cause: Cause
    target: str
    target_mode: str
    enters: tuple[str, ...]
    leaves: tuple[str, ...]
    resumes: str = ""
    remembered: frozenset[str] = frozenset()


@dataclass(eq=False, slots=True)
class ModeTree:
    """The modes of a subsystem as a forest over its states."""

    definition: SubsystemDef
    where: YamlNode
    findings: Findings
    members: dict[str, tuple[str, ...]] = field(default_factory=dict)
    """The states and modes directly in each mode."""
    parent: dict[str, str] = field(default_factory=dict)
    """The mode directly around a state or mode; "" if there is none."""

    _reported: set[str] = field(default_factory=set)
    """The modes of which it is reported that they are entered and have no initial state."""

    def __post_init__(self) -> None:
        for name, item in self.definition.modes.items():
            at, members = self.where["modes"][name], []
            if name in self.definition.states:
                related = (Related(self.where["states"][name].key, "the state"),)
                message, help = f"`{name}` is a state and a mode", "rows name both: rename one"
                self.findings.report("E0205", message, at.key, related=related, help=help)
                continue
            for index, member in enumerate(item.states):
                if self.is_known(member, at["states"][index]):
                    members.append(member)
                    self._place_in(member, name, at["states"][index])
            self.members[name] = tuple(dict.fromkeys(members))
        self._cut_depth()

    def _cut_depth(self) -> None:
        """Report modes that are too deep in others, and take them out of these."""
        depths = {name: len(self._around(name)) for name in self.members}
        too_deep = [name for name, depth in depths.items() if depth and depth % MAX_DEPTH == 0]
        for name in too_deep:
            del self.parent[name]
        if too_deep:
            message = f"modes are more than {MAX_DEPTH} levels deep"
            place = self.where["modes"][min(too_deep, key=depths.__getitem__)].key
            self.findings.report("E0017", message, place, help="put fewer modes into one another")

    def is_known(self, name: str, at: YamlNode) -> bool:
        """Whether a text names a state or mode; reports if it does not."""
        states, modes = self.definition.states, self.definition.modes
        if name in states or name in modes:
            self.findings.use(self.where["states" if name in states else "modes"][name].key, at)
            return True
        if target_of(name).is_resumed:
            message, help = f"`{name}` is a next state of rows only", "name a state or the mode"
            self.findings.report("E0604", message, at.place, help=help)
        elif states:
            what = "state or mode" if modes else "state"
            self.findings.unknown("E0201", what, name, [*states, *modes], at.place)
        return False

    def _place_in(self, member: str, mode: str, at: YamlNode) -> None:
        """Note the mode around a member; reports one that is in two modes or inside itself."""
        around = self.parent.get(member)
        if member == mode or member in self._around(mode):
            message = f"mode `{member}` is inside itself"
            help = f"leave it out of the `states` of `{mode}`"
            self.findings.report("E0604", message, at.place, help=help)
        elif around is not None:
            index = self.definition.modes[around].states.index(member)
            first = self.where["modes"][around]["states"][index].place
            message = f"`{member}` is in mode `{around}` and in mode `{mode}`"
            help = "list it in one of them: what is in an inner mode is in the outer one, too"
            if around == mode:
                message, help = f"`{member}` is in mode `{mode}` twice", "list it once"
            related = (Related(first, "listed here first"),)
            self.findings.report("E0604", message, at.place, related=related, help=help)
        else:
            self.parent[member] = mode

    def _around(self, name: str) -> list[str]:
        """The modes around a state or mode, from the inside."""
        found: list[str] = []
        while name := self.parent.get(name, ""):
            found.append(name)
        return found

    def path(self, name: str) -> tuple[str, ...]:
        """The modes around a state or mode, outermost first."""
        return tuple(reversed(self._around(name)))

    def states(self, name: str) -> tuple[str, ...]:
        """The states in a mode, in the order of the file; a state itself."""
        if name in self.definition.states:
            return (name,)
        inside = (m for m in self.members.get(name, ()) if self.parent.get(m) == name)
        return tuple(state for member in inside for state in self.states(member))

    def initial(self, mode: str) -> str:
        """The state in which a mode is entered; "" if it has none."""
        last = self._innermost_entered(mode)
        return last if last in self.definition.states else ""

    def _innermost_entered(self, mode: str) -> str:
        """The state to which `initial` leads from a mode, or the mode at which that ends."""
        name = mode
        while name in self.members:
            initial = self.definition.modes[name].initial or ""
            if name not in self.path(initial):
                break
            name = initial
        return name

    def check_initials(self) -> None:
        """Report `initial` that is not inside its mode."""
        for name in self.members:
            initial, at = self.definition.modes[name].initial, self.where["modes"][name]["initial"]
            if initial is None or not self.is_known(initial, at):
                continue
            # A member that has no place there is reported already.
            if name not in self.path(initial) and initial not in self.members[name]:
                message = f"`{initial}` is not in mode `{name}`"
                help = f"name a state or mode in it, e.g. `{self.members[name][0]}`"
                if not self.members[name]:
                    help = "name a state or mode in it"
                self.findings.report("E0604", message, at.place, help=help)

    def entered_state(self, target: Target, at: YamlNode) -> str:
        """The state that a target leads to, or may lead to first; "" after reporting."""
        if target.is_resumed:
            return self.initial(target.name) if self._can_be_resumed(target, at) else ""
        if not self.is_known(target.name, at):
            return ""
        last = self._innermost_entered(target.name)
        if last in self.definition.states:
            return last
        if self.definition.modes[last].initial is None and last not in self._reported:
            self._reported.add(last)
            message = f"mode `{last}` is entered by its name and has no `initial`"
            first = next(iter(self.states(last)), "")
            help = f"write e.g. `initial: {first}` in the mode, or name a state where it is entered"
            place, related = self.where["modes"][last].key, (Related(at.place, "entered here"),)
            self.findings.report("E0604", message, place, related=related, help=help)
        return ""

    def _can_be_resumed(self, target: Target, at: YamlNode) -> bool:
        """Whether a target names a mode; reports if it does not."""
        name, modes, findings = target.name, self.definition.modes, self.findings
        place = replace(at.place, start=target.start, end=target.end)
        if name in modes:
            of = self.where["modes"][name].key
            findings.use(of, at, start=target.start, end=target.end)
        elif not name:
            message, help = "`resume` names no mode", "write `resume(mode)` with the mode"
            findings.report("E0604", message, at.place, help=help)
        elif name in self.definition.states:
            message = f"`{name}` is a state: only a mode can be resumed"
            help = f"name a mode, or write `{name}` to enter the state"
            findings.report("E0604", message, place, help=help)
        else:
            findings.unknown("E0201", "mode", name, modes, place)
        return name in modes


Errors = Mapping[str, Mapping[str, Place]]
"""State -> its error conditions, highest priority first: their names, "" for one without, and where
they are defined."""


@dataclass(eq=False, slots=True)
class FlatTable:
    """The rows of the flat machine."""

    tree: ModeTree
    errors: Errors
    rows: list[FlatRow] = field(default_factory=list)
    history: dict[str, tuple[str, ...]] = field(default_factory=dict)
    """Mode that a row resumes -> the values of `left(mode)`, the initial one first."""
    idle: tuple[int, ...] = ()
    """Rows of the file that stand for no error condition, since other rows name each of them."""
    _named: dict[str, set[str]] = field(default_factory=dict)
    """State -> the causes that its rows name."""

    def __post_init__(self) -> None:
        written = [*self._written()]
        for row in written:
            self._named.setdefault(row.source, set()).add(row.cause)
        by_cause = [flat for row in written for flat in self._by_cause(row)]
        some = {row.index for row in by_cause}
        clear = (row for row in written if "error" not in self.errors[row.source])
        self.idle = tuple(dict.fromkeys(row.index for row in clear if row.index not in some))
        for mode in dict.fromkeys(row.resumes for row in by_cause if row.resumes):
            self.history[mode] = self._history(mode, by_cause)
        for row in by_cause:
            self.rows += self._by_history(row) if row.resumes else (row,)

    def cause(self, state: str, error: str) -> Cause:
        """How an error condition of a state is called as a cause."""
        is_only = len(self.errors[state]) < 2 and error not in self._named.get(state, ())
        return "error" if is_only or not error else error

    def _written(self) -> Iterator[FlatRow]:
        """The rows of the file for each of their states, with the cause as it is written."""
        tree, table = self.tree, self.tree.where["transitions"]
        for index, item in enumerate(tree.definition.transitions):
            at, target = table[index], target_of(item.target)
            names = [n for i, n in enumerate(item.sources) if tree.is_known(n, at["from"][i])]
            entered = tree.entered_state(target, at["to"])
            is_legal = self._has_cause(item.cause, names, at["cause"])
            if target.is_resumed:
                is_legal = is_legal and target.name in tree.definition.modes
                is_legal = is_legal and self._is_outside(target.name, names, at["to"])
            elif not entered:
                continue
            named = ((s, n) for n in names if is_legal for s in tree.states(n))
            for source, name in named:
                if item.cause in ("terminal", "error", *self.errors[source]):
                    row = self._between(index, source, item.cause, target, entered)
                    yield replace(row, source_mode="" if name == source else name)

    def _between(
        self, index: int, source: str, cause: Cause, target: Target, entered: str
    ) -> FlatRow:
        """A row with the modes that it enters and leaves."""
        around = self.tree.path(source)
        if target.is_resumed:
            outer = self.tree.path(target.name)
            after, anew = (*outer, target.name), [m for m in outer if m not in around]
        else:
            after = self.tree.path(entered)
            named = after[after.index(target.name) :] if target.name in after else ()
            anew = [m for m in after if m in named or m not in around]
        left = tuple(m for m in around if m not in after)
        resumes = target.name if target.is_resumed else ""
        is_entered = target.name in self.tree.members and not target.is_resumed
        mode = target.name if is_entered else ""
        return FlatRow(index, source, "", cause, entered, mode, tuple(anew), left, resumes)

    def _has_cause(self, cause: Cause, names: list[str], at: YamlNode) -> bool:
        """Whether the states and modes of a row have a cause; reports the first that has not."""
        modes = [name for name in names if name in self.tree.members]
        states = [name for name in names if name not in self.tree.definition.modes]
        for name in () if cause in ("terminal", "error") else (*modes, *states):
            errors = [self.errors[state] for state in self.tree.states(name)]
            if not any(cause in own for own in errors):
                known = dict.fromkeys(error for own in errors for error in own if error)
                causes = ["terminal", "error", *known]
                self.tree.findings.unknown("E0201", "cause", cause, causes, at.place)
                return False
            for place in dict.fromkeys(own[cause] for own in errors if cause in own):
                self.tree.findings.use(place, at)
        return True

    def _is_outside(self, mode: str, names: list[str], at: YamlNode) -> bool:
        """Whether all states of a row are outside a mode that it resumes; reports if not."""
        for name in names:
            states = self.tree.states(name)
            outside = [state for state in states if mode not in self.tree.path(state)]
            if len(outside) < len(states):
                message = f"`{name}` is in mode `{mode}`, which is resumed from outside only"
                help = f"name a state, or `{mode}` to enter it anew"
                if name == mode:
                    message = f"mode `{mode}` is resumed from outside only"
                elif outside:
                    message = f"mode `{mode}` is resumed from outside only, and is in `{name}`"
                    help = f"give the row to states outside it, such as `{outside[0]}`"
                self.tree.findings.report("E0604", message, at.place, help=help)
                return False
        return True

    def _by_cause(self, row: FlatRow) -> Iterator[FlatRow]:
        """A row for each error condition that `error` stands for; any other row itself."""
        own, named = self.errors[row.source], self._named[row.source]
        if row.cause == "terminal" or not own:
            yield row
        elif row.cause != "error":
            yield replace(row, cause=self.cause(row.source, row.cause))
        else:
            causes = (self.cause(row.source, name) for name in own if name not in named)
            yield from (replace(row, cause=cause) for cause in dict.fromkeys(causes))

    def _history(self, mode: str, rows: Sequence[FlatRow]) -> tuple[str, ...]:
        """The values that `left(mode)` has where rows resume a mode; reports what is missing."""
        left = dict.fromkeys(row.source for row in rows if mode in row.leaves)
        where, findings = self.tree.where, self.tree.findings
        if NEVER_LEFT in left:
            message = f"a state of mode `{mode}`, which is resumed, is called `{NEVER_LEFT}`"
            place = where["states"][NEVER_LEFT].key
            findings.report("E0221", message, place, help="choose another name")
        resuming = [row for row in rows if row.resumes == mode]
        before = self._reached_before_leaving(mode, rows)
        if not any(row.source in before for row in resuming):
            return tuple(left) or (NEVER_LEFT,)
        if not resuming[0].target:
            message = f"mode `{mode}` may be resumed before it was left, and has no `initial`"
            help = "write `initial:` in the mode: the state in which it begins the first time"
            findings.report("E0604", message, where["modes"][mode].key, help=help)
        return NEVER_LEFT, *left

    def _reached_before_leaving(self, mode: str, rows: Sequence[FlatRow]) -> Collection[str]:
        """The states that may be entered before any row leaves a mode.

        A state that a mode is resumed in was entered before.
        """
        start = self.tree.definition.initial_state or ""
        start = self.tree.initial(start) if start in self.tree.members else start
        inner = grouped((row.source, row.target) for row in rows if mode not in row.leaves)
        return reachable([start], lambda state: inner.get(state, ()))

    def _by_history(self, row: FlatRow) -> Iterator[FlatRow]:
        """A row for each state in which a mode may be resumed."""
        targets = (
            (row.target if each == NEVER_LEFT else each, each) for each in self.history[row.resumes]
        )
        for target, remembered in grouped(targets).items():
            if target:
                yield replace(row, target=target, remembered=frozenset(remembered))


# What modes remember, as memory of the subsystem.


@dataclass(frozen=True, slots=True)
class ModeMemory:
    """The memory elements of modes, of which each is there if something asks for it."""

    table: FlatTable
    timed: tuple[str, ...]
    """Modes whose time is asked for."""
    watched: tuple[str, ...]
    """Modes of which is asked whether they were entered."""

    @classmethod
    def of(cls, table: FlatTable, exprs: Iterable[Expr]) -> ModeMemory:
        """What the expressions of a subsystem, and rows that resume modes, ask for."""
        nodes = (node for expr in exprs for node in walk(expr))
        named = {node.name for node in nodes if isinstance(node, (LetRef, MemoryRef))}
        modes = table.tree.definition.modes
        timed = tuple(mode for mode in modes if mode_name("elapsed", mode) in named)
        watched = tuple(mode for mode in modes if mode_name("entered", mode) in named)
        return cls(table, timed, watched)

    def lets(self, rate_hz: Fraction) -> Iterator[Let]:
        """`elapsed(mode)` of each mode whose time is asked for."""
        for mode in self.timed:
            place = self.table.tree.where["modes"][mode].key
            periods: Expr = MemoryRef(mode_name("periods", mode), type=Int())
            # A quotient of whole numbers is rounded once: 3 periods at 10 Hz are 0.3 s.
            seconds = Real(SECOND)
            if rate_hz.denominator > 1:
                times = Number(float(rate_hz.denominator), type=Real(DIMENSIONLESS))
                periods = Binary("*", periods, times, type=times.type)
            rate = Number(float(rate_hz.numerator), type=Real(parse_unit("Hz")))
            elapsed = Binary("/", periods, rate, type=seconds)
            title = f"time for which mode {mode} has been active"
            yield Let(mode_name("elapsed", mode), elapsed, title, Trace(), place)

    def elements(self, initial_state: str) -> Iterator[Memory]:
        """The memory elements, with their values in the first period."""
        tree = self.table.tree
        for mode in tree.definition.modes:
            place = tree.where["modes"][mode].key
            rest = Trace(), place
            if mode in self.timed:
                title = f"periods that passed while mode {mode} was active"
                yield Memory(mode_name("periods", mode), Int(), _ZERO, title, *rest)
            if mode in self.watched:
                title = f"whether mode {mode} was entered in this period"
                is_first = TRUE if mode in tree.path(initial_state) else FALSE
                yield Memory(mode_name("entered", mode), Bool(), is_first, title, *rest)
            if self.table.history.get(mode):
                title = f"the state that was active when mode {mode} was left"
                last = self.last_state(mode)
                first = Member(self.table.history[mode][0], type=last.type)
                yield Memory(last.name, last.type, first, title, *rest)

    def last_state(self, mode: str) -> MemoryRef:
        """`left(mode)`: the state that a row left last when it left the mode."""
        return MemoryRef(mode_name("left", mode), type=Enum("", self.table.history[mode]))

    def sets(self, row: FlatRow) -> tuple[tuple[str, Expr], ...]:
        """What a row sets."""
        found: list[tuple[str, Expr]] = []
        found += ((mode_name("periods", mode), _ZERO) for mode in row.enters if mode in self.timed)
        found += ((mode_name("entered", mode), TRUE) for mode in row.enters if mode in self.watched)
        for mode in row.leaves:
            if mode in self.table.history:
                last = self.last_state(mode)
                found.append((last.name, Member(row.source, type=last.type)))
        return tuple(found)

    def function(self, state: str, place: Place) -> Function | None:
        """What a state does for the modes around it in every period."""
        found: list[Assignment] = []
        for mode in self.table.tree.path(state):
            rest = Trace(), place
            if mode in self.timed:
                periods = MemoryRef(mode_name("periods", mode), type=Int())
                more = Binary("+", periods, Number(1, type=Int()), type=Int())
                found.append(Assignment("", periods.name, more, *rest))
            if mode in self.watched:
                found.append(Assignment("", mode_name("entered", mode), FALSE, *rest))
        return Function("modes", tuple(found), "", Trace(), place) if found else None


_ZERO = Number(0, type=Int())
