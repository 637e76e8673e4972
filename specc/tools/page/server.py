"""The server of the page: one for a live run and for a recording, which are its sources.

It listens on this machine only, and answers nobody who does not know the token of its URL. What a
browser gets is a message, a file of the page by a fixed name, or an asset by its number: no path.
"""

from __future__ import annotations

import asyncio
import hmac
import logging
import re
import secrets
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from http import HTTPStatus
from pathlib import Path
from typing import Any, Protocol
from urllib.parse import parse_qs

from websockets.asyncio import server as sockets
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from specc.diagnostics.visible import visible
from specc.tools.page.clients import Client, Watched
from specc.tools.page.messages import (
    Asset,
    Malformed,
    Message,
    Picture,
    json_text,
    number_in,
    plain_in,
    read_message,
    text_in,
    texts_in,
)

STATIC = Path(__file__).with_name("static")
_HOST = "127.0.0.1"
_LONGEST_REASON = 300
_LARGEST_BYTES = 1 << 18
"""Of a message of a browser."""
_HEADERS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; "
    "img-src 'self' blob:; connect-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}
_TYPES = {
    ".css": "text/css; charset=utf-8",
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".svg": "image/svg+xml",
}
_TEXT = "text/plain; charset=utf-8"
_ASSET = re.compile(r"/asset/(\d{1,6})", re.ASCII)
_TOKEN = re.compile(r"[\w-]{1,200}", re.ASCII)


class Source(Protocol):
    """What is shown. Of the moment is `now` and `command`; the others may take their time.

    The server asks `hello`, `spans`, `marks`, `now` and `command` in its loop, `asset` in a thread
    for these, and the others in a further one, one after the other. `time_s` None stands for now,
    or for the end.
    """

    def hello(self) -> Message | None:
        """See `hello` of the protocol, without `controls`; None: it has not begun."""

    def spans(self) -> Message:
        """`{machine: [[begin_s, end_s or None, state]]}`, the whole past."""

    def marks(self) -> list[Message]:
        """The marks of the whole past."""

    def now(self) -> Message:
        """See `now` of the protocol."""

    def moment(self, time_s: float | None, signals: list[str] | None) -> Message:
        """See `moment`, with the values of these signals, or of all."""

    def why(self, machine: str, time_s: float | None) -> Message:
        """`time_s` and `lines` of `why`."""

    def series(self, name: str, time_s: float | None, window_s: float) -> Message:
        """See `series`."""

    def asset(self, number: int) -> Asset | None:
        """None if there is none of that number, or it cannot be made."""

    def picture(self, camera: str, time_s: float | None) -> Picture | None:
        """The last picture until then, if there is one."""

    def objection(self, values: Mapping[str, str]) -> str:
        """Why a run cannot start again with other constants, by their names; "" if it can."""

    def command(self, message: Message) -> str:
        """Obey a message of the browser that controls; why not, if it is refused.

        `watch` comes from the server: `{clients, cameras, scene}` of all browsers together.
        """


