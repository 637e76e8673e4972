"""From terms to Python: every value once, in the place where it is first needed."""

from __future__ import annotations

from dataclasses import dataclass

from specc.lower import nodes as s
from specc.lower.finite import is_array
from specc.lower.module import Module
from specc.lower.names import Names, literal
from specc.lower.nodes import Nodes, Spelled
from specc.lower.terms import NONE, Term, Terms, TermTable
from specc.model import expr as e
from specc.model.types import Enum, Pose, Vector

# Which members of an enum a quantifier's body accepts, when it asks nothing else.


def accepted(quantifier: e.Quantifier, body: Term) -> frozenset[str] | None:
    """Members for which `body` holds; None if it depends on more than the variable."""
    over = quantifier.over.type
    if quantifier.kind not in ("all", "any"):
        return None
    if not (isinstance(over, Vector) and over.size and isinstance(over.element, Enum)):
        return None
    outcomes = {m: _holds(body, quantifier.variable, m) for m in over.element.members}
    if None in outcomes.values():
        return None
    return frozenset(member for member, holds in outcomes.items() if holds)


def _holds(term: Term, variable: str, member: str) -> bool | None:
    match term.node:
        case e.Truth(value=value):
            return value
        case _ if not term.bound:
            return None
        case e.Among(members=members) if _is_variable(term.args[0], variable):
            return member in members
        case e.Compare(op="==" | "!=" as op):
            return _equals(term.args, variable, member, wanted=op == "==")
        case e.Unary(op="not"):
            inner = _holds(term.args[0], variable, member)
            return None if inner is None else not inner
        case e.Logic(op=op):
            parts = [_holds(arg, variable, member) for arg in term.args]
            if None in parts:
                return None
            return all(parts) if op == "and" else any(parts)
    return None


def _equals(sides: tuple[Term, ...], variable: str, member: str, *, wanted: bool) -> bool | None:
    for side, other in (sides, sides[::-1]):
        if _is_variable(side, variable) and isinstance(other.node, e.Member):
            return (other.node.name == member) is wanted
    return None


def _is_variable(term: Term, variable: str) -> bool:
    return isinstance(term.node, e.Bound) and term.node.name == variable


# From terms to Python: every value once, in the place where it is first needed.
#
# A term that is needed again keeps its value in a local: assigned by a statement before the
# expression where it is evaluated in any case, by `:=` inside the expression where a condition
# guards it. Where only some paths evaluated it, its local is None on the others.


FEW = 2
"""Up to so many members of an enum, `in` tests are clearer and faster than a loop."""


@dataclass(frozen=True, slots=True)
class Seen:
    """Terms whose local has their value: on all paths to this point, or on some."""

    always: Terms = NONE
    perhaps: Terms = NONE

    def plus(self, term: Term, *, always: bool = True) -> Seen:
        """With one more."""
        return Seen(self.always | {term} if always else self.always, self.perhaps | {term})

    def join(self, other: Seen) -> Seen:
        """Where two paths meet."""
        return Seen(self.always & other.always, self.perhaps | other.perhaps)

    def without_clock(self) -> Seen:
        """After a state was entered, what depends on its clock has another value."""
        return Seen(
            *(frozenset(t for t in ts if not t.reads_clock) for ts in (self.always, self.perhaps))
        )


