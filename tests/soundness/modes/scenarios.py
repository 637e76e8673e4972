"""What modes mean, case by case: a small machine, the orders that it gets, and what it does.

A line of a script is a period: the order that comes, the state after it, and values of memory after
it. `!` begins what goes wrong instead: the cause and how many rows apply. `skip 2` lets so many
periods pass without a step. A period takes a second, so that clocks count in whole seconds.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import yaml

ORDERS = ("none", "a", "b", "c", "d")

SYSTEM = """\
specc: {version}
system: scenario
types: {{Order: "enum[none, a, b, c, d]"}}
agents:
  cell:
    real_receptors: {{panel: {{y: {{order: Order}}}}}}
    virtual_receptors:
      desk:
        rate: 1 Hz
        uses: [panel]
        x: {{R: {{order: Order}}}}
        y: {{c: {{order: Order}}}}
        through: {{y.c.order: x.R.order}}
    control:
      rate: 1 Hz
      x: {{desk: {{order: {{type: Order, init: none}}}}}}
"""

MACHINE = """\
conditions:
  initial: {is_a: x.desk.order == a, is_b: x.desk.order == b, is_c: x.desk.order == c,
            is_d: x.desk.order == d}
  terminal: {came: x.desk.order != none, a_came: x.desk.order == a, b_came: x.desk.order == b,
             c_came: x.desk.order == c}
functions:
  keep: {t: elapsed(W), first: entered(W), s: elapsed}
memory:
  t: {type: "real[s]", init: 0}
  s: {type: "real[s]", init: 0}
  first: {type: bool, init: False}
behaviours:
  wait: {functions: [keep], terminal: came}
states: {A: wait, B: wait, P: wait}
initial_state: A
"""
"""What every machine has, unless it says otherwise: W is a mode, P a state outside of it."""


@dataclass(frozen=True, slots=True)
class Case:
    """`machine` is YAML that stands in the place of parts of `MACHINE`."""

    name: str
    rule: str
    machine: str
    script: str
    refused: str = ""
    """The code with which the compiler refuses it, and words of the finding."""

    @property
    def control(self) -> dict[str, Any]:
        """The machine as data."""
        made: dict[str, Any] = yaml.load(MACHINE, yaml.BaseLoader)
        for key, part in yaml.load(self.machine, yaml.BaseLoader).items():
            whole = isinstance(part, dict) and key not in ("states", "modes")
            made[key] = {**made.get(key, {}), **part} if whole else part
        return made

    @property
    def text(self) -> str:
        """The specification."""
        lines = yaml.dump(self.control, default_flow_style=None, sort_keys=False, width=1000)
        indented = "".join(f"      {line}\n" for line in lines.splitlines())
        return SYSTEM.format(version=VERSION) + indented


VERSION = "1.3"

CASES = (
    Case(
        "a row to a state inside goes on counting",
        "`elapsed(m)` is the number of periods that passed while m was active, times the period.",
        """
modes: {W: {states: [A, B], initial: A}}
transitions:
  - [A, terminal, always, B]
  - [B, terminal, is_a, A]
  - [B, terminal, otherwise, P]
  - [P, terminal, always, A]
""",
        """
none | A | t=0 s=0 first=True
none | A | t=1 s=1 first=False
a    | B | t=2 s=0 first=False
none | B | t=3 s=1
a    | A | t=4 s=0 first=False
""",
    ),
    Case(
        "a row to the same state goes on counting",
        "`elapsed(m)` is the number of periods that passed while m was active, times the period.",
        """
modes: {W: {states: [A, B], initial: A}}
transitions:
  - [A, terminal, is_a, A]
  - [A, terminal, otherwise, B]
  - [B, terminal, always, P]
  - [P, terminal, always, A]
""",
        """
