"""What other tools find of seeded faults when they load a machine that has one.

Every machine of the specifications is written for each tool as the tool reads machines: its states,
its rows as transitions, and the conditions of a row, that of the end and the initial one, as the
guard. The faults are those of bench/mutation.py, as far as they are still there in that form; keys
are misspelt in the tool's own words. A fault is found if loading raises or warns.

The tools are not among the requirements of this project:

    pip install sismic python-statemachine transitions pyyaml
    python bench/rivals.py --write
"""

from __future__ import annotations

import argparse
import json
import warnings
from collections.abc import Callable, Iterator, Sequence
from importlib import import_module, metadata
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from bench.harness.tables import table
from bench.seeding.classes import FAULTS
from bench.seeding.machine import OTHERWISE, Machine, Row, machines
from bench.seeding.score import beds, spread
from bench.seeding.sheet import Sheet, misspelt
from specc.read import read_text

ROOT = Path(__file__).parents[1]
RESULT = ROOT / "bench/seeding/rivals.json"
MOST = 40
EXPRESSIBLE = (
    "wrong target of a row",
    "wrong source of a row",
    "wrong initial state",
    "unknown condition",
    "undefined variable",
    "type error in a condition",
    "missing case (one of several rows)",
    "case left out of a condition",
    "condition without its `not`",
    "overlapping conditions",
    "condition of a row that can never hold",
    "terminal condition that can never hold",
    "trap state (no rows)",
    "trap state (all rows lead back)",
    "unreachable state",
    "targets of two rows swapped",
)
MISSPELT = "misspelt key"
# Rows stand within their state there, and the initial state is a mark of the state.
NOT_IN = {
    "wrong source of a row": ("sismic", "python-statemachine"),
    "wrong initial state": ("python-statemachine", "python-statemachine, as a class"),
}
Chart = dict[str, Any]


def chart_of(machine: Machine) -> Chart:
    """States and rows; a guard is conditions by name, with a text or None if there is no such."""
    rows = [
        {
            "source": source,
            "target": target,
            "guard": {when: _initial(machine, row), **_end(machine, source, cause)},
        }
        for row in machine.rows()
        for source, cause, when, target in [row.cells]
    ]
    states = [str(state) for state in machine.get("states")]
    return {"initial": machine.get("initial_state"), "states": states, "rows": rows}


def _end(machine: Machine, state: str, cause: str) -> dict[str, str | None]:
    if state not in machine.get("states"):
        return {}
    behaviour = machine.behaviour_of(state)
    name = machine.get("behaviours", behaviour).get(cause, "never")
    if isinstance(name, dict):
        return {f"{behaviour}_{cause}": machine.ends(behaviour, cause)}
    return {name: _text(machine, cause, name)}


def _initial(machine: Machine, row: Row) -> str | None:
    """The condition of a row; `otherwise` is spelled out."""
    if row.condition != OTHERWISE:
        return _text(machine, "initial", row.condition)
    others = [other.condition for other in machine.rows_of(row.state, row.cause) if other != row]
    some = " or ".join(f"({_text(machine, 'initial', name) or name})" for name in others)
    return f"not ({some or False})"


def _text(machine: Machine, kind: str, name: str) -> str | None:
    known = name in (*machine.get("conditions", kind), "always", "never")
    return machine.text_of(kind, name) if known else None


def sismic(chart: Chart) -> Chart:
    """A statechart of sismic."""
    states = [
        {
            "name": name,
            "transitions": [
                {"event": "tick", "guard": _both(row), "target": row["target"]}
                for row in _of(chart, name)
            ],
        }
        for name in chart["states"]
    ]
    root = {"name": "root", "initial": chart["initial"], "states": states}
    return {"statechart": {"name": "machine", "root state": root}}


def statemachine(chart: Chart) -> Chart:
    """A document of python-statemachine."""
    states = {
        name: {
            **({"initial": True} if name == chart["initial"] else {}),
            "transitions": [
                {"event": "tick", "cond": _both(row), "target": row["target"]}
                for row in _of(chart, name)
            ],
        }
        for name in chart["states"]
    }
    return {"name": "machine", "states": states}


def transitions(chart: Chart) -> Chart:
    """Arguments of a machine of transitions, which has no format of its own for files."""
    rows = [
        {
            "trigger": "tick",
            "source": row["source"],
            "dest": row["target"],
            "conditions": list(row["guard"]),
        }
        for row in chart["rows"]
    ]
    return {"states": chart["states"], "initial": chart["initial"], "transitions": rows}


def _of(chart: Chart, state: str) -> list[Chart]:
    return [row for row in chart["rows"] if row["source"] == state]


def _both(row: Chart) -> str:
    """The conditions as one expression; one that there is not by its name."""
    return " and ".join(f"({text or name})" for name, text in row["guard"].items())


def load_sismic(document: Chart) -> None:
    """Load a statechart; whatever is wrong with it is raised."""
    import_module("sismic.io").import_from_yaml(json.dumps(document))


def load_statemachine(document: Chart) -> None:
    """Load a document, with conditions that may be any Python."""
    import_module("statemachine.io").load(
        json.dumps(document, indent=1), format="yaml", trusted=True
    )


