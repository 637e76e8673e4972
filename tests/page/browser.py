"""A headless Chromium by its DevTools protocol: pages, clicks and keys, errors and requests."""

from __future__ import annotations

import base64
import json
import os
import shutil
import signal
import subprocess
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from itertools import count
from pathlib import Path
from typing import Any, Literal

from websockets.sync.client import ClientConnection, connect

Json = dict[str, Any]
NAMES = ("chromium", "chromium-browser", "google-chrome")
START_S = 30.0
WAIT_S = 30.0
POLL_S = 0.03
_OPTIONS = (
    "--headless=new",
    "--remote-debugging-port=0",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-breakpad",
    "--disable-crash-reporter",
    "--disable-component-update",
    "--disable-default-apps",
    "--disable-extensions",
    "--disable-sync",
    "--disable-dev-shm-usage",
    "--enable-unsafe-swiftshader",
    "--mute-audio",
)
KEYS: Mapping[str, tuple[str, int, str]] = {
    "Tab": ("Tab", 9, ""),
    "Enter": ("Enter", 13, "\r"),
    "Escape": ("Escape", 27, ""),
    " ": ("Space", 32, " "),
    "ArrowLeft": ("ArrowLeft", 37, ""),
    "ArrowUp": ("ArrowUp", 38, ""),
    "ArrowRight": ("ArrowRight", 39, ""),
    "ArrowDown": ("ArrowDown", 40, ""),
    "Home": ("Home", 36, ""),
    "End": ("End", 35, ""),
}
"""Name -> code, number and text of keys that are no letters."""
SHIFT = 8


def program() -> str | None:
    """The path of an installed Chromium."""
    return next(filter(None, map(shutil.which, NAMES)), None)


class Browser:
    """A running Chromium; each page has cookies and a cache of its own."""

    def __init__(self, profile: Path, environment: Mapping[str, str] | None = None) -> None:
        path = program()
        assert path is not None, f"none of {', '.join(NAMES)} is installed"
        rights = ("--no-sandbox",) if os.geteuid() == 0 else ()
        self._process = subprocess.Popen(
            [path, *_OPTIONS, *rights, f"--user-data-dir={profile}", "about:blank"],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env={**os.environ, **(environment or {})},
            start_new_session=True,
        )
        self._numbers = count(1)
        self._events: dict[str, list[Json]] = {}
        """By session; what no page has asked for yet."""
        with ExitStack() as opened:
            opened.callback(self._kill)
            url = self._url(profile / "DevToolsActivePort")
            self._connection: ClientConnection = opened.enter_context(
                connect(url, max_size=None, open_timeout=START_S)
            )
            self._open = opened.pop_all()

    def _url(self, file: Path) -> str:
        end = time.monotonic() + START_S
        while not (file.is_file() and len(lines := file.read_text().split()) == 2):
            assert self._process.poll() is None, "Chromium ended as it started"
            assert time.monotonic() < end, f"Chromium has no page after {START_S:g} s"
            time.sleep(POLL_S)
        port, path = lines
        return f"ws://127.0.0.1:{port}{path}"

    @contextmanager
    def page(self) -> Iterator[Page]:
        """A new page, which is closed at the end."""
        context = self.call("Target.createBrowserContext")["browserContextId"]
        target = self.call("Target.createTarget", url="about:blank", browserContextId=context)
        session = self.call("Target.attachToTarget", flatten=True, **target)["sessionId"]
        try:
            yield Page(self, session)
        finally:
            self.resume()
            self.call("Target.disposeBrowserContext", browserContextId=context)
            self._events.pop(session, None)

    def call(self, method: str, session: str = "", **parameters: object) -> Json:
        """The answer to a command; events that come before it are kept."""
        number = next(self._numbers)
        message = {"id": number, "method": method, "params": parameters}
        self._connection.send(json.dumps(message | ({"sessionId": session} if session else {})))
        while True:
            got = json.loads(self._connection.recv(timeout=START_S))
            if got.get("id") == number:
                assert "error" not in got, f"{method}: {got['error']}"
                result: Json = got["result"]
                return result
            if "method" in got:
                self._events.setdefault(got.get("sessionId", ""), []).append(got)

    def events(self, session: str) -> list[Json]:
        """All events of a page until now."""
        return self._events.setdefault(session, [])

    def stop(self) -> None:
        """Stop all its processes, as if the computer did something else."""
        os.killpg(self._process.pid, signal.SIGSTOP)

    def resume(self) -> None:
        os.killpg(self._process.pid, signal.SIGCONT)

    def close(self) -> None:
        with self._open:
            self.resume()
            self.call("Browser.close")
            self._process.wait(START_S)

    def _kill(self) -> None:
        with suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()