none | A | t=0 first=True
a    | A | t=1 s=0 first=False
a    | A | t=2 s=0 first=False
""",
    ),
    Case(
        "naming the mode inside of it enters it anew",
        "Naming m as next state inside m enters it anew.",
        """
modes: {W: {states: [A, B], initial: A}}
transitions:
  - [A, terminal, always, B]
  - [B, terminal, is_a, W]
  - [B, terminal, otherwise, P]
  - [P, terminal, always, W]
""",
        """
none | A | t=0 first=True
none | A | t=1
a    | B | t=2 first=False
none | B | t=3
a    | A | t=0 first=True
none | A | t=1 first=False
""",
    ),
    Case(
        "an entry from outside begins anew",
        "Every entry except by `resume` sets it to zero.",
        """
modes: {W: {states: [A, B], initial: A}}
transitions:
  - [[A, B], terminal, always, P]
  - [P, terminal, is_a, W]
  - [P, terminal, otherwise, B]
""",
        """
none | A | t=0 first=True
none | A | t=1
a    | P | t=2 first=False
none | P | t=2
a    | A | t=0 first=True
b    | P | t=1 first=False
b    | B | t=0 first=True
none | B | t=1 first=False
""",
    ),
    Case(
        "resume keeps the clock",
        "`resume(mode)` goes back to the innermost state that was left; `entered(m)` is never true"
        " after `resume`.",
        """
modes: {W: {states: [A, B], initial: A}}
transitions:
  - [A, terminal, is_a, B]
  - [A, terminal, otherwise, P]
  - [B, terminal, always, P]
  - [P, terminal, always, resume(W)]
""",
        """
none | A | t=0 first=True
a    | B | t=1
none | B | t=2
b    | P | t=3 s=0
none | P | t=3 s=1
none | P | t=3 s=2
a    | B | t=3 s=0 first=False
none | B | t=4 s=1 first=False
b    | P | t=5
a    | B | t=5
""",
    ),
    Case(
        "the first resume leads to initial",
        "`resume(mode)` goes back to the innermost state that was left, or to `initial` the first"
        " time.",
        """
initial_state: P
modes: {W: {states: [A, B], initial: B}}
transitions:
  - [[A, B], terminal, always, P]
  - [P, terminal, is_a, A]
  - [P, terminal, otherwise, resume(W)]
""",
        """
none | P | t=0 first=False
b    | B | t=0 first=False
none | B | t=1 first=False
b    | P | t=2
a    | A | t=0 first=True
a    | P | t=1
b    | A | t=1 first=False
""",
    ),
    Case(
        "history is written by rows that leave, not by others",
        "Only a row that leaves m writes its history.",
        """
modes: {W: {states: [A, B], initial: A}}
transitions:
  - [A, terminal, is_a, B]
  - [A, terminal, otherwise, P]
  - [B, terminal, is_a, A]
  - [B, terminal, is_b, P]
  - [B, terminal, otherwise, W]
  - [P, terminal, is_a, resume(W)]
  - [P, terminal, otherwise, A]
""",
        """
none | A |
a    | B |
a    | A |
b    | P |
a    | A |
a    | B |
c    | A | t=0
b    | P |
a    | A | t=1
a    | B |
b    | P |
b    | A | t=0
b    | P |
a    | A |
""",
    ),
    Case(
        "history survives an entry by name until the mode is left again",
        "Only a row that leaves m writes its history.",
        """
modes: {W: {states: [A, B], initial: A}}
transitions:
  - [A, terminal, is_a, B]
  - [A, terminal, otherwise, P]
  - [B, terminal, always, P]
  - [P, terminal, is_a, resume(W)]
  - [P, terminal, is_b, W]
  - [P, terminal, otherwise, P]
""",
        """
none | A |
a    | B |
a    | P |
c    | P |
b    | A | first=True
b    | P |
a    | A | first=False
""",
    ),
    Case(
        "a row that leaves an inner mode only writes the history of that one",
        "Only a row that leaves m writes its history.",
        """
