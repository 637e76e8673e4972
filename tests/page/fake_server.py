"""A small server that plays a recording to the page as if it ran, to look at the page by hand.

`python -m tests.page.fake_server FILE.mcap SPEC [--live] [--panel] [--port N]`, where a session
needs neither token nor limits. What it serves follows the protocol of the page; the truth of
conditions and the reasons are the words of `specc why`.
"""

from __future__ import annotations

import argparse
import asyncio
import bisect
import io
import json
import math
import re
import time
from argparse import Namespace
from contextlib import redirect_stdout, suppress
from http import HTTPStatus
from pathlib import Path
from typing import Any

from specc_runtime.recording.messages import Shelved, step_of, steps_of
from specc_runtime.recording.reading import RecordFile
from websockets.asyncio.server import ServerConnection, serve
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from specc import pipeline
from specc.cli.why import why
from specc.refusal import Refused
from specc.tools.graph import FORMATS, picture
from specc.tools.graph.diagram import Arc, Diagram
from specc.tools.plot import Signal, resolve_signal
from specc.tools.plot.signals import NoSignal, _elements
from specc.tools.why import NotKnown, value_of, value_text

STATIC = Path(__file__).resolve().parents[2] / "specc/tools/page/static"
KINDS = {".html": "text/html", ".css": "text/css", ".js": "text/javascript"}
CSP = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'"
)
PANEL = [
    {"name": "desk.R.buttons.start", "title": "Start", "kind": "button", "initial": False,
     "hold": False, "key": "s", "unit": ""},
    {"name": "desk.R.buttons.enable", "title": "Enable the drives", "kind": "button",
     "initial": False, "hold": True, "key": "", "unit": ""},
    {"name": "desk.R.buttons.stop", "title": "Stop", "kind": "switch", "initial": False,
     "hold": False, "key": "x", "unit": ""},
    {"name": "desk.R.buttons.v", "title": "Speed of the hand", "kind": "slider", "initial": 0.05,
     "least": 0.0, "greatest": 0.2, "unit": "m/s", "hold": False, "key": ""},
    {"name": "desk.R.buttons.mode", "title": "Mode", "kind": "choice", "initial": "manual",
     "choices": ["manual", "guided", "auto"], "unit": "", "hold": False, "key": ""},
    {"name": "desk.R.buttons.n", "title": "Parts of an order", "kind": "number", "initial": 1,
     "least": 0, "greatest": 10, "whole": True, "unit": "", "hold": False, "key": ""},
]  # fmt: skip
LIVE = [
    {"name": "stop", "unit": "m", "least": 0.2, "greatest": 1.0, "value": 0.4, "whole": False},
    {"name": "v_max", "unit": "m/s", "least": 0.0, "greatest": 0.8, "value": 0.6, "whole": False},
]