class Server:
    """Serves a source. All methods are called in the event loop."""

    def __init__(self, source: Source, port: int = 0, static: Path = STATIC) -> None:
        """`port` 0: any that is free."""
        self._source = source
        self._port = port
        self._token = secrets.token_urlsafe(32)
        self._files = {
            f"/static/{path.name}": Asset(_TYPES[path.suffix], path.read_bytes())
            for path in sorted(static.glob("*"))
            if path.suffix in _TYPES
        }
        self._clients: list[Client] = []
        """The first one controls."""
        self._is_begun = False
        self._questions = ThreadPoolExecutor(1, "questions")
        self._assets = ThreadPoolExecutor(1, "assets")
        self._tasks: set[asyncio.Future[None]] = set()
        """Checks of what is to start again."""
        self._breakpoints: list[Any] = []
        """Those of the controlling browser; they outlive the run."""

    @property
    def url(self) -> str:
        """The URL for the browser, with the token."""
        return f"http://{_HOST}:{self._port}/?token={self._token}"

    async def start(self) -> None:
        """Listen. Raises OSError."""
        log = logging.getLogger("specc.page")
        log.addHandler(logging.NullHandler())
        log.propagate = False
        self._server = await sockets.serve(
            self._attend,
            _HOST,
            self._port,
            process_request=self._answer_request,
            compression=None,
            server_header=None,
            open_timeout=60,
            ping_interval=5,
            ping_timeout=5,
            close_timeout=1,
            max_size=_LARGEST_BYTES,
            write_limit=1 << 16,
            logger=log,
        )
        self._port = next(iter(self._server.sockets)).getsockname()[1]

    async def stop(self) -> None:
        """End all connections."""
        self._server.close()
        await self._server.wait_closed()
        for worker in (self._questions, self._assets):
            worker.shutdown(wait=False, cancel_futures=True)

    # What the source has to say.

    def begin(self) -> None:
        """Tell all browsers of a run that begins: all of it."""
        self._is_begun = True
        for client in self._clients:
            client.forget()
            self._welcome(client)
        self._tell_watch()

    def tell(self, message: Message) -> None:
        """Send a message to all browsers."""
        text = json_text(message) if self._clients else ""
        for client in self._clients:
            client.put(text)

    def tell_now(self) -> None:
        """Send what is now; it replaces what was not sent yet."""
        if self._clients:
            text = json_text({"type": "now", **self._source.now()})
            for client in self._clients:
                client.put_latest("now", text)
                client.take_back("news")

    def tell_news(self, news: Message) -> None:
        """Send parts of what is now; the others stay as they are."""
        if self._clients:
            text = json_text({"type": "now", **news})
            for client in self._clients:
                client.put_latest("news", text)

    def tell_picture(self, picture: Picture) -> None:
        """Send a picture to the browsers that show its camera."""
        for client in self._clients:
            if client.watched.camera == picture.camera:
                client.put_latest("picture", picture.message)

    def _welcome(self, client: Client) -> None:
        """Send what a browser has to know first."""
        hello = self._source.hello() if self._is_begun else None
        if hello is None:
            return
        every = (
            {"type": "hello", **hello, "controls": self._controls(client)},
            {"type": "spans", "spans": self._source.spans(), "replace": True},
            {"type": "marks", "marks": self._source.marks(), "replace": True},
            {"type": "breakpoints", "breakpoints": self._breakpoints},
        )
        for message in every:
            client.put(json_text(message))
        client.put_latest("now", json_text({"type": "now", **self._source.now()}))

    # HTTP.

    async def _answer_request(
        self, connection: sockets.ServerConnection, request: Request
    ) -> Response | None:
        """The answer to a request, None for a WebSocket that is let in."""
        hosts, origins = (request.headers.get_all(name) for name in ("Host", "Origin"))
        if len(hosts) != 1 or hosts[0] not in (f"{_HOST}:{self._port}", f"localhost:{self._port}"):
            return _refusal(HTTPStatus.FORBIDDEN)
        if getattr(request, "method", "GET") != "GET":  # early releases know no other
            return _refusal(HTTPStatus.METHOD_NOT_ALLOWED)
        path, _, query = request.path.partition("?")
        if origins and origins != [f"http://{hosts[0]}"]:
            return _refusal(HTTPStatus.FORBIDDEN)
        if path == "/" and query:
            return self._enter(query)
        if not self._is_known(request.headers):
            return _refusal(HTTPStatus.FORBIDDEN)
        if path == "/ws":
            return None if origins else _refusal(HTTPStatus.FORBIDDEN)
        return await self._file(path)

    def _enter(self, query: str) -> Response:
        """Put the token of the URL into a cookie; its name has the port, for cookies ignore it."""
        tokens = parse_qs(query).get("token", [""])
        if not self._is_token(tokens[0]):
            return _refusal(HTTPStatus.FORBIDDEN)
        cookie = f"{self._cookie}={self._token}; HttpOnly; SameSite=Strict; Path=/"
        return _response(HTTPStatus.SEE_OTHER, _TEXT, b"", {"Location": "/", "Set-Cookie": cookie})

    @property
    def _cookie(self) -> str:
        return f"specc-{self._port}"

    def _is_known(self, headers: Headers) -> bool:
        cookies = [each.strip() for text in headers.get_all("Cookie") for each in text.split(";")]
        own = f"{self._cookie}="
        return any(self._is_token(each[len(own) :]) for each in cookies if each.startswith(own))

    def _is_token(self, text: str) -> bool:
        return bool(_TOKEN.fullmatch(text)) and hmac.compare_digest(text, self._token)

    async def _file(self, path: str) -> Response:
        if path == "/favicon.ico":
            return _response(HTTPStatus.NO_CONTENT, _TEXT, b"")
        found = self._files.get("/static/index.html" if path == "/" else path)
        if number := _ASSET.fullmatch(path):
            loop, make = asyncio.get_running_loop(), self._source.asset
            found = await loop.run_in_executor(self._assets, make, int(number[1]))
        if found is None:
            return _refusal(HTTPStatus.NOT_FOUND)
        return _response(HTTPStatus.OK, found.content_type, found.content)

    # Browsers.

    async def _attend(self, connection: sockets.ServerConnection) -> None:
        """Talk with a browser until it goes."""
        client = Client(connection)
        self._clients.append(client)
        tasks = [
            asyncio.ensure_future(each) for each in (client.write(), client.answer(self._reply))
        ]
        try:
            self._welcome(client)
            self._tell_control()
            async for text in connection:
                self._read(client, text)
        finally:
            for task in tasks:
                task.cancel()
            self._clients.remove(client)
            self._tell_control()

    def _controls(self, client: Client) -> bool:
        return self._clients[:1] == [client]

    def _tell_control(self) -> None:
        """Tell browsers which of them controls, and the source what they watch."""
        for client in self._clients:
            control = {"controls": self._controls(client), "clients": len(self._clients)}
            client.put_latest("control", json_text({"type": "control", **control}))
        self._tell_watch()

    def _tell_watch(self) -> None:
        watched = [client.watched for client in self._clients]
        cameras = sorted({each.camera for each in watched} - {""})
        is_scene = any(each.scene for each in watched)
        about = {"clients": len(watched), "cameras": cameras, "scene": is_scene}
        self._source.command({"type": "watch", **about})

    def _read(self, client: Client, text: str | bytes) -> None:
        """Obey a message of a browser, or say why not."""
        try:
            message = read_message(text)
            kind = message["type"]
            if kind in _QUESTIONS and self._is_begun:
                client.ask(*_QUESTIONS[kind](message))
            elif kind == "watch":
                self._watch(client, message)
            elif kind == "take":
                self._clients.remove(client)
                self._clients.insert(0, client)
                self._tell_control()
            elif kind not in _COMMANDS:
                raise Malformed("its type is unknown")
            elif not self._controls(client):
                raise Malformed("another browser controls")
            else:
                self._obey(client, _COMMANDS[kind](message))
        except Malformed as error:
            client.put(json_text({"type": "refused", "text": str(error)}))

    def _watch(self, client: Client, message: Message) -> None:
        """Note what a browser shows. Raises Malformed."""
        signals = texts_in(message, "signals") if message.get("signals") is not None else None
        if signals is not None and message.get("frames") is not None:
            signals += texts_in(message, "frames")
        camera = text_in(message, "camera") if message.get("camera") is not None else ""
        client.watched = Watched(signals, camera, message.get("scene") is not False)
        self._tell_watch()

    def _obey(self, client: Client, message: Message) -> None:
        """Do what a browser commands, or check first whether it can be. Raises Malformed."""
        values = message.get("set", {})
        if message["type"] == "set" and isinstance(message["value"], str):
            values = {message["name"]: message["value"]}  # not while the run goes on
        elif message["type"] != "restart":
            return self._command(message)
        task = asyncio.ensure_future(self._start_again(client, message, values))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return None

    async def _start_again(self, client: Client, message: Message, values: Message) -> None:
        """Let the source start again, unless that cannot be."""
        try:
            objection = await self._ask(self._source.objection, values)
            if not objection and not self._controls(client):
                objection = "another browser controls"
            if not objection:
                self._command(message)
        except Exception as error:  # noqa: BLE001  # the browser waits for an answer
            objection = visible(str(error)[:_LONGEST_REASON]) or type(error).__name__
        if objection:
            client.put(json_text({"type": "refused", "text": objection}))

    def _command(self, message: Message) -> None:
        """Let the source obey. Raises Malformed."""
        if refusal := self._source.command(message):
            raise Malformed(refusal)
        if message["type"] == "break":
            self._breakpoints = message["breakpoints"]
            self.tell({"type": "breakpoints", "breakpoints": self._breakpoints})

    async def _reply(self, client: Client, question: Message) -> None:
        """Answer a question of a browser, or say why it cannot be answered."""
        try:
            await self._answer_question(client, question)
        except Exception as error:  # noqa: BLE001  # one question must not end all answers
            text = f"no answer: {visible(str(error)[:_LONGEST_REASON]) or type(error).__name__}"
            client.put(json_text({"type": "refused", "id": question["id"], "text": text}))

    async def _ask(self, question: Callable[..., Any], *arguments: Any) -> Any:
        loop = asyncio.get_running_loop()
        return await loop.run_in_executor(self._questions, question, *arguments)

    async def _answer_question(self, client: Client, question: Message) -> None:
        kind, name, time_s = question["type"], question.get("name", ""), question["time_s"]
        source, watched = self._source, client.watched
        if kind == "look":
            found = await self._ask(source.moment, time_s, watched.signals)
            client.put_latest("moment", _answer(question, "moment", found))
            if watched.camera:
                picture = await self._ask(source.picture, watched.camera, time_s)
                if picture is not None:
                    client.put_latest("picture", picture.message)
        elif kind == "why":
            found = await self._ask(source.why, question["machine"], time_s)
            client.put_latest(("why", question["machine"]), _answer(question, "why", found))
        else:
            window_s = question["window_s"]
            found = await self._ask(source.series, name, time_s, window_s)
            client.put_latest(("series", name), _answer(question, "series", found))