states: {A: wait, B: wait, C: wait, P: wait}
modes: {W: {states: [I, C], initial: I}, I: {states: [A, B], initial: A}}
transitions:
  - [A, terminal, always, B]
  - [B, terminal, always, C]
  - [C, terminal, always, P]
  - [P, terminal, is_a, resume(W)]
  - [P, terminal, otherwise, resume(I)]
""",
        """
none | A | t=0
a    | B | t=1
a    | C | t=2
a    | P | t=3
a    | C | t=3
a    | P | t=4
b    | B |
""",
    ),
    Case(
        "resuming an outer mode resumes the modes inside",
        "`resume(outer)` resumes every mode inside, down to the innermost state.",
        """
states: {A: wait, B: wait, C: wait, P: wait}
memory: {i: {type: "real[s]", init: 0}, inner: {type: bool, init: False}}
functions: {keep: {t: elapsed(W), first: entered(W), i: elapsed(I), inner: entered(I), s: elapsed}}
modes: {W: {states: [C, I], initial: C}, I: {states: [A, B], initial: A}}
initial_state: C
transitions:
  - [C, terminal, always, I]
  - [A, terminal, always, B]
  - [B, terminal, always, P]
  - [P, terminal, always, resume(W)]
""",
        """
none | C | t=0 i=0 first=True inner=False
a    | A | t=1 i=0 first=False inner=True
none | A | t=2 i=1 inner=False
a    | B | t=3 i=2
a    | P | t=4 i=3
none | P | t=4 i=3
a    | B | t=4 i=3 s=0 first=False inner=False
none | B | t=5 i=4 s=1
""",
    ),
    Case(
        "resuming an inner mode from outside enters the modes around it",
        "`resume(inner)` resumes that mode and those inside; every other entry sets a clock to"
        " zero.",
        """
states: {A: wait, B: wait, P: wait}
memory: {i: {type: "real[s]", init: 0}, inner: {type: bool, init: False}}
functions: {keep: {t: elapsed(W), first: entered(W), i: elapsed(I), inner: entered(I), s: elapsed}}
modes: {W: {states: [I]}, I: {states: [A, B], initial: A}}
transitions:
  - [A, terminal, always, B]
  - [B, terminal, always, P]
  - [P, terminal, always, resume(I)]
""",
        """
none | A | t=0 i=0 first=True inner=True
a    | B | t=1 i=1 first=False inner=False
a    | P | t=2 i=2
none | P | t=2 i=2
a    | B | t=0 i=2 first=True inner=False
none | B | t=1 i=3 first=False
""",
    ),
    Case(
        "a mode that contains modes is entered with them",
        "A mode as next state means its `initial`; every entry except by `resume` sets the clock"
        " to zero.",
        """
states: {A: wait, B: wait, P: wait}
memory: {i: {type: "real[s]", init: 0}, inner: {type: bool, init: False}}
functions: {keep: {t: elapsed(W), first: entered(W), i: elapsed(I), inner: entered(I), s: elapsed}}
modes: {W: {states: [A, I], initial: I}, I: {states: [B], initial: B}}
transitions:
  - [A, terminal, always, I]
  - [B, terminal, is_a, W]
  - [B, terminal, is_b, I]
  - [B, terminal, otherwise, P]
  - [P, terminal, always, W]
""",
        """
none | A | t=0 i=0 first=True inner=False
a    | B | t=1 i=0 first=False inner=True
none | B | t=2 i=1 inner=False
b    | B | t=3 i=0 first=False inner=True
none | B | t=4 i=1
a    | B | t=0 i=0 first=True inner=True
none | B | t=1 i=1
c    | P | t=2 i=2 first=False inner=False
a    | B | t=0 i=0 first=True inner=True
""",
    ),
    Case(
        "the error of the outermost mode comes first",
        "Where several hold at once, the outermost mode's comes first.",
        """