class Page:
    """A page in a browser: what it shows, says and asks for."""

    def __init__(self, browser: Browser, session: str) -> None:
        self._browser = browser
        self._session = session
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **parameters: object) -> Json:
        return self._browser.call(method, self._session, **parameters)

    def open(self, url: str) -> None:
        """Go to a URL; what it loads may come later."""
        answer = self.call("Page.navigate", url=url)
        assert "errorText" not in answer, f"{url}: {answer['errorText']}"

    def show(self, html: str) -> None:
        """Show a document from a text."""
        frame = self.call("Page.getFrameTree")["frameTree"]["frame"]["id"]
        self.call("Page.setDocumentContent", frameId=frame, html=html)

    def evaluate(self, expression: str) -> Any:
        """The value of an expression in JavaScript, of a promise when it has one."""
        done = self.call(
            "Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True
        )
        thrown = done.get("exceptionDetails")
        assert not thrown, f"{expression}: {thrown.get('exception', thrown)}"
        return done["result"].get("value")

    def wait_for(self, expression: str, timeout_s: float = WAIT_S) -> Any:
        """The value of an expression as soon as JavaScript takes it for true."""
        end = time.monotonic() + timeout_s
        while (value := self.evaluate(expression)) in (None, False, 0, ""):
            late = f"after {timeout_s:g} s: {expression} is {value!r}; {self.errors()[:3]}"
            assert time.monotonic() < end, late
            time.sleep(POLL_S)
        return value

    def point(self, selector: str) -> tuple[float, float]:
        """The centre of an element as soon as it is there; it is scrolled into view."""
        self.wait_for(f"document.querySelector({json.dumps(selector)})")
        x, y, is_hit, over = self.evaluate(
            f"""(() => {{
                const element = document.querySelector({json.dumps(selector)});
                const place = {{block: "center", inline: "center", behavior: "instant"}};
                element.scrollIntoView(place);
                const box = element.getBoundingClientRect();
                const x = box.x + box.width / 2, y = box.y + box.height / 2;
                const hit = document.elementFromPoint(x, y);
                return [x, y, element.contains(hit), hit?.outerHTML.slice(0, 200)];
            }})()"""
        )
        assert is_hit, f"{selector} is behind {over}"
        return x, y

    def press(self, x: float, y: float) -> None:
        """Press the mouse at a point, until `release`."""
        self._mouse("mouseMoved", x, y)
        self._mouse("mousePressed", x, y, button="left", buttons=1, clickCount=1)

    def move(self, x: float, y: float, buttons: int = 0) -> None:
        self._mouse("mouseMoved", x, y, buttons=buttons, button="left" if buttons else "none")

    def release(self, x: float, y: float) -> None:
        self._mouse("mouseReleased", x, y, button="left", clickCount=1)

    def click(self, selector: str) -> None:
        """Click at the centre of an element."""
        point = self.point(selector)
        self.press(*point)
        self.release(*point)

    def _mouse(self, kind: str, x: float, y: float, **more: object) -> None:
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, **more)

    def key(self, key: str, shift: bool = False) -> None:
        """Press and release a key, by its name or its letter."""
        self.key_down(key, shift)
        self.key_up(key, shift)

    def key_down(self, key: str, shift: bool = False) -> None:
        text = KEYS[key][2] if key in KEYS else key
        self._key(
            "keyDown" if text else "rawKeyDown", key, shift, **({"text": text} if text else {})
        )

    def key_up(self, key: str, shift: bool = False) -> None:
        self._key("keyUp", key, shift)

    def _key(self, kind: str, key: str, shift: bool, **more: object) -> None:
        code, number, _ = KEYS.get(key, (f"Key{key.upper()}", ord(key.upper()[0]), ""))
        self.call(
            "Input.dispatchKeyEvent",
            type=kind,
            key=key,
            code=code,
            windowsVirtualKeyCode=number,
            modifiers=SHIFT if shift else 0,
            **more,
        )

    def size(self, width: int, height: int) -> None:
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=False,
        )

    def media(
        self, scheme: Literal["light", "dark"] = "light", reduced_motion: bool = False
    ) -> None:
        """What the user prefers."""
        motion = "reduce" if reduced_motion else "no-preference"
        features = {"prefers-color-scheme": scheme, "prefers-reduced-motion": motion}
        named = [{"name": name, "value": value} for name, value in features.items()]
        self.call("Emulation.setEmulatedMedia", features=named)

    def screenshot(self, path: Path) -> None:
        """Write a PNG picture of what is in view."""
        picture = self.call("Page.captureScreenshot", format="png")["data"]
        path.write_bytes(base64.b64decode(picture))

    def roles(self) -> set[tuple[str, str]]:
        """The roles and names of all that a screen reader knows of."""
        nodes = self.call("Accessibility.getFullAXTree")["nodes"]
        return {
            (one.get("role", {}).get("value", ""), one.get("name", {}).get("value", ""))
            for one in nodes
            if not one["ignored"]
        }

    def errors(self) -> list[str]:
        """The errors in the console of the page, and what scripts threw."""
        found = []
        for name, event in self._events():
            if name == "Runtime.consoleAPICalled" and event["type"] == "error":
                words = (str(each.get("value", each.get("description"))) for each in event["args"])
                found.append(" ".join(words))
            elif name == "Runtime.exceptionThrown":
                details = event["exceptionDetails"]
                found.append(str(details.get("exception", {}).get("description", details)))
            elif name == "Log.entryAdded" and event["entry"]["level"] == "error":
                found.append(f"{event['entry']['text']} {event['entry'].get('url', '')}")
        return found

    def requests(self) -> list[str]:
        """The URLs that were asked for, those of WebSockets too."""
        return [
            event["request"]["url"] if name == "Network.requestWillBeSent" else event["url"]
            for name, event in self._events()
            if name in ("Network.requestWillBeSent", "Network.webSocketCreated")
        ]

    def _events(self) -> Iterator[tuple[str, Json]]:
        self.evaluate("1")  # what has happened until now comes before the answer
        return ((each["method"], each["params"]) for each in self._browser.events(self._session))