class Recording:
    """All steps of a file in memory, and what the page asks of them."""

    def __init__(self, file: Path, spec: str) -> None:
        self.file, self.spec = file, spec
        result = pipeline.compile_spec(spec)
        assert result.system is not None
        self.system, self.sources = result.system, result.sources
        self.steps: dict[str, tuple[list[float], list[Any]]] = {}
        shelf = Shelved(0)
        for topic, at_s, text in steps_of(RecordFile(file), shelf, images=False):
            name = topic[1:]
            times, messages = self.steps.setdefault(name, ([], []))
            times.append(at_s)
            messages.append(json.loads(text) if name == "plant" else step_of(text))
        self.end_s = max(times[-1] for times, _ in self.steps.values())
        self.report = json.loads(shelf.report.get("report", "{}"))
        self.machines = [s for s in self.system.subsystems if s.states]
        self.pictures: list[bytes] = []
        self.elements = dict(_elements(self.system))
        self.signals = self._signals()

    def _signals(self) -> dict[str, Signal]:
        found = {}
        for name in self.elements:
            with suppress(NoSignal):
                signal = resolve_signal(self.system, name)
                if isinstance(signal, Signal):
                    found[name] = signal
        return found

    def asset(self, place: str, kind: Any, prefix: str) -> str | None:
        try:
            _, diagram = picture(self.system, place, kind)
            svg = FORMATS["svg"].render(diagram).decode()
        except Refused:
            return None
        self.pictures.append(with_ids(svg, diagram, prefix).encode())
        return f"/asset/{len(self.pictures) - 1}"

    def at(self, place: Any) -> str:
        span = self.sources.span(place)
        return f"{span.file}:{span.line}"

    def spans(self) -> dict[str, list[list[Any]]]:
        found = {}
        for machine in self.machines:
            times, messages = self.steps.get(machine.qualified_name, ([], []))
            spans: list[list[Any]] = []
            for at_s, message in zip(times, messages, strict=True):
                if message["row"] != -1 or not spans:
                    if spans:
                        spans[-1][1] = at_s
                    spans.append([at_s, None, message["state"]])
            if spans:
                spans[-1][1] = self.end_s
            found[machine.qualified_name] = spans
        return found

    def marks(self) -> list[dict[str, Any]]:
        marks = [
            {"time_s": f["time_s"], "kind": "fault", "text": f"{f['culprit']}: {f['message']}"}
            for f in self.report.get("faults", ())
        ]
        marks += [
            {"time_s": r["time_s"], "kind": "violation", "text": r["that"]}
            for r in self.report.get("requirements", ())
            if r["verdict"] == "violated"
        ]
        marks += [
            {"time_s": d["time_s"], "kind": "disturbance", "text": str(d.get("text", d))}
            for d in self.report.get("disturbances", ())
            if d.get("time_s") is not None
        ]
        return sorted(marks, key=lambda mark: mark["time_s"])

    def step(self, name: str, time_s: float) -> Any:
        times, messages = self.steps.get(name, ([], []))
        place = bisect.bisect_right(times, time_s + 1e-9) - 1
        return messages[place] if place >= 0 else None

    def states(self, time_s: float, spans: Any) -> dict[str, Any]:
        found = {}
        for name, own in spans.items():
            step = self.step(name, time_s)
            if step:
                place = bisect.bisect_right([s[0] for s in own], time_s + 1e-9) - 1
                row = next(
                    (self.step(name, own[place][0]) or {}).get("transition", "") for _ in "1"
                )
                found[name] = {"state": step["state"], "since_s": own[place][0], "row": row}
        return found

    def values(self, time_s: float) -> dict[str, str]:
        found = {}
        for name, element in self.elements.items():
            data = self.step(element.owner, time_s)
            for part in element.path:
                data = data.get(part) if isinstance(data, dict) else None
            with suppress(NotKnown):
                value = None if data is None else value_of(element.type, data)
                found[name] = "no value" if value is None else value_text(element.type, value)
        return found

    def series(self, name: str, begin_s: float, end_s: float) -> dict[str, Any]:
        signal = self.signals.get(name)
        if signal is None:
            return {"t": [], "lines": []}
        times, messages = self.steps.get(signal.owner, ([], []))
        first, last = bisect.bisect_left(times, begin_s), bisect.bisect_right(times, end_s)
        stride = max(1, (last - first) // 600)
        rows, t = [], []
        for place in range(first, last, stride):
            data = messages[place]
            for part in signal.path:
                data = data.get(part) if isinstance(data, dict) else None
            with suppress(NotKnown):
                row = (
                    signal.numbers(data)
                    if data is not None
                    else (math.nan,) * len(signal.components)
                )
                rows.append([x if math.isfinite(x) else None for x in row])
                t.append(times[place])
        return {"t": t, "lines": [list(line) for line in zip(*rows, strict=True)]}

    def requirements(self, time_s: float) -> list[dict[str, Any]]:
        found = []
        for each in self.report.get("requirements", ()):
            at_s = each.get("time_s")
            verdict, margin = each["verdict"], each.get("margin")
            is_over = at_s is not None and at_s <= time_s
            if verdict == "violated":
                verdict = "violated" if is_over else "open"
            elif time_s < self.end_s - 1e-6:
                verdict = "open"
            else:
                verdict = "holds"
            found.append({"verdict": verdict, "margin": margin, "time_s": at_s})
        return found

    def flow(self, time_s: float) -> list[str]:
        found = set()
        for machine in self.machines:
            step = self.step(machine.qualified_name, time_s)
            for peer, inside in (step or {}).get("y", {}).items():
                port = next(
                    (p for p in machine.ports if p.direction == "y" and p.peer == peer), None
                )
                if port and inside and time_s - step["time"] < 0.2:
                    found.add(escape_id(f"a-{machine.qualified_name}-{port.other_end}"))
        return sorted(f"st-{each}" for each in found)

    def why(self, machine: str, time_s: float) -> list[dict[str, Any]]:
        out = io.StringIO()
        options = Namespace(moment=(self.file, time_s), spec=self.spec, subsystem=machine)
        with redirect_stdout(out), suppress(Refused):
            why(options)
        return [line_of(text) for text in out.getvalue().splitlines() if text.strip()]


PLACE = re.compile(r"  \((\S+:\d+)\)$")


def line_of(text: str) -> dict[str, Any]:
    """A line of `specc why` in parts."""
    depth = (len(text) - len(text.lstrip())) // 2
    text = text.strip()
    place = PLACE.search(text)
    text = PLACE.sub("", text)
    role, truth = "reason", None
    if depth == 0:
        role = "state"
    elif text.startswith("by ") and depth == 1:
        role = "row"
    elif text.startswith("fault"):
        role = "fault"
    elif text.startswith("sent "):
        role = "sent"
    elif text.startswith("read "):
        role = "read"
    elif re.match(r"last transitions:|[\d.e+-]+ s  ", text):
        role = "past"
    elif re.match(r"(terminal|error|row) ", text):
        role = "row" if text.startswith("row") else "condition"
        for word, value in ((": True", True), (": False", False)):
            if word in text:
                truth = value
                text = text.replace(word, "")
    line = {"text": text, "depth": depth, "role": role, "truth": truth}
    return line | {"place": place[1] if place else None}


def escape_id(text: str) -> str:
    return re.sub(r"[^A-Za-z0-9_.-]", lambda m: f"_{ord(m[0]):x}_", text)


def with_ids(svg: str, diagram: Diagram, prefix: str) -> str:
    """The picture with ids and classes for states, rows, modes, parts and arcs."""
    arcs: list[Arc] = list(diagram.arcs)
    boxes = {box.id: box for box in diagram.all_nodes}

    def node(match: re.Match[str]) -> str:
        title = match[2].replace("&#45;", "-").replace("&gt;", ">").replace("&amp;", "&")
        box = boxes.get(title)
        look = box.look if box else ""
        letter = "s" if look == "state" else "n"
        return (
            f'<g id="{prefix}{letter}-{escape_id(title)}" class="node {look}">\n<title>{match[2]}'
        )

    svg = re.sub(r'<g id="(node\d+)" class="node">\n<title>([^<]*)', node, svg)
    ids = [int(i) for i in re.findall(r'<g id="edge(\d+)" class="edge">', svg)]
    for number in ids:
        arc = arcs[number - 1]
        if arc.covers and "->" in arc.covers[0]:
            first, last = arc.covers[0].split(" -> ")
            words = f'id="{prefix}a-{escape_id(first)}-{escape_id(last)}" class="edge arc"'
        elif arc.covers:
            rows = " ".join(arc.covers)
            words = f'id="{prefix}r-{arc.covers[0]}" data-rows="{rows}" class="edge row"'
        else:
            words = f'id="{prefix}edge{number}" class="edge"'
        svg = svg.replace(f'id="edge{number}" class="edge"', words)
    return re.sub(
        r'<g id="clust\d+" class="cluster">\n<title>cluster ([^<]*)',
        lambda m: f'<g id="{prefix}m-{escape_id(m[1])}" class="cluster mode">\n<title>{m[1]}',
        svg,
    )


class Session:
    """One page: the moment that it sees, and what it asked for."""

    def __init__(self, recording: Recording, options: Namespace) -> None:
        self.recording, self.options = recording, options
        self.spans = recording.spans()
        self.time_s = options.at if options.live else recording.end_s
        self.status, self.speed = ("running", 1.0) if options.live else ("ended", 1.0)
        self.breakpoints: list[Any] = []
        self.panel = {e["name"]: e["initial"] for e in PANEL} if options.panel else {}
        self.live = {e["name"]: e["value"] for e in LIVE} if options.panel else {}
        self.held: dict[str, float] = {}
        self.controls = not options.watch
        self.step_of = ""

    def hello(self) -> dict[str, Any]:
        r, is_live = self.recording, self.options.live
        machines = []
        for s in r.machines:
            name = s.qualified_name
            prefix = f"{escape_id(name)}-"
            machines.append({
                "name": name, "title": s.title, "period_s": float(1 / s.rate_hz),
                "svg": r.asset(name, "states", prefix),
                "states": [
                    {"name": st.name, "title": st.title or st.behaviour.title,
                     "id": f"{prefix}s-{escape_id(st.name)}",
                     "is_error": any(
                         row.target == st.name and row.cause != "terminal" for row in s.transitions
                     ),
                     "modes": list(st.modes), "place": r.at(st.place)}
                    for st in s.states
                ],
                "rows": [
                    {"label": row.label, "id": f"{prefix}r-{n}", "source": row.source,
                     "target": row.target, "cause": row.cause, "place": r.at(row.place)}
                    for n, row in enumerate(s.transitions)
                ],
            })  # fmt: skip
        signals = [
            {"name": name, "title": element.title, "unit": "",
             "kind": kind_of(r.signals.get(name)),
             "components": [
                 {"name": c.name, "unit": c.unit, "words": list(c.words)}
                 for c in (r.signals[name].components if name in r.signals else ())
             ]}
            for name, element in r.elements.items()
        ]  # fmt: skip
        for signal in signals:
            units = {c["unit"] for c in signal["components"]}
            signal["unit"] = units.pop() if len(units) == 1 else ""
        return {
            "type": "hello", "source": "live" if is_live else "file", "file": r.file.name,
            "title": r.system.title or r.system.name, "system": r.system.name, "seed": 0,
            "real_time": self.options.real_time, "begin_s": 0.0,
            "end_s": None if is_live else r.end_s, "notice": self.options.notice,
            "machines": machines, "structure": r.asset("", "structure", "st-"), "signals": signals,
            "requirements": [
                {"that": q.that, "because": q.because, "place": r.at(q.place)}
                for q in r.system.requirements
            ],
            "cameras": [], "frames": [], "poses": [], "scene": None, "bodies": [],
            "constants": [
                {"name": c.name, "text": str(n), "unit": ""}
                for n, c in enumerate(r.system.constants)
            ],
            "live": LIVE if self.options.panel else [],
            "panel": PANEL if self.options.panel else [],
            "can": {
                "pause": is_live and not self.options.real_time,
                "step": is_live and not self.options.real_time,
                "speed": is_live and not self.options.real_time,
                "break": is_live, "restart": True, "live": True, "panel": True, "set": is_live,
            },
            "controls": self.controls,
        }  # fmt: skip

    def now(self) -> dict[str, Any]:
        r = self.recording
        message = {
            "type": "now", "time_s": self.time_s, "status": self.status, "speed": self.speed,
            "factor": self.speed, "states": r.states(self.time_s, self.spans),
            "flow": r.flow(self.time_s), "requirements": r.requirements(self.time_s),
            "poses": None, "live": self.live, "panel": self.panel,
        }  # fmt: skip
        if self.options.real_time:
            message["real_time"] = {
                m.qualified_name: {"late_ms": 0.4 * n, "skipped": n // 2}
                for n, m in enumerate(r.machines)
            }
        return message

    def past(self) -> list[dict[str, Any]]:
        spans = {
            name: [
                [b, None if e is not None and e > self.time_s else e, s]
                for b, e, s in own
                if b <= self.time_s
            ]
            for name, own in self.spans.items()
        }
        marks = [m for m in self.recording.marks() if m["time_s"] <= self.time_s]
        return [
            {"type": "spans", "spans": spans, "replace": True},
            {"type": "marks", "marks": marks, "replace": True},
        ]

    def advance(self, wall_s: float) -> list[dict[str, Any]]:
        """Go on with the run; what is to be said of it."""
        if self.status != "running":
            return []
        before = self.time_s
        self.time_s = min(before + wall_s * (self.speed or 20), self.recording.end_s)
        out, changes = [], {}
        for name, own in self.spans.items():
            new = [span for span in own if before < span[0] <= self.time_s]
            if new:
                changes[name] = [[b, None, s] for b, _, s in new]
            for span in new:
                stops = any(
                    b["kind"] == "state" and b["machine"] == name and b["state"] == span[2]
                    for b in self.breakpoints
                )
                if stops:
                    self.status = "paused"
                    out.append({"type": "stopped", "why": f"{name} entered {span[2]}"})
        if changes:
            out.append({"type": "spans", "spans": changes, "replace": False})
        marks = [m for m in self.recording.marks() if before < m["time_s"] <= self.time_s]
        if marks:
            out.append({"type": "marks", "marks": marks, "replace": False})
        if self.time_s >= self.recording.end_s:
            self.status = "ended"
        for name, last in list(self.held.items()):
            if time.monotonic() - last > 0.2:
                del self.held[name]
                self.panel[name] = False
        return out

    def answer(self, m: dict[str, Any]) -> dict[str, Any] | None:
        r = self.recording
        at_s = m.get("time_s")
        at_s = self.time_s if at_s is None else at_s
        match m["type"]:
            case "look":
                return {
                    "type": "moment", "id": m["id"], "time_s": at_s,
                    "states": r.states(at_s, self.spans), "values": r.values(at_s),
                    "requirements": r.requirements(at_s), "poses": None, "flow": r.flow(at_s),
                }  # fmt: skip
            case "why":
                lines = r.why(m["machine"], at_s)
                return {"type": "why", "id": m["id"], "machine": m["machine"], "time_s": at_s,
                        "lines": lines}  # fmt: skip
            case "series":
                half = m["window_s"] / 2
                begin_s, end_s = at_s - half, at_s + half
                if m.get("time_s") is None:
                    begin_s, end_s = at_s - m["window_s"], at_s
                found = r.series(m["name"], begin_s, min(end_s, self.time_s))
                return {"type": "series", "id": m["id"], "name": m["name"], "begin_s": begin_s,
                        "end_s": end_s, "words": [], **found}  # fmt: skip
            case "take":
                self.controls = True
                return {"type": "control", "controls": True, "clients": 2}
            case "watch":
                return None
        return self.command(m)

    def command(self, m: dict[str, Any]) -> dict[str, Any] | None:
        if not self.controls:
            return {"type": "refused", "text": "another page controls this run"}
        match m["type"]:
            case "pause":
                self.status = "paused" if self.status == "running" else self.status
            case "continue":
                self.status = "running" if self.status == "paused" else self.status
            case "speed":
                self.speed = m["value"]
            case "break":
                self.breakpoints = m["breakpoints"]
                return {"type": "breakpoints", "breakpoints": self.breakpoints}
            case "step":
                times = self.recording.steps[m["machine"]][0]
                place = bisect.bisect_right(times, self.time_s + 1e-9)
                self.time_s = times[min(place, len(times) - 1)]
            case "set":
                self.live[m["name"]] = m["value"]
            case "panel":
                self.panel[m["name"]] = m["value"]
            case "hold":
                self.panel[m["name"]] = True
                self.held[m["name"]] = time.monotonic()
            case "release":
                self.panel[m["name"]] = False
            case "restart":
                self.time_s, self.status = m.get("from_s") or 0.0, "running"
        return None


def kind_of(signal: Signal | None) -> str:
    if signal is None:
        return "other"
    return "pose" if signal.is_pose else "numbers"


class Server:
    def __init__(self, options: Namespace) -> None:
        self.options = options
        self.recording = Recording(Path(options.file), options.spec)
        self.first = Session(self.recording, options)
        self.hello = self.first.hello()

    def http(self, _: ServerConnection, request: Request) -> Response | None:
        path = request.path.partition("?")[0]
        if path == "/ws":
            return None
        body, kind = None, "text/plain"
        if path == "/":
            body, kind = (STATIC / "index.html").read_bytes(), "text/html"
        elif match := re.fullmatch(r"/static/([\w.-]+)", path):
            file = STATIC / match[1]
            if file.is_file():
                body, kind = file.read_bytes(), KINDS.get(file.suffix, "text/plain")
        elif match := re.fullmatch(r"/asset/(\d+)", path):
            body, kind = self.recording.pictures[int(match[1])], "image/svg+xml"
        status = HTTPStatus.OK if body is not None else HTTPStatus.NOT_FOUND
        headers = Headers({
            "Content-Type": f"{kind}; charset=utf-8", "Content-Security-Policy": CSP,
            "Cache-Control": "no-store", "Content-Length": str(len(body or b"")),
        })  # fmt: skip
        return Response(status.value, status.phrase, headers, body or b"")

    async def talk(self, socket: ServerConnection) -> None:
        session = Session(self.recording, self.options)

        async def send(message: Any) -> None:
            await socket.send(json.dumps(message))

        with suppress(ConnectionClosed):
            await send(self.hello | {"controls": session.controls})
            for message in session.past():
                await send(message)
            await send({"type": "control", "controls": session.controls, "clients": 1})
            await send(session.now())
            playing = asyncio.create_task(self.play(session, send))
            try:
                async for text in socket:
                    message = json.loads(text)
                    answer = await asyncio.to_thread(session.answer, message)
                    if answer:
                        await send(answer)
                    if message["type"] == "restart":
                        for past in session.past():
                            await send(past)
                    await send(session.now())
            finally:
                playing.cancel()

    async def play(self, session: Session, send: Any) -> None:
        last = time.monotonic()
        while True:
            await asyncio.sleep(0.05)
            now = time.monotonic()
            was = session.status
            for message in session.advance(now - last):
                await send(message)
            last = now
            if was == "running":
                await send(session.now())


async def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("file")
    parser.add_argument("spec")
    parser.add_argument("--port", type=int, default=8123)
    parser.add_argument("--at", type=float, default=0.0)
    for flag in ("live", "panel", "watch", "real-time"):
        parser.add_argument(f"--{flag}", action="store_true")
    parser.add_argument("--notice", action="append", default=[])
    options = parser.parse_args()
    server = Server(options)
    async with serve(server.talk, "127.0.0.1", options.port, process_request=server.http):
        print(f"http://127.0.0.1:{options.port}/", flush=True)
        await asyncio.Future()


if __name__ == "__main__":
    asyncio.run(main())