states:
  A: {functions: [keep], terminal: never, error: {own: x.desk.order == a}}
  B: wait
  C: wait
  P: wait
modes:
  W: {states: [I], error: {outer: x.desk.order == a}}
  I: {states: [A], error: {inner: "x.desk.order in {a, b}"}}
transitions:
  - [A, own, always, P]
  - [W, outer, always, B]
  - [I, inner, always, C]
  - [[B, C, P], terminal, always, A]
""",
        """
none | A |
a    | B | cause=outer
a    | A |
b    | C | cause=inner
""",
    ),
    Case(
        "errors of one mode are asked in the order in which they are written",
        "Then the order in which they are written: that one is the cause.",
        """
states: {A: {functions: [keep], terminal: came}, B: wait, C: wait, P: wait}
modes: {W: {states: [A], error: {late: "x.desk.order in {a, b}", hot: "x.desk.order in {a, c}"}}}
transitions:
  - [W, hot, always, B]
  - [W, late, always, C]
  - [A, terminal, always, P]
  - [[B, C, P], terminal, always, A]
""",
        """
none | A |
a    | C | cause=late
a    | A |
c    | B | cause=hot
a    | A |
d    | P | cause=terminal
""",
    ),
    Case(
        "a behaviour has several errors, asked in their order, after those of its modes",
        "A behaviour, too, may have several named ones. A mode's error conditions are evaluated"
        " before the state's own.",
        """
behaviours:
  work:
    functions: [keep]
    terminal: came
    error: {x2: "x.desk.order in {a, b}", x1: "x.desk.order in {a, b, c}"}
states: {A: work, B: wait, C: wait, P: wait}
modes: {W: {states: [A], error: {m: x.desk.order == a}}}
transitions:
  - [A, x1, always, B]
  - [A, x2, always, C]
  - [W, m, always, P]
  - [A, terminal, always, A]
  - [[B, C, P], terminal, always, A]
""",
        """
none | A |
a    | P | cause=m
a    | A |
b    | C | cause=x2
a    | A |
c    | B | cause=x1
a    | A |
d    | A | cause=terminal
""",
    ),
    Case(
        "a shared behaviour has the errors of the mode only in the states of the mode",
        "They belong to states, so a behaviour that is shared across modes stays one.",
        """
modes: {W: {states: [A], error: {stop: x.desk.order == a}}}
transitions:
  - [W, stop, always, P]
  - [A, terminal, always, B]
  - [B, terminal, always, A]
  - [P, terminal, always, B]
""",
        """
none | A |
a    | P | cause=stop
a    | B | cause=terminal
a    | A | cause=terminal
b    | B | cause=terminal
""",
    ),
    Case(
        "error covers the causes that no row names",
        "`error` covers the causes that no row of that state names.",
        """
states: {A: wait, B: wait, C: wait, P: wait}
modes:
  W: {states: [A], error: {e1: x.desk.order == a, e2: x.desk.order == b, e3: x.desk.order == c}}
transitions:
  - [W, e1, always, B]
  - [W, error, always, C]
  - [A, terminal, always, P]
  - [[B, C, P], terminal, always, A]
""",
        """
none | A |
a    | B |
a    | A |
b    | C |
a    | A |
c    | C |
a    | A |
d    | P | cause=terminal
""",
    ),
    Case(
        "a cause that one state names is covered by error in the others",
        "`error` covers the causes that no row of that state names.",
        """
states: {A: wait, B: wait, C: wait, P: wait}
modes: {W: {states: [A, B], error: {e1: x.desk.order == a, e2: x.desk.order == b}}}
transitions:
  - [A, e1, always, C]
  - [W, error, always, P]
  - [A, terminal, always, B]
  - [B, terminal, always, A]
  - [C, terminal, is_a, A]
  - [C, terminal, otherwise, B]
  - [P, terminal, is_a, A]
  - [P, terminal, otherwise, B]