def load_transitions(document: Chart) -> None:
    """Make a machine; conditions are looked up in the model when they are asked."""
    import_module("transitions").Machine(auto_transitions=False, **document)


def load_class(chart: Chart) -> None:
    """Make and start a class; conditions are methods, and a state that is not there a KeyError."""
    module = import_module("statemachine")
    states = {n: module.State(n, initial=n == chart["initial"]) for n in chart["states"]}
    parts: Chart = dict(states)
    ticks = None
    for row in chart["rows"]:
        parts |= {f"is_{name}": _holds for name, text in row["guard"].items() if text is not None}
        names = [f"is_{name}" for name in row["guard"]]
        tick = states[row["source"]].to(states[row["target"]], cond=names)
        ticks = tick if ticks is None else ticks | tick
    type("Machine", (module.StateMachine,), {**parts, "tick": ticks})()


def _holds(_machine: object) -> bool:
    return True


TOOLS: dict[str, tuple[Callable[[Chart], Chart], Callable[[Chart], None]]] = {
    "sismic": (sismic, load_sismic),
    "python-statemachine": (statemachine, load_statemachine),
    "python-statemachine, as a class": (dict, load_class),
    "transitions": (transitions, load_transitions),
}
PACKAGES = ("sismic", "python-statemachine", "transitions")
MODULES = ("sismic", "statemachine", "transitions")


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table, and keep it with `--write`."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--write", action="store_true", help=f"write {RESULT.name}")
    options = parser.parse_args(arguments)
    missing = [name for name in MODULES if find_spec(name) is None]
    if missing:
        print(f"not installed: {', '.join(missing)}; nothing is measured")
        return
    sheets = [bed.sheet for bed in beds(ROOT / "specs") if not bed.findings()]
    whole = [chart for sheet in sheets for chart in _charts(sheet)]
    for name, (write, load) in TOOLS.items():
        if any(is_refused(write(chart), load) for chart in whole):
            raise SystemExit(f"{name} does not load a machine without a fault")
    faults = {name: _tried(sheets, name) for name in EXPRESSIBLE}
    files = [tool for tool in TOOLS.values() if tool[0] is not dict]
    slips = iter([_misspelt_keys(sheets, *tool) for tool in files])
    faults[MISSPELT] = ["" if tool[0] is dict else next(slips) for tool in TOOLS.values()]
    title = "found of tried, without faults that the other tools have no words for"
    print(table(title, ("fault", *TOOLS), [(n, *c) for n, c in faults.items()]))
    if options.write:
        versions = {name: metadata.version(name) for name in PACKAGES}
        result = {"tools": list(TOOLS), "versions": versions, "faults": faults}
        RESULT.write_text(json.dumps(result, indent=2) + "\n", encoding="utf-8")


def _tried(sheets: Sequence[Sheet], name: str) -> list[str]:
    fault = next(fault for fault in FAULTS if fault.name == name)
    charts = [
        chart
        for sheet in sheets
        for seed in spread(list(fault.seeds(sheet)), MOST)
        for chart in _changed(sheet, seed.text(sheet))
    ]
    return [
        "" if tool in NOT_IN.get(name, ()) else _counted(map(write, charts), load)
        for tool, (write, load) in TOOLS.items()
    ]


def _charts(sheet: Sheet) -> list[Chart]:
    return [chart_of(machine) for machine in machines(sheet) if machine.rows()]


def _changed(sheet: Sheet, text: str) -> Iterator[Chart]:
    """The machines of a text that are not as they were, which is those with the fault."""
    document = read_text(sheet.path, text)
    assert document.source.spans is not None
    other = Sheet(sheet.path, text, document.data, document.source.spans)
    before = _charts(sheet)
    yield from (chart for chart in _charts(other) if chart not in before)


def _misspelt_keys(
    sheets: Sequence[Sheet], write: Callable[[Chart], Chart], load: Callable[[Chart], None]
) -> str:
    documents = [write(chart) for sheet in sheets for chart in _charts(sheet)]
    return _counted((wrong for document in documents for wrong in _with_slips(document)), load)


def _with_slips(document: Chart) -> Iterator[Chart]:
    """The document with one of its keys misspelt, each in turn; names of states are no keys."""
    text = json.dumps(document)
    for key in ("statechart", "root state", "name", "states", "transitions", "initial"):
        yield from _replaced(text, key)
    for key in ("event", "guard", "cond", "target", "trigger", "source", "dest", "conditions"):
        yield from _replaced(text, key)


def _replaced(text: str, key: str) -> Iterator[Chart]:
    quoted, at = f'"{key}": ', text.find(f'"{key}": ')
    if at >= 0:
        yield json.loads(f'{text[:at]}"{misspelt(key)}": {text[at + len(quoted) :]}')


def _counted(documents: Iterator[Chart] | map[Chart], load: Callable[[Chart], None]) -> str:
    results = [is_refused(document, load) for document in documents]
    return f"{sum(results)} of {len(results)}" if results else ""


def is_refused(document: Chart, load: Callable[[Chart], None]) -> bool:
    """Whether loading a document raises or warns."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            load(document)
        except Exception:  # noqa: BLE001 - each tool has its own
            return True
    return bool(caught)


if __name__ == "__main__":
    main()