def _response(
    status: HTTPStatus, content_type: str, content: bytes, more: Mapping[str, str] | None = None
) -> Response:
    length = {"Content-Type": content_type, "Content-Length": str(len(content))}
    headers = Headers({**_HEADERS, **length, "Connection": "close", **(more or {})})
    return Response(status.value, status.phrase, headers, content)


def _refusal(status: HTTPStatus) -> Response:
    return _response(status, _TEXT, f"{status.value} {status.phrase}\n".encode())


def _answer(question: Message, kind: str, found: Message) -> str:
    return json_text({"type": kind, "id": question["id"], **found})


# What browsers ask and command; each function raises Malformed.

KeyedQuestion = tuple[Any, Message]
"""The kind, of which only the last one is answered, and the question."""


def _question(message: Message) -> dict[str, Any]:
    number = message.get("id")
    if type(number) is not int or abs(number) > 1 << 53:
        raise Malformed("its id is no number")
    return {"type": message["type"], "id": number, "time_s": number_in(message, "time_s")}


def _look(message: Message) -> KeyedQuestion:
    return "look", _question(message)


def _why(message: Message) -> KeyedQuestion:
    machine = text_in(message, "machine")
    return ("why", machine), {**_question(message), "machine": machine}


def _series(message: Message) -> KeyedQuestion:
    name, window_s = text_in(message, "name"), number_in(message, "window_s")
    if window_s is None or window_s <= 0:
        raise Malformed("its window_s is no length")
    return ("series", name), {**_question(message), "name": name, "window_s": window_s}