""",
        """
none | A |
a    | C |
a    | A |
b    | P |
b    | B |
a    | P |
b    | B |
b    | P |
""",
    ),
    Case(
        "a named cause must be complete by its own rows",
        "A named cause that has rows of its own must be complete by them.",
        """
memory: {n: {type: int, init: 0}}
functions: {keep: {t: elapsed(W), first: entered(W), s: elapsed, n: "min(n + 1, 2)"}}
conditions: {initial: {few: n < 2}}
modes: {W: {states: [A, B], initial: A, error: {e1: x.desk.order == a}}}
transitions:
  - [W, e1, few, P]
  - [W, error, always, P]
  - [A, terminal, always, B]
  - [B, terminal, always, A]
  - [P, terminal, always, P]
""",
        """
none | A |
none | A |
a    | ! e1 0 |
""",
        "E0601 `A`",
    ),
    Case(
        "rows of a mode and of its states are one table",
        "Rows of a mode and of its states form one table; `otherwise` negates all other rows of"
        " that state and cause.",
        """
modes: {W: {states: [A, B], initial: A}}
transitions:
  - [W, terminal, is_a, P]
  - [A, terminal, is_b, A]
  - [A, terminal, otherwise, B]
  - [B, terminal, otherwise, A]
  - [P, terminal, always, W]
""",
        """
none | A |
b    | A | s=0
a    | P |
a    | A |
c    | B |
a    | P |
a    | A |
c    | B |
b    | A |
""",
    ),
    Case(
        "a row of a state does not override that of its mode",
        "Nothing overrides. Per state and cause exactly one row applies, and that is proved.",
        """
modes: {W: {states: [A, B], initial: A, error: {e: x.desk.order == a}}}
transitions:
  - [W, e, always, P]
  - [B, e, always, A]
  - [A, terminal, always, B]
  - [B, terminal, always, A]
  - [P, terminal, always, W]
""",
        """
none | A |
b    | B |
a    | ! e 2 |
""",
        "E0602 state `B`",
    ),
    Case(
        "a missing way is refused, with the state",
        "A missing way is E0601 with the state named.",
        """
modes: {W: {states: [A, B], initial: A, error: {e: x.desk.order == a}}}
transitions:
  - [A, e, always, P]
  - [B, e, is_b, P]
  - [A, terminal, always, B]
  - [B, terminal, always, A]
  - [P, terminal, always, W]
""",
        """
none | A |
b    | B |
a    | ! e 0 |
""",
        "E0601 state `B`",
    ),
    Case(
        "conditions are first evaluated one period after entry",
        "Conditions are first evaluated one period after entry, `resume` included.",
        """
modes: {W: {states: [A, B], initial: A, error: {e: x.desk.order == a}}}
transitions:
  - [W, e, always, P]
  - [A, terminal, always, B]
  - [B, terminal, always, A]
  - [P, terminal, is_b, W]
  - [P, terminal, otherwise, resume(W)]
""",
        """
a    | A | s=0
a    | P | t=1
a    | A | t=1 s=0
a    | P | t=2
b    | A | t=0
b    | B | t=1
a    | P | t=2
a    | B | t=2
a    | P | t=3
""",
    ),
    Case(
        "the row that is taken reads the clock as it was",
        "Initial conditions of the row that is taken read the old values.",
        """
conditions: {initial: {old: "elapsed(W) >= 2[s]"}}
states: {A: wait, B: wait}
modes: {W: {states: [A, B], initial: A}}
transitions:
  - [A, terminal, old, W]
  - [A, terminal, otherwise, B]
  - [B, terminal, always, A]
""",
        """
none | A | t=0
a    | B | t=1
a    | A | t=2
a    | A | t=0 first=True
a    | B | t=1
""",
    ),
    Case(
        "a mode ends after its time, however its states change",
        "`elapsed(m)` is the number of periods that passed while m was active, times the period.",
        """
