"""Random well-typed expressions as texts, over the names of one subsystem."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from random import Random

MODES = ("u", "c", "g", "s")
SIDES = ("left", "right")
TYPES = (
    "bool", "int", "real", "real[m]", "real[s]", "Mode", "Side", "vector[3, m]", "vector[2, Mode]",
    "vector[2]", "point[B]", "pose[B, E]", "wrench[E]", "list[real[m]]", "list[Reading]", "Reading",
    "optional[real[m]]", "optional[Mode]",
)  # fmt: skip
UNIT = {"real": "", "real[m]": "[m]", "real[s]": "[s]"}
CONSTANTS = ("limit", "gain", "whole", "first")
EIGHTHS = ("0.125", "0.25", "0.5", "0.75", "1.0", "1.5", "2.0", "0.3", "0.1")


@dataclass(slots=True)
class Scope:
    """Names by type. Texts of `safe` have a value whenever they are read, `arrivals` may not."""

    safe: dict[str, list[str]] = field(default_factory=dict)
    inputs: list[tuple[str, str]] = field(default_factory=list)
    """Texts and types of all inputs, for `fresh` and `present`."""
    absent: list[tuple[str, str]] = field(default_factory=list)
    """Those that may be without a value."""
    clock: bool = True

    def add(self, type_: str, text: str) -> None:
        self.safe.setdefault(type_, []).append(text)


class Phrases:
    """Makes expressions; each is in brackets, so that it can stand anywhere."""

    def __init__(self, rng: Random, scope: Scope, careless: int = 0, trusting: int = 0) -> None:
        """`careless`: of a hundred reads of an input that may be absent, how many do not ask;
        `trusting`: the same for optional values and lists that may be empty."""
        self.rng = rng
        self.scope = scope
        self.careless = careless
        self.trusting = trusting
        self.depth_of_loops = 0

    def chance(self, percent: int) -> bool:
        return self.rng.randrange(100) < percent

    def one(self, options: Sequence[str]) -> str:
        return self.rng.choice(options)

    # Values ---------------------------------------------------------------------------

    def value(self, type_: str, depth: int = 2) -> str:
        """An expression where a value of the type is expected."""
        if depth > 0 and self.chance(60):
            made = self.composite(type_, depth - 1)
            if made:
                return made
        named = self.name(type_)
        return named if named and self.chance(70) else self.literal(type_, depth)

    def rooted(self, type_: str, depth: int = 1) -> str:
        """An expression that has its type by itself."""
        if depth > 0 and type_ in UNIT and self.chance(40):
            return self.number(type_, depth - 1)
        return self.name(type_) or self.literal(type_, 0)

    def known(self, type_: str) -> str:
        """A name of the type, or else a value that is written out."""
        return self.name(type_) or self.literal(type_, 0)

    def name(self, type_: str) -> str:
        """A name of the type; empty if there is none."""
        options = list(self.scope.safe.get(type_, ()))
        absent = [text for text, t in self.scope.absent if t == type_]
        if absent and self.chance(40):
            text = self.one(absent)
            if self.chance(self.careless):
                return text
            other = self.one(options) if options else self.literal(type_, 0)
            return f"({text} if {self.one(('present', 'fresh'))}({text}) else {other})"
        if len(options) > 1 and self.chance(85):
            options = [o for o in options if o not in CONSTANTS] or options
        return self.one(options) if options else ""

    def literal(self, type_: str, depth: int) -> str:
        """A value that is written out."""
        match type_:
            case "bool":
                return self.one(("True", "False"))
            case "int":
                return str(self.rng.randrange(4))
            case "Mode":
                return self.one(MODES)
            case "Side":
                return self.one(SIDES)
            case "pose[B, E]":
                return self.one((
                    "identity()", f"translation({self.metres()}, 0, 0.5[m])",
                    "pose([0, 0.25[m], 0], [0, 0, 0.6, 0.8])", "rotation([3, 0, -4], 40[deg])",
                    "translation(0, 0.5[m], 0) @ rpy(0.5[rad], 0, -1.5[rad])",
                ))  # fmt: skip
            case "Reading":
                return f"best(readings({self.rng.randrange(9)}))"
            case "list[Reading]":
                return f"readings({self.rng.randrange(9)})"
        if type_.startswith("optional"):
            inner = type_[len("optional[") : -1]
            return "None" if self.chance(50) else self.literal(inner, 0)
        if type_ in UNIT:
            return f"{self.one(EIGHTHS)}{UNIT[type_]}"
        return self.listed(type_, depth)

    def metres(self) -> str:
        return f"{self.one(('', '-'))}{self.one(EIGHTHS)}[m]"

    def listed(self, type_: str, depth: int) -> str:
        """A vector or list, item by item."""
        units = {
            "vector[3, m]": ["real[m]"] * 3,
            "point[B]": ["real[m]"] * 3,
            "vector[2]": ["real"] * 2,
            "vector[2, Mode]": ["Mode"] * 2,
            "list[real[m]]": ["real[m]"] * self.rng.randrange(3),
            "nonempty[real[m]]": ["real[m]"] * self.rng.randrange(1, 3),
        }
        if type_ == "wrench[E]":
            force, torque = f"{self.one(EIGHTHS)}[N]", f"{self.one(EIGHTHS)}[N*m]"
            return f"[{force}, 0, -{force}, 0, {torque}, 0]"
        items = [self.item(t, depth) for t in units[type_]]
        if type_.startswith("vector[3") and self.chance(6):
            items[self.rng.randrange(3)] = "_"
        return f"[{', '.join(items)}]"

    def item(self, type_: str, depth: int) -> str:
        if depth > 0 and self.chance(50):
            return self.rooted(type_, depth - 1)
        return self.known(type_) if self.chance(50) else self.literal(type_, 0)

    def composite(self, type_: str, depth: int) -> str:
        """Something computed; empty where the type has no operation."""
        if type_.startswith("optional"):
            return self.rooted(type_[len("optional[") : -1], depth)
        if self.chance(25):
            test, then = self.condition(depth), self.rooted(type_, depth)
            return f"({then} if {test} else {self.rooted(type_, depth)})"
        if type_ == "bool":
            return self.condition(depth)
        if type_ == "int":
            return self.whole(depth)
        if type_ in UNIT:
            return self.number(type_, depth)
        return self.compound(type_, depth)

    def compound(self, type_: str, depth: int) -> str:
        named = self.name(type_)
        if type_ == "Mode":
            return f"choose({self.rooted('Mode', 0)}, {self.rooted('int', 0)})"
        if type_ == "list[Reading]":
            return f"readings({self.rooted('int', depth)})"
        if type_ == "Reading":
            return f"best({self.rooted('list[Reading]', depth)})"
        if not named:
            return ""
        match type_:
            case "vector[3, m]" if self.chance(20) and (p := self.name("point[B]")):
                return f"({p} - {self.known('point[B]')})" if self.chance(50) else f"(3 * {p})"
            case "vector[3, m]" | "vector[2]":
                other = self.known(type_)
                return self.one((
                    f"({named} + {other})", f"({named} - {self.listed(type_, 0)})", f"-{named}",
                    f"({self.one(EIGHTHS)} * {named})", f"({named} / 2)",
                ))  # fmt: skip
            case "point[B]":
                X, move = self.known("pose[B, E]"), self.listed("vector[3, m]", 0)
                ways = [f"({named} + {move})", f"({named} - {move})", f"({named} + 2 * {named})"]
                return self.one((*ways, *([f"({X} @ {move})"] if X.isidentifier() else [])))
            case "list[real[m]]" if named.isidentifier():
                more = self.listed(type_, 0)
                ways = (f"({named} + {more})", f"({more} + {named}[1:])", f"{named}[1:]")
                return self.one(ways)
            case "wrench[E]":
                return self.one((f"({named} + {named})", f"-{named}", f"({named} * 0.5)"))
            case "pose[B, E]":
                return self.one((  # with the pose itself twice, what rounding does would grow
                    f"({named} @ X_EE)", f"({named} @ inverse(X_EE) @ X_EE)",
                    f"inverse(inverse({named}))", f"turned({named}, {self.rooted('int', 0)})",
                ))  # fmt: skip
        return ""

    def whole(self, depth: int) -> str:
        a, b = self.rooted("int", 0), self.rooted("int", 0)
        return self.one((
            f"({a} + {b})", f"({a} - {b})", f"({a} * 2)", f"(-{a})", f"min({a}, {b})",
            f"max({a}, {b}, 1)", f"abs({a} - 2)", f"({a} ** 2)",
            f"len({self.rooted('list[Reading]', depth)})", f"clamp({a}, -3, {b})",
            f"floor({self.rooted('real', depth)})", f"round({self.rooted('real', depth)})",
            f"sign({self.rooted(self.one(('real[m]', 'int')), depth)})",
        ))  # fmt: skip

    def number(self, type_: str, depth: int) -> str:
        """A real of a unit."""
        unit = UNIT[type_]
        a, b = self.rooted(type_, depth), self.rooted(type_, 0)
        ways = [
            f"({a} + {b})", f"({a} - {b})", f"({a} * {self.one(EIGHTHS)})", f"({a} / 4)", f"(-{a})",
            f"min({a}, {b})", f"max({a}, {b})", f"abs({a})", f"sqrt({a} * {a})",
            f"clamp({a}, -1.5{unit}, {b})", f"hypot({a}, {b})",
        ]  # fmt: skip
        if self.chance(3):
            ways = [f"({a} / {self.rooted('real', 0)})", f"sqrt(1.0{unit} * {a})"] if unit else ways
        if type_ == "real":
            ways += [f"sin({a} * 1[rad])", f"cos(atan2({a}, {b}) - pi / 2)"]
            ways += [f"wrap_angle(({a} + {self.one(('0', '3', '7.5'))}) * 1[rad]) / 1[rad]"]
            ways += [f"({self.rooted('int', 0)} / 2)", f"({self.rooted('real[m]', 0)} / 0.5[m])"]
        if type_ == "real[s]":
            ways += ["period", "elapsed"] if self.scope.clock else []
        if type_ == "real[m]":
            ways += self.lengths()
        return self.one(ways)

    def lengths(self) -> list[str]:
        v, r = self.name("vector[3, m]"), self.rooted("Reading", 0)
        ways = [f"{r}.d", f"widen({self.rooted('real[m]', 0)}, {self.rooted('real', 0)})"]
        if v and v.isidentifier():
            ways += [
                f"{v}[{self.rng.randrange(3)}]",
                f"{v}.{self.one(('x', 'y', 'z'))}",
                f"norm({v})",
            ]
        X = self.name("pose[B, E]")
        ways += [w for w in (self.there(), self.largest()) if w]
        p = self.name("point[B]")
        ways += [f"norm({p})", f"{p}.y"] if p and p.isidentifier() else []
        return ways + ([f"position({X}).z"] if X else [])

    def there(self) -> str:
        """What an optional length is, or another one."""
        named = self.name("optional[real[m]]")
        if not named or self.chance(self.trusting):
            return named
        test = self.one((f"{named} is not None", f"not {named} is None"))
        return f"({named} if {test} else {self.metres()})"

    def largest(self) -> str:
        """The greatest or least item of a list, if it has any."""
        kept = self.name("nonempty[real[m]]")
        named = kept or self.name("list[real[m]]")
        if not named or self.depth_of_loops:
            return ""
        kind, body = self.one(("argmax", "argmin")), self.one(("v", "abs(v)", "-v"))
        found = f"{kind}({body} for v in {named})"
        if named.isidentifier() and self.chance(30):
            found = f"{named}[0]"
        if kept or self.chance(self.trusting):
            return found
        return (
            f"({found} if {self.one(('len({}) > 0', 'len({}) != 0')).format(named)} else 0.25[m])"
        )

    # Conditions -----------------------------------------------------------------------

    def condition(self, depth: int = 2) -> str:
        """An expression of type bool."""
        if depth <= 0 or self.chance(25):
            return self.atom()
        parts = [self.condition(depth - 1) for _ in range(2)]
        return self.one((
            f"({parts[0]} and {parts[1]})", f"({parts[0]} or {parts[1]})", f"(not {parts[0]})",
            f"({parts[0]} if {self.atom()} else {parts[1]})",
        ))  # fmt: skip

    def atom(self) -> str:
        """A question without `and`, `or` and `not`."""
        ways = [
            self.arrival,
            self.threshold,
            self.threshold,
            self.mode,
            self.quantified,
            self.close,
        ]
        ways += [self.flag, self.asked, self.difference, self.missing]
        return self.rng.choice(ways)()

    def arrival(self) -> str:
        if not self.scope.inputs:
            return self.threshold()
        text, _ = self.rng.choice(self.scope.inputs)
        return f"{self.one(('fresh', 'fresh', 'present'))}({text})"

    def flag(self) -> str:
        named = self.name("bool")
        if self.scope.clock and self.chance(20):
            return "entered"
        return named or self.threshold()

    def threshold(self) -> str:
        """A number beside a constant."""
        op, type_ = (
            self.one(("<", "<=", ">", ">=")),
            self.one(("int", "real", "real[m]", "real[s]")),
        )
        left = self.rooted(type_, self.rng.randrange(2))
        limit = self.literal(type_, 0)
        if type_ == "real[s]" and self.scope.clock:
            left, limit = "elapsed", f"0.{self.rng.randrange(1, 4)}[s]"
        if self.chance(20):
            least = "0" if type_ == "int" else f"0{UNIT[type_]}"
            return f"({least} {self.one(('<', '<='))} {left} {self.one(('<', '<='))} {limit})"
        if type_ == "int" and self.chance(30):
            op = self.one(("==", "!="))
        return f"({left} {op} {limit})"

    def difference(self) -> str:
        """Two numbers beside each other."""
        op, type_ = self.one(("<", "<=", ">", ">=")), self.one(("int", "real", "real[m]"))
        return f"({self.rooted(type_)} {op} {self.rooted(type_, 0)})"

    def mode(self) -> str:
        item = self.name("Mode")
        if not item:
            return self.threshold()
        some = self.rng.sample(MODES, self.rng.randrange(1, 4))
        return self.one((
            f"({item} == {some[0]})", f"({item} != {some[0]})",
            f"({item} in {{{', '.join(some)}}})", f"({item} not in {{{', '.join(some)}}})",
        ))  # fmt: skip

    def quantified(self) -> str:
        """All or any of the items of a vector or list."""
        over = self.one(("vector[2, Mode]", "list[real[m]]", "list[Reading]", "vector[3, m]"))
        named = self.name(over)
        if not named or self.depth_of_loops:
            return self.flag() if self.depth_of_loops < 2 else "True"
        self.depth_of_loops += 1
        other = self.atom() if self.chance(25) else ""
        self.depth_of_loops -= 1
        body = {
            "vector[2, Mode]": f"v in {{{', '.join(self.rng.sample(MODES, 2))}}}",
            "list[Reading]": self.one(("v.d > 0.5[m]", "v.mode == c", "far(v.d)")),
        }.get(over, f"v {self.one(('<', '>='))} {self.one(EIGHTHS)}[m]")
        body = f"{body} {self.one(('and', 'or'))} {other}" if other else body
        return f"{self.one(('all', 'any'))}({body} for v in {named})"

    def close(self) -> str:
        """`near`, of numbers, vectors and poses."""
        type_ = self.one(("real[m]", "vector[3, m]", "point[B]", "pose[B, E]"))
        named = self.name(type_)
        if not named:
            return self.threshold()
        limits = "0.3[m], 100[deg]" if type_ == "pose[B, E]" else self.one(("0.25[m]", "1[m]"))
        other = self.known(type_) if self.chance(50) else self.literal(type_, 0)
        return f"near({named}, {other}, {limits})"

    def missing(self) -> str:
        """Whether something optional is there, and what it is."""
        mode, length = self.name("optional[Mode]"), self.name("optional[real[m]]")
        ways, found = [], self.largest()
        if found:
            ways += [f"({found} {self.one(('<', '>='))} 0.5[m])"] * 2
        if mode:
            ways += [f"({mode} is None)", f"({mode} is not None and {mode} == {self.one(MODES)})"]
        if length:
            ways += [f"({length} is not None)", f"({length} is None or {length} < 0.5[m])"]
        return self.one(ways) if ways else self.flag()

    def asked(self) -> str:
        """A predicate that is an operator."""
        q = self.name("vector[3, m]")
        if q and self.chance(50):
            return f"holds({q})"
        return f"far({self.rooted('real[m]', 0)})"
