"""Texts that are no XML, or hardly: refused with a place, never with a traceback."""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from hypothesis import strategies as st

from specc.tools.importers import Notes, import_fabric, import_scxml
from specc.tools.importers.reading import MarkupError, parse_markup
from tests.seeds import drawn, every
from tests.tools.importers.conftest import FILES, Workshop

TEXTS = {path.name: path.read_text(encoding="utf-8") for path in FILES.iterdir()}
MADE_OF = [
    "<", ">", "/", '"', "'", "&", "&amp;", "&x;", "<!--", "-->", "]]>", "<state>", "</state>", "\0",
    "é", "\u2028", "(", ")", " and ", " not ", "IN_ERROR", "<?xml", "=", "xmlns:a=", "<![CDATA[",
    'initial="', "TRUE", "*", "0", "-1", "1e9", "\ud7ff", "🙂", "event=", "<final/>",
]  # fmt: skip


def mutated(text: str, random_: random.Random) -> str:
    for _ in range(random_.randint(1, 4)):
        i, j = sorted(random_.randint(0, len(text)) for _ in range(2))
        j = min(j, i + 60)
        kind = random_.randrange(4)
        if kind == 0:
            text = text[:i] + text[j:]
        elif kind == 1:
            text = text[:i] + random_.choice(MADE_OF) + text[i:]
        elif kind == 2:
            text = text[:j] + text[i:j] + text[j:]
        else:
            k = random_.randint(0, len(text))
            text = text[:k] + text[i:j] + text[k:]
    return text


def tried(name: str, text: str, workshop: Workshop) -> Notes:
    if name.endswith("scxml"):
        return workshop.scxml(text)
    return workshop.fabric(text)


@pytest.mark.parametrize("name", every(3, sorted(TEXTS)))
def test_mutated_files(name: str, tmp_path: Path) -> None:
    """What is refused says why and where; what is accepted is a specification with a meaning."""
    random_, workshop = random.Random(name), Workshop(tmp_path)
    accepted = 0
    for _ in range(250):
        text = mutated(TEXTS[name], random_)
        made = tried(name, text, workshop)
        errors = [d for d in made.diagnostics if d.severity == "error"]
        assert bool(errors) != bool(made.text)
        for diagnostic in made.diagnostics:
            span = made.sources.span(diagnostic.primary)
            assert 1 <= span.line <= text.count("\n") + 1
        if made.text:
            accepted += 1
            found = {d.code for d in workshop.compile(made).diagnostics}
            allowed = ("W06", "W04") if name.endswith("scxml") else ("E06", "W06", "E04", "W04")
            assert not {c for c in found if c[:3] not in allowed}, text
    assert accepted > 2


@drawn(st.text(alphabet=st.sampled_from("<>/=\"'& ab\n!-[]?;é"), max_size=60), few=15, many=150)
def test_any_text_is_parsed_or_refused(text: str) -> None:
    try:
        root = parse_markup("a.xml", text)
    except MarkupError as refusal:
        start = refusal.diagnostic.primary.start
        assert start is not None and 0 <= start <= len(text)
    else:
        assert text[root.start] == "<" and text[root.end - 1] == ">"


@pytest.mark.parametrize(
    "text",
    [
        '<!DOCTYPE %s [<!ENTITY a "b">]><%s>&a;</%s>',
        '<!DOCTYPE %s SYSTEM "file:///etc/hostname"><%s/>',
        "<!DOCTYPE %s><%s/>",
    ],
)
def test_document_types_are_refused_before_anything_is_expanded(
    text: str, workshop: Workshop
) -> None:
    kinds = ("scxml", workshop.scxml), ("subsystem_definition", workshop.fabric)
    for made in (take(text.replace("%s", root)) for root, take in kinds):
        assert [d.code for d in made.diagnostics] == ["E0801"]


def test_deep_and_large_texts_are_refused(workshop: Workshop) -> None:
    deep = "<scxml>" * 5000 + "</scxml>" * 5000
    large = "<scxml>" + "<state/>" * 60_000 + "</scxml>"
    for text in (deep, large):
        assert [d.code for d in workshop.scxml(text).diagnostics] == ["E0801"]


def test_positions_count_characters(workshop: Workshop) -> None:
    text = '<scxml>\n<!-- żółć 🙂 -->\n<state id="ą"/><state id="ą"/></scxml>'
    (found,) = workshop.scxml(text).diagnostics
    assert text[found.primary.start : found.primary.end] == "ą"
    assert found.primary.start == text.rindex("ą")


def test_an_encoding_in_the_declaration_changes_nothing(workshop: Workshop) -> None:
    text = '<?xml version="1.0" encoding="ISO-8859-2"?><scxml><state id="a" x="ą"/></scxml>'
    made = workshop.scxml(text)
    assert "`x` of <state>" in "".join(d.message for d in made.diagnostics)


def test_files_that_give_no_text(tmp_path: Path) -> None:
    (tmp_path / "latin.xml").write_bytes(b"<a>\xe9</a>")
    assert import_fabric([str(tmp_path / "none.xml")]).diagnostics[0].code == "E0001"
    assert import_scxml(str(tmp_path)).diagnostics[0].code == "E0001"
    assert import_fabric([str(tmp_path / "latin.xml")]).diagnostics[0].code == "E0005"