modes: {W: {states: [A, B], initial: A, error: {tired: "elapsed(W) > 2[s]"}}}
transitions:
  - [W, tired, always, P]
  - [A, terminal, always, B]
  - [B, terminal, always, A]
  - [P, terminal, is_a, W]
  - [P, terminal, otherwise, resume(W)]
""",
        """
none | A | t=0
a    | B | t=1
none | B | t=2
none | P | t=3 cause=tired
b    | B | t=3
none | P | t=4 cause=tired
a    | A | t=0
""",
    ),
    Case(
        "the clock of a mode stands still outside of it, and can be read there",
        "`elapsed(m)` is the number of periods that passed while m was active, times the period.",
        """
conditions: {initial: {long: "elapsed(W) >= 2[s]"}}
modes: {W: {states: [A, B], initial: A}}
transitions:
  - [A, terminal, always, P]
  - [B, terminal, always, P]
  - [P, terminal, long, B]
  - [P, terminal, otherwise, resume(W)]
""",
        """
none | A | t=0
a    | P | t=1
none | P | t=1
a    | A | t=1
a    | P | t=2
a    | B | t=0 first=True
""",
    ),
    Case(
        "skipped periods count for the modes that are active",
        "The work cycle keeps for each mode the periods passed (skipped ones included).",
        """
modes: {W: {states: [A, B], initial: A}}
transitions:
  - [[A, B], terminal, always, P]
  - [P, terminal, always, resume(W)]
""",
        """
none | A | t=0
skip 2
none | A | t=3 s=3
skip 1
a    | P | t=5 s=0
skip 4
none | P | t=5 s=5
a    | A | t=5 s=0
none | A | t=6
""",
    ),
    Case(
        "memory is as it is at resume",
        "Memory is as it is, `elapsed` of the state begins anew.",
        """
memory: {n: {type: int, init: 0}}
functions: {keep: {t: elapsed(W), first: entered(W), s: elapsed}, count: {n: "min(n + 1, 9)"}}
behaviours: {counting: {functions: [keep, count], terminal: came}}
states: {A: counting, B: wait, P: counting}
modes: {W: {states: [A, B], initial: A}}
transitions:
  - [A, terminal, always, B]
  - [B, terminal, always, P]
  - [P, terminal, always, resume(W)]
""",
        """
none | A | n=1 s=0
none | A | n=2 s=1
a    | B | n=2 s=0
a    | P | n=3 s=0
none | P | n=4
a    | B | n=4 s=0
""",
    ),
    Case(
        "a row may be that of a list of states and modes",
        "Rows of a mode and of its states form one table.",
        """
states: {A: wait, B: wait, C: wait, P: wait}
modes: {W: {states: [A, B], initial: A}}
transitions:
  - [[W, C], terminal, is_a, P]
  - [[A, C], terminal, otherwise, B]
  - [B, terminal, otherwise, C]
  - [P, terminal, always, W]
""",
        """
none | A |
b    | B | t=1
b    | C | t=2
b    | B | t=0 first=True
a    | P |
a    | A |
""",
    ),
    Case(
        "a declared error condition is named by the mode",
        "A mode's error: named conditions in place, or the name of a declared one.",
        """
conditions: {error: {lost: x.desk.order == a}}
modes: {W: {states: [A, B], initial: A, error: lost}}
transitions:
  - [W, lost, always, P]
  - [A, terminal, always, B]
  - [B, terminal, always, A]
  - [P, terminal, always, W]
""",
        """
none | A |
b    | B |
a    | P | cause=lost
a    | A |
""",
    ),
    Case(
        "modes beside each other have clocks and histories of their own",
        "The work cycle keeps for each mode the last state left and the periods passed.",
        """