class Renderer:
    """Spells the terms of one method. `again`: terms worth a local."""

    def __init__(
        self, module: Module, table: TermTable, again: Terms = NONE, partial: Terms = NONE
    ) -> None:
        self.module = module
        self.nodes = Nodes(module, table)
        self.again = again
        self.partial = set(partial)
        """Terms that some paths evaluate before they are needed; a first rendering finds them."""
        self.names: Names = module.local_names()
        self.locals: dict[Term, str] = {}
        self._may_assign = True

    def local(self, term: Term) -> str:
        """The local of a term: its let's name, else its operator's in small letters."""
        if term not in self.locals:
            self.locals[term] = self.names.new(term.let.name if term.let else _wanted(term))
        return self.locals[term]

    def value(self, term: Term, seen: Seen) -> tuple[Spelled, Seen]:
        """A value, and what is known after it."""
        spelled, if_true, if_false = self.test(term, seen)
        return spelled, if_true if if_true == if_false else if_true.join(if_false)

    def test(self, term: Term, seen: Seen) -> tuple[Spelled, Seen, Seen]:
        """A condition, and what is known when it holds and when it does not."""
        self.nodes.visits.add()
        if term in seen.always:
            return Spelled(self.local(term)), seen, seen
        if term in seen.perhaps:
            return self._perhaps_evaluated(term, seen)
        spelled, if_true, if_false = self._evaluated(term, seen)
        if not (term in self.again and term.is_costly and self._may_assign):
            return spelled, if_true, if_false
        always = term not in self.partial
        assigned = Spelled(f"({self.local(term)} := {spelled.text})")
        return assigned, if_true.plus(term, always=always), if_false.plus(term, always=always)

    def _perhaps_evaluated(self, term: Term, seen: Seen) -> tuple[Spelled, Seen, Seen]:
        self.partial.add(term)
        name = self.local(term)
        spelled, if_true, if_false = self._evaluated(term, seen)
        fresh = f"({name} := {spelled.text})" if self._may_assign else spelled.at(s.OR)
        text = f"({name} if {name} is not None else {fresh})"
        return Spelled(text), if_true.join(seen), if_false.join(seen)

    def _evaluated(self, term: Term, seen: Seen) -> tuple[Spelled, Seen, Seen]:
        match term.node:
            case e.Unary(op="not"):
                return self._negation(term, seen)
            case e.Logic(op=op):
                return self._logic(op, term.args, seen)
            case e.Choice():
                return self._choice(term, seen)
            case e.Quantifier() as node:
                spelled, after = self._quantifier(node, term, seen)
            case _:
                spelled, after = self._plain(term, seen)
        return spelled, after, after

    def _negation(self, term: Term, seen: Seen) -> tuple[Spelled, Seen, Seen]:
        (arg,) = term.args
        if isinstance(arg.node, e.Among) and arg not in seen.perhaps:
            item, after = self.value(arg.args[0], seen)
            members = arg.node.members
            return s.among(item, members, arg.args[0].type, negated=True), after, after
        if isinstance(arg.node, e.IsNone) and arg not in seen.perhaps:
            item, after = self.value(arg.args[0], seen)
            return s.compare("is not", item, Spelled("None")), after, after
        spelled, if_true, if_false = self.test(arg, seen)
        return s.negation(spelled), if_false, if_true

    def _logic(self, op: str, args: tuple[Term, ...], seen: Seen) -> tuple[Spelled, Seen, Seen]:
        operands: list[Spelled] = []
        ended: Seen | None = None
        for arg in args:
            spelled, if_true, if_false = self.test(arg, seen)
            operands.append(spelled)
            seen, out = (if_true, if_false) if op == "and" else (if_false, if_true)
            ended = out if ended is None else ended.join(out)
        ended = ended or seen
        return s.logic(op, operands), *((seen, ended) if op == "and" else (ended, seen))

    def _choice(self, term: Term, seen: Seen) -> tuple[Spelled, Seen, Seen]:
        test, if_true, if_false = self.test(term.args[0], seen)
        then, then_true, then_false = self.test(term.args[1], if_true)
        otherwise, else_true, else_false = self.test(term.args[2], if_false)
        return (
            s.choice(test, then, otherwise),
            then_true.join(else_true),
            then_false.join(else_false),
        )

    def _quantifier(self, node: e.Quantifier, term: Term, seen: Seen) -> tuple[Spelled, Seen]:
        over, body = term.args
        simple = isinstance(over.node, (e.Input, e.MemoryRef)) or over in seen.always
        found = accepted(node, body)
        if simple and found is not None and isinstance(over.type, Vector):
            spelled, _ = self.value(over, seen)
            few = _few_members(node.kind, spelled, over.type, found)
            if few is not None:
                return few, seen
        iterable, after = self._without_assignment(over, seen)
        outer = dict(self.nodes.bound)
        self.nodes.bound[node.variable] = self.names.inner().new(node.variable)
        inside, within = self.value(body, after)
        again = within.perhaps - after.perhaps
        if again:  # the loop may come round: what it evaluates has a value from the second time on
            self.partial |= again
            inside, within = self.value(body, Seen(after.always, after.perhaps | again))
        spelled = self.nodes.spell(term, [iterable, inside])
        self.nodes.bound = outer
        return spelled, after.join(within)

    def _without_assignment(self, term: Term, seen: Seen) -> tuple[Spelled, Seen]:
        """Python allows no `:=` in what a comprehension goes over."""
        before, self._may_assign = self._may_assign, False
        spelled, _ = self.value(term, seen)
        self._may_assign = before
        return spelled, seen

    def _plain(self, term: Term, seen: Seen) -> tuple[Spelled, Seen]:
        if term.is_constant and is_array(term.type) and not isinstance(term.node, e.ConstantRef):
            return Spelled(self.nodes.array(term)), seen
        if term.is_settled and term.args and is_array(term.type) and self.nodes.is_settled:
            return Spelled(self.nodes.settled(term), s.PRIMARY), seen
        operands = []
        for arg in term.args:
            spelled, seen = self.value(arg, seen)
            operands.append(spelled)
        return self.nodes.spell(term, operands), seen


def _few_members(kind: str, over: Spelled, type_: Vector, found: frozenset[str]) -> Spelled | None:
    """A quantifier over a vector of an enum as `in` tests, if few members matter."""
    assert isinstance(type_.element, Enum)  # `accepted` looked
    members = type_.element.members
    if kind == "any":
        tests = [s.compare("in", Spelled(literal(m)), over) for m in members if m in found]
        op = "or"
    else:
        tests = [s.compare("not in", Spelled(literal(m)), over) for m in members if m not in found]
        op = "and"
    if not 0 < len(tests) <= FEW:
        return None
    return tests[0] if len(tests) == 1 else s.logic(op, tests)


def _wanted(term: Term) -> str:
    match term.node:
        case e.Call(operator=operator):
            return operator.lower()
        case e.Builtin(name="finite" | "float"):
            return _wanted(term.args[0])
        case e.Builtin(name=name):
            return f"{name}_value"
        case e.Binary() | e.Unary():
            return "pose_value" if isinstance(term.type, Pose) else "value"
        case e.Logic() | e.Quantifier():
            return "holds"
    return "value"
