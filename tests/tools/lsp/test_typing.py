"""Somebody types into the flagship: what is offered, and how soon errors are told."""

import re
import statistics
import sys
import time
from typing import Any

import pytest

from tests.house.tree import ROOT
from tests.tools.lsp.client import Client

SERVER = [sys.executable, "-m", "specc", "lsp"]
FLAGSHIP = ROOT / "specs/irp_picking.yaml"
SESSIONS = [
    (
        "          terminal:\n            idle_ended: {eq: 11",
        "            stopped: {eq: 10, when: fresh(x.c.b) and any(v == s for v in x.c.b)}",
        {"fresh(": "x", "x.": "c", "x.c.": "b", "and an": "any", "v == ": "s", "10, w": "when"},
    ),
    (
        "          - [S0,    terminal, p2p_commanded,     S1]",
        "          - [S1, terminal, force_commanded, S2]",
        {"- [": "S0", "[S1, ": "terminal", "terminal, ": "idle_commanded", "commanded, ": "S2"},
    ),
    (
        "          # position-force control: Fig. 13",
        "          watch: {title: new, r_p: r_d, y.c.T_c: T_c, m_d: held.c_d}",
        {"new, r": "r_p", "r_p: r": "r_d", "y": "y.c.T_c", "y.c.T_c: T": "T_c", "held.": "c_d"},
    ),
    (
        "        initial_state: S0\n        transitions: # Table 4",
        "          S3: {behaviour: p2p, title: New}",
        {"{b": "behaviour", "behaviour: ": "idle", "behaviour: p": "p2p"},
    ),
    (
        "        conditions:\n          initial:\n            idle_commanded",
        '          far: {is: "norm(position(T_c) - position(T_g)) > 0.1[m]", title: far away}',
        {'"no': "norm", "position(T_": "T_c", "0.1[": "m"},
    ),
    (
        "        let:\n          q_c: {is: MJ",
        '          f_p: {type: "wrench[E]", init: "[0, 0, 0, 0, 0, 0]"}',
        {"{": "type", '"w': "wrench", "wrench[": "B", ", i": "init"},
    ),
]


def position(text: str, offset: int) -> tuple[int, int]:
    return text.count("\n", 0, offset), offset - text.rfind("\n", 0, offset) - 1


def proposals(found: dict[str, Any], typed: str) -> list[str]:
    """What an editor shows: in the order of the server, filtered by the word at the cursor."""
    word = re.search(r"\w*$", typed)
    assert word
    items = sorted(found["items"], key=lambda item: item["sortText"])
    labels = [item["label"] for item in items]
    return [label for label in labels if label.lower().startswith(word.group().lower())]


@pytest.mark.parametrize(("before", "line", "wanted"), SESSIONS)
def test_what_is_wanted_is_among_the_first(before: str, line: str, wanted: dict[str, str]) -> None:
    text = FLAGSHIP.read_text()
    assert text.count(before) == 1
    start = text.index(before)
    left, waited = dict(wanted), []
    with Client(SERVER, ROOT) as client:
        uri = client.open(FLAGSHIP)
        assert client.diagnostics(uri) == []
        ends = {line.index(ending) + len(ending) for ending in wanted}
        for size in sorted({*range(1, len(line) + 1, 5), *ends}):
            typed = line[:size]
            now = f"{text[:start]}{typed}\n{text[start:]}"
            changed = time.perf_counter()
            client.change(uri, now)
            client.diagnostics(uri)
            waited.append(time.perf_counter() - changed)
            at = position(now, start + size)
            found = client.ask("completion", uri, *at)
            client.ask("hover", uri, at[0], at[1] - 1)
            client.ask("signatureHelp", uri, *at)
            for ending in [ending for ending in left if typed.endswith(ending)]:
                label = left.pop(ending)
                assert label in proposals(found, typed)[:5], ending
        client.change(uri, text)
        assert client.diagnostics(uri) == []
    assert left == {}
    assert client.exit_code == 0
    # A tenth of this where nothing else runs; the bound is for machines that do much else.
    assert statistics.median(waited) < 1.0
