"""The file of a report: one script and one style, named by its policy, and data that is neither."""

from __future__ import annotations

import base64
import json
import re
from hashlib import sha256
from html.parser import HTMLParser
from typing import Any

from specc.tools.report.document import STATIC, bundled, document, row, table

HOSTILE = "</script><script>alert(1)</script><!--\u2028]]>&\"'{{script}}\u202e\x1b[31m"


class _Elements(HTMLParser):
    """The scripts and styles of a document with their attributes and texts, and all addresses."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str | None], str]] = []
        self.addresses: list[str | None] = []
        self.others: list[tuple[str, dict[str, str | None]]] = []
        self._is_within = False
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        named = dict(attrs)
        self.addresses += [value for name, value in attrs if name in ("href", "src", "action")]
        self._is_within = tag in ("script", "style")
        if self._is_within:
            self.found.append((tag, named, ""))
        else:
            self.others.append((tag, named))

    def handle_endtag(self, tag: str) -> None:
        self._is_within = False

    def handle_data(self, data: str) -> None:
        if self._is_within:
            tag, named, text = self.found[-1]
            self.found[-1] = tag, named, text + data


def _made(**hello: Any) -> _Elements:
    about = {"tables": [table(HOSTILE, [HOSTILE], [row([HOSTILE])])], "facts": []}
    return _Elements(document(HOSTILE, about, [json.dumps({"title": HOSTILE, **hello})]))


def test_what_runs_is_named_by_its_digest_and_nothing_is_loaded() -> None:
    made = _made()
    (policy,) = (
        a["content"] or ""
        for tag, a in made.others
        if tag == "meta" and a.get("http-equiv") == "Content-Security-Policy"
    )
    allowed = dict(part.strip().split(" ", 1) for part in policy.split(";"))
    run = [(tag, text) for tag, a, text in made.found if a.get("type") != "application/json"]
    assert [tag for tag, _ in run] == ["style", "script"]
    for tag, text in run:
        digest = base64.b64encode(sha256(text.encode()).digest()).decode()
        assert allowed[f"{tag}-src"] == f"'sha256-{digest}'"
    rest = {n: v for n, v in allowed.items() if n not in ("style-src", "script-src")}
    none = dict.fromkeys(("default-src", "base-uri", "form-action"), "'none'")
    assert rest == {**none, "img-src": "data:"}
    assert made.addresses == []


def test_data_stays_data() -> None:
    made = _made()
    data = {a["id"]: text for _, a, text in made.found if a.get("type") == "application/json"}
    assert [*data] == ["about", "run-0"]
    assert json.loads(data["run-0"]) == {"title": HOSTILE}
    (shown,) = json.loads(data["about"])["tables"]
    assert shown["title"] == HOSTILE
    assert "\x1b" not in shown["rows"][0]["cells"][0]
    assert not any("<" in text or "\u2028" in text for text in data.values())


def test_the_title_is_text() -> None:
    text = document(HOSTILE, {"tables": [], "facts": []}, [])
    found = re.search("<title>(.*?)</title>", text, re.DOTALL)
    assert found and "<" not in found[1] and "\x1b" not in text and "\u202e" not in text
    assert "{{script}}" in text, "what looks like a place of the template is text"


def test_each_module_is_there_once_after_what_it_uses() -> None:
    script = bundled()
    assert not re.search(r"^(import|export)\b", script, re.MULTILINE)
    modules = re.findall(r"^const (module_\w+) = ", script, re.MULTILINE)
    assert len(modules) == len(set(modules)) and modules[-1] == "module_report"
    own = {f"module_{path.stem}" for path in STATIC.glob("*.js")}
    assert own < set(modules)
    for used in re.finditer(r"^const \{[^}]*\} = (module_\w+);", script, re.MULTILINE):
        assert script.index(f"const {used[1]} = (()") < used.start()