_QUESTIONS: dict[str, Callable[[Message], KeyedQuestion]] = {
    "look": _look,
    "why": _why,
    "series": _series,
}


def _speed(message: Message) -> Message:
    value = number_in(message, "value")
    if value is not None and value <= 0:
        raise Malformed("its value is no speed")
    return {"type": "speed", "value": value}


def _break(message: Message) -> Message:
    breakpoints = message.get("breakpoints")
    if not isinstance(breakpoints, list) or len(breakpoints) > 200:
        raise Malformed("its breakpoints are no list, or too many")
    if not all(isinstance(each, dict) and _is_flat(each) for each in breakpoints):
        raise Malformed("a breakpoint has more than names and numbers")
    return {"type": "break", "breakpoints": breakpoints}


def _is_flat(data: Message) -> bool:
    """Whether it has only few texts and numbers."""
    is_plain = all(isinstance(value, str | int | float | None) for value in data.values())
    return is_plain and len(data) < 10


def _restart(message: Message) -> Message:
    values = message.get("set", {})
    if not isinstance(values, dict) or len(values) > 10_000:
        raise Malformed("its set is no set of constants")
    texts = {name: text_in(values, name) for name in values}
    return {"type": "restart", "from_s": number_in(message, "from_s"), "set": texts}


def _set(message: Message) -> Message:
    value = plain_in(message, "value")
    return {"type": message["type"], "name": text_in(message, "name"), "value": value}


def _hold(message: Message) -> Message:
    """With the newest wall time of the run that the browser knows."""
    seen_s = plain_in(message, "wall_s")
    return {"type": "hold", "name": text_in(message, "name"), "wall_s": seen_s}


def _plain(*names: str) -> Callable[[Message], Message]:
    """The command with these texts."""

    def read(message: Message) -> Message:
        return {"type": message["type"], **{name: text_in(message, name) for name in names}}

    return read


_COMMANDS: dict[str, Callable[[Message], Message]] = {
    "pause": _plain(),
    "continue": _plain(),
    "step": _plain("machine"),
    "speed": _speed,
    "break": _break,
    "set": _set,
    "panel": _set,
    "hold": _hold,
    "release": _plain("name"),
    "restart": _restart,
}
