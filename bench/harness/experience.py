"""docs/experiments.md from the data under docs/experiments/: no number of it is typed by hand."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Mapping, Sequence
from math import ceil
from pathlib import Path
from typing import Any

from specc.atomic_files import write_atomically
from specc.tools.sweep.summary import Estimate, cells_of, median, plot, rate
from specc.tools.sweep.table import as_csv

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE = DOCS / "experiments.md"
DATA = DOCS / "experiments"

Row = dict[str, Any]

FORCE, APPROACH, TIME = "peak force [N]", "time of approach [s]", "time of the pick [s]"
POSITION, ROTATION = "error of position [mm]", "error of rotation [deg]"
_KEPT = {
    "seed": "seed",
    "success": "success",
    "reason": "reason",
    "cycle.object": "object",
    "cycle.lift_height_m": "lift [m]",
    "cycle.max_force_N": FORCE,
    "cycle.position_error_mm": POSITION,
    "cycle.rotation_error_deg": ROTATION,
    "steps of irp.c in S6": APPROACH,
    "cycle.simulated_s": TIME,
}
"""Columns of a sweep that are kept, and what they are called here."""
_STEP_S = 0.01
"""Period of irp.c: its state S6 is the approach."""
_DIGITS = 5
_PART = re.compile(r"(<!-- (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)
_PICTURED = (FORCE, APPROACH, "success", "found")

FORMS: Mapping[str, tuple[str, str]] = {
    "17": ("the motor regulator gets the end of a motion at once", "picks"),
    "27": ("integrates from the measured pose, not from the desired one", "contact"),
    "29": ("keeps the last desired velocity between contacts; two picks", "twice"),
    "53": ("never empties the list of objects; two picks", "twice"),
    "57": ("any force above zero ends the approach", "picks"),
    "58": ("fingers are closed to the width of the box, no further", "picks"),
    "64": ("merges the same recognition again in every period; two picks", "twice"),
    "67": (
        "chooses whether the hand has room or not; two boxes lie close together",
        "crowded",
    ),
}
"""Equation -> what it does as published, and the experiment that has the mended form."""


def keep(name: str, table: Path) -> None:
    """Keep what the page is made of: the columns that it uses, with a few digits."""
    kept = []
    for row in _read(table):
        settings = {n: v for n, v in row.items() if "[" in n and "(" not in n and n not in _KEPT}
        own: Row = {new: row.get(old) for old, new in _KEPT.items()}
        if (steps := row.get("steps of irp.c in S6")) is not None:
            own[APPROACH] = _STEP_S * steps
        kept.append({n: _short(v) for n, v in {**settings, **own}.items()})
    keep_rows(name, kept)


def keep_rows(name: str, rows: Sequence[Row]) -> None:
    """Keep rows as they are, with a few digits."""
    DATA.mkdir(exist_ok=True)
    short = [{n: _short(v) for n, v in row.items()} for row in rows]
    write_atomically(DATA / f"{name}.csv", as_csv(short))


def _short(value: Any) -> Any:
    return float(f"{value:.{_DIGITS}g}") if isinstance(value, float) else value


def _read(path: Path) -> list[Row]:
    if not path.exists():
        return []
    with path.open(encoding="utf-8", newline="") as file:
        return [{name: _value(text) for name, text in row.items()} for row in csv.DictReader(file)]


def data(name: str) -> list[Row]:
    """The rows of an experiment; none if it was not made."""
    return _read(DATA / f"{name}.csv")


def _value(text: str) -> Any:
    if text in ("", "true", "false"):
        return {"": None, "true": True, "false": False}[text]
    try:
        return int(text) if text.isdigit() else float(text)
    except ValueError:
        return text


# The page.


def write_page() -> None:
    """Make the tables and pictures again. Raises OSError."""
    write_atomically(PAGE, page(PAGE.read_text(encoding="utf-8")))
    draw(DATA)


def page(text: str) -> str:
    """The page with its parts made from the data; the rest stays."""
    return _PART.sub(lambda found: f"{found[1]}{_PARTS[found[2]]()}{found[3]}", text)


def draw(folder: Path) -> None:
    """Make the pictures of the page."""
    names = ["D_z [kg/s]", "I_z [kg]"]
    if rows := data("contact"):
        _draw(rows, names, folder, "contact")
    recognised = data("recognition")
    for what in dict.fromkeys(row["varied"] for row in recognised):
        rows = [{**row, what: row["value"]} for row in recognised if row["varied"] == what]
        _draw(rows, [what], folder, f"recognition_{what.partition(' ')[0]}")


def _draw(rows: Sequence[Row], names: Sequence[str], folder: Path, prefix: str) -> None:
    wanted = {*names, *_PICTURED}
    cells = cells_of([{n: v for n, v in row.items() if n in wanted} for row in rows], names)
    for path in plot(cells, names, folder):
        if path.suffix == ".svg":
            path.replace(path.with_name(f"{prefix}_{path.name}"))
        else:
            path.unlink()


def _picks() -> str:
    rows = data("picks")
    good = [row for row in rows if row["success"]]
    told = f"{len(good)} of {len(rows)} picks succeeded: {_rate(rate(len(good), len(rows)))}.\n\n"
    measures = (POSITION, ROTATION, FORCE, APPROACH, TIME)
    figures = [[m, *_figures([row[m] for row in rows if row[m] is not None])] for m in measures]
    told += _table(["", "median", "of 95 % at most", "largest"], figures)
    objects = sorted({row["object"] for row in rows if row["object"]})
    by_object = [
        [name, _of([row for row in rows if row["object"] == name], "success")] for name in objects
    ]
    told += "\n" + _table(["object", "success"], by_object)
    bad = [row for row in rows if not row["success"]]
    if not bad:
        return told + "\nNone failed.\n"
    head = ["seed", "object", POSITION, "lift [m]", "reason"]
    return f"{told}\nThose that failed:\n\n" + _table(
        head, [[_shown(row[name]) for name in head] for row in bad]
    )


def _contact() -> str:
    rows = data("contact")
    dampings, inertias = (sorted({row[n] for row in rows}) for n in ("D_z [kg/s]", "I_z [kg]"))

    def cell(damping: float, inertia: float, figure: Callable[[list[Row]], str]) -> str:
        return figure([r for r in rows if (r["D_z [kg/s]"], r["I_z [kg]"]) == (damping, inertia)])

    told = f"{len(rows)} runs. Success, and medians of force and time with their intervals:\n"
    for title, figure in (
        ("success", lambda own: _of(own, "success")),
        (FORCE, lambda own: _spread(own, FORCE)),
        (APPROACH, lambda own: _spread(own, APPROACH)),
    ):
        head = [f"{title}, by damping", *(f"{_shown(i)} kg" for i in inertias)]
        table = [[f"{_shown(d)} kg/s", *(cell(d, i, figure) for i in inertias)] for d in dampings]
        told += "\n" + _table(head, table)
    whole = [d for d in dampings if all(r["success"] for r in rows if r["D_z [kg/s]"] == d)]
    values = ", ".join(map(_shown, whole)) or "no"
    return f"{told}\nEvery run succeeded with a damping of {values} kg/s, whatever the inertia.\n"


def _published() -> str:
    lines = []
    for equation, (what, partner) in FORMS.items():
        if not (rows := data(f"published_{equation}")):
            continue
        mended = data(partner)
        if partner == "contact":
            mended = [r for r in mended if (r["D_z [kg/s]"], r["I_z [kg]"]) == (400, 20)]
        seeds = {row["seed"] for row in rows} & {row["seed"] for row in mended}
        pair = ([row for row in form if row["seed"] in seeds] for form in (rows, mended))
        lines.append([f"({equation})", what, *_beside(*pair)])
    head = ["equation", "as published", "success", "peak force [N]", "time of the pick [s]"]
    return (
        "In each pair the published form comes first, the mended one on the same seeds second.\n\n"
        + (_table(head, lines))
    )


def _beside(published: Sequence[Row], mended: Sequence[Row]) -> list[str]:
    """Success, force and time of both forms, which the same seeds made."""
    shares = [_of(rows, "success") for rows in (published, mended)]
    medians = [[_spread(rows, name) for rows in (published, mended)] for name in (FORCE, TIME)]
    return [" / ".join(pair) for pair in (shares, *medians)]


def _recognition() -> str:
    rows = data("recognition")
    told = ""
    for what in dict.fromkeys(row["varied"] for row in rows):
        lines = []
        for value in dict.fromkeys(row["value"] for row in rows if row["varied"] == what):
            own = [row for row in rows if (row["varied"], row["value"]) == (what, value)]
            wrong = sum(row["false"] for row in own)
            errors = (_spread(own, "position_error_mm"), _spread(own, "rotation_error_deg"))
            lines.append([_shown(value), _of(own, "found"), *errors, str(wrong)])
        told += "\n" + _table([what, "found", POSITION, ROTATION, "not there"], lines)
    return told.lstrip("\n")


_PARTS = {
    "picks": _picks,
    "contact": _contact,
    "published": _published,
    "recognition": _recognition,
}


# How figures look.


def _of(rows: Sequence[Row], name: str) -> str:
    """How many, and the interval of the share."""
    if not rows:
        return ""
    hits = sum(bool(row[name]) for row in rows)
    found = rate(hits, len(rows))
    assert found.low is not None and found.high is not None
    return f"{hits} of {len(rows)} ({100 * found.low:.0f} to {100 * found.high:.0f} %)"


def _rate(found: Estimate) -> str:
    assert found.low is not None and found.high is not None
    share, low, high = (f"{100 * part:.1f} %" for part in (found.value, found.low, found.high))
    return f"{share}, with a probability of 95 % between {low} and {high}"


def _spread(rows: Sequence[Row], name: str) -> str:
    """The median and its interval."""
    known = [row[name] for row in rows if row[name] is not None]
    if not known:
        return ""
    found = median(known)
    if found.low is None or found.high is None:
        return _shown(found.value)
    return f"{_shown(found.value)} ({_shown(found.low)} to {_shown(found.high)})"


def _figures(numbers: Sequence[float]) -> list[str]:
    """Median, 95th percentile and largest."""
    ordered = sorted(numbers)
    return [
        _shown(v)
        for v in (median(ordered).value, ordered[ceil(0.95 * len(ordered)) - 1], ordered[-1])
    ]


def _shown(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, float):
        return f"{value:.3g}" if abs(value) < 1000 else f"{value:.0f}"
    return str(value)


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)