states: {A: wait, B: wait, C: wait, P: wait}
memory: {i: {type: "real[s]", init: 0}, inner: {type: bool, init: False}}
functions: {keep: {t: elapsed(W), first: entered(W), i: elapsed(V), inner: entered(V), s: elapsed}}
modes: {W: {states: [A, B], initial: A}, V: {states: [C, P], initial: C}}
transitions:
  - [A, terminal, always, B]
  - [B, terminal, always, V]
  - [C, terminal, always, P]
  - [P, terminal, is_a, resume(W)]
  - [P, terminal, otherwise, P]
""",
        """
none | A | t=0 i=0 first=True inner=False
a    | B | t=1 i=0
a    | C | t=2 i=0 first=False inner=True
none | C | t=2 i=1 inner=False
a    | P | t=2 i=2
a    | B | t=2 i=3
none | B | t=3 i=3
a    | C | t=4 i=0 inner=True
""",
    ),
    Case(
        "a row inside an outer mode may resume one beside it",
        "`resume(m)` inside m is an error; a row leaves only the modes that its next state is"
        " not in.",
        """
states: {A: wait, B: wait, C: wait}
memory: {i: {type: "real[s]", init: 0}, inner: {type: bool, init: False}}
functions: {keep: {t: elapsed(W), first: entered(W), i: elapsed(I), inner: entered(I), s: elapsed}}
modes: {W: {states: [I, C], initial: I}, I: {states: [A, B], initial: A}}
transitions:
  - [A, terminal, always, B]
  - [B, terminal, always, C]
  - [C, terminal, is_a, resume(I)]
  - [C, terminal, is_b, W]
  - [C, terminal, otherwise, C]
""",
        """
none | A | t=0 i=0
a    | B | t=1 i=1
a    | C | t=2 i=2
c    | C | t=3 i=2
a    | B | t=4 i=2 first=False inner=False
a    | C | t=5 i=3
b    | A | t=0 i=0 first=True inner=True
""",
    ),
    Case(
        "a machine without modes is a machine with modes",
        "Files of 1.2 keep their meaning.",
        """
functions: {keep: {t: elapsed, first: entered, s: elapsed}}
conditions: {error: {bad: x.desk.order == b}}
behaviours: {wait: {functions: [keep], terminal: came, error: bad}}
transitions:
  - [[A, B, P], error, always, P]
  - [A, terminal, is_a, B]
  - [A, terminal, otherwise, A]
  - [[B, P], terminal, always, A]
""",
        """
none | A | s=0 first=True
a    | B | s=0
none | B | s=1 first=False
b    | P | s=0
c    | A |
c    | A | s=0
""",
    ),
)


TABLE = """
transitions:
  - [A, terminal, always, B]
  - [B, terminal, is_a, A]
  - [B, terminal, otherwise, P]
  - [P, terminal, always, A]
"""
REFUSED = (
    Case(
        "a mode has the name of a state",
        "Names of states and modes are distinct.",
        "modes: {B: {states: [A], initial: A}}" + TABLE,
        "",
        "E0205 `B`",
    ),
    Case(
        "a state is in two modes",
        "Together the modes form a forest.",
        "modes: {W: {states: [A, B], initial: A}, V: {states: [B], initial: B}}" + TABLE,
        "",
        "E0604 `B`",
    ),
    Case(
        "a mode is in itself",
        "Together the modes form a forest.",
        "modes: {W: {states: [A, V], initial: A}, V: {states: [W, B], initial: B}}" + TABLE,
        "",
        "E0604 inside itself",
    ),
    Case(
        "two modes on one path have an error of one name",
        "Names of error conditions along one path of the tree are distinct.",
        "modes:\n"
        "  W: {states: [V], error: {e: x.desk.order == b}}\n"
        "  V: {states: [A], error: {e: x.desk.order == c}}" + TABLE,
        "",
        "E0205 `e`",
    ),
    Case(
        "a behaviour has an error of the name of one of its mode",
        "Names of error conditions along one path of the tree are distinct.",
        "modes: {W: {states: [A], error: {e: x.desk.order == b}}}\n"
        "behaviours: {wait: {functions: [keep], terminal: came, error: {e: x.desk.order == c}}}"
        + TABLE,
        "",
        "E0205 `e`",
    ),
    Case(
        "an error is called error",
        "None is `error` or `terminal`.",
        "modes: {W: {states: [A], error: {error: x.desk.order == b}}}" + TABLE,
        "",
        "E0221 `error`",
    ),
    Case(
        "an error is called terminal",
        "None is `error` or `terminal`.",
        "modes: {W: {states: [A], error: {terminal: x.desk.order == b}}}" + TABLE,
        "",
        "E0221 `terminal`",
    ),
    Case(
        "a mode is resumed inside of it",
        "`resume(m)` inside m is an error.",
        """
modes: {W: {states: [A, B], initial: A}}
transitions:
  - [A, terminal, always, B]
  - [B, terminal, is_a, resume(W)]
  - [B, terminal, otherwise, P]
  - [P, terminal, always, A]
""",
        "",
        "E0604 outside",
    ),
    Case(
        "a mode that contains the state is resumed by an inner mode",
        "`resume(m)` inside m is an error.",
        """
modes: {W: {states: [V, P], initial: P}, V: {states: [A, B], initial: A}}
transitions:
  - [V, terminal, always, resume(W)]
  - [P, terminal, always, A]
""",
        "",
        "E0604 outside",
    ),
    Case(
        "a state is resumed",
        "A mode as next state means its `initial`; `resume(mode)` goes back.",
        """
modes: {W: {states: [A, B], initial: A}}
transitions:
  - [A, terminal, always, B]
  - [B, terminal, always, P]
  - [P, terminal, always, resume(A)]
""",
        "",
        "E0604 `A` is a state",
    ),
    Case(
        "a mode without initial is entered by its name",
        "A mode as next state means its `initial`.",
        """
modes: {W: {states: [A, B]}}
transitions:
  - [A, terminal, always, B]
  - [B, terminal, always, P]
  - [P, terminal, always, W]
""",
        "",
        "E0604 no `initial`",
    ),
    Case(
        "a mode without initial is resumed before it was left",
        "`resume(mode)` goes to `initial` the first time; a missing way is an error.",
        """
initial_state: P
modes: {W: {states: [A, B]}}
transitions:
  - [A, terminal, always, B]
  - [B, terminal, always, P]
  - [P, terminal, is_a, A]
  - [P, terminal, otherwise, resume(W)]
""",
        "",
        "E0604 no `initial`",
    ),
    Case(
        "initial is outside of the mode",
        "A mode as next state means its `initial`, a state or mode inside.",
        "modes: {W: {states: [A, B], initial: P}}" + TABLE,
        "",
        "E0604 `P`",
    ),
    Case(
        "a cause that no state of the row has",
        "A cause may be a named error condition.",
        """
modes: {W: {states: [A], error: {e: x.desk.order == b}}}
transitions:
  - [W, e, always, P]
  - [A, terminal, always, B]
  - [B, terminal, always, A]
  - [B, e, always, A]
  - [P, terminal, always, A]
""",
        "",
        "E0201 `e`",
    ),
    Case(
        "an unnamed error has no row",
        "Per state and cause exactly one row applies, and that is proved.",
        "modes: {W: {states: [A, B], initial: A, error: {e: x.desk.order == b}}}" + TABLE,
        "",
        "E0603 `A`",
    ),
    Case(
        "two rows are for all other cases",
        "`otherwise` negates all other rows of that state and cause.",
        """
modes: {W: {states: [A, B], initial: A}}
transitions:
  - [W, terminal, otherwise, P]
  - [A, terminal, is_a, B]
  - [B, terminal, otherwise, A]
  - [P, terminal, always, A]
""",
        "",
        "E0602 `B`",
    ),
)
