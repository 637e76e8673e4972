"""Offsets, positions and what happens to them while a text is edited."""

import random

import pytest
from lsprotocol.types import Position

from specc.source import SourceFile
from specc.tools.lsp.session import Positions
from specc.tools.lsp.unfinished import Shift, shift

TEXT = "a: 1\r\nβ: '🦾 x'\n\n𝔹𝔹: ok\rlast"
SOURCE = SourceFile("file", TEXT)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "utf-32"])
def test_positions_read_back(encoding: str) -> None:
    columns = Positions(encoding)
    for offset in range(len(TEXT) + 1):
        if TEXT[offset - 1 : offset + 1] == "\r\n":
            continue
        assert columns.offset_at(SOURCE, columns.position_at(SOURCE, offset)) == offset


@pytest.mark.parametrize(("encoding", "character"), [("utf-8", 10), ("utf-16", 7), ("utf-32", 6)])
def test_columns_count_code_units(encoding: str, character: int) -> None:
    where = Positions(encoding).position_at(SOURCE, TEXT.index("x"))
    assert where == Position(1, character)


def test_positions_beyond_the_text_are_held_inside() -> None:
    columns = Positions()
    assert columns.offset_at(SOURCE, Position(0, 99)) == 4
    assert columns.offset_at(SOURCE, Position(1, 99)) == TEXT.index("\n\n")
    assert columns.offset_at(SOURCE, Position(99, 0)) == len(TEXT)
    # Between the two halves of a surrogate pair is behind the character.
    assert columns.offset_at(SOURCE, Position(3, 1)) == TEXT.index("𝔹") + 1


def applied(moved: Shift, old: str, new: str) -> str:
    """The old text with the changes made."""
    text = old
    for before, after in reversed(list(moved.changes())):
        text = text[: before.start] + new[after] + text[before.stop :]
    return text


def test_shift_keeps_what_was_not_edited() -> None:
    rng = random.Random(5)
    for _ in range(300):
        old = "".join(rng.choices("ab\n", k=rng.randrange(30)))
        start = rng.randint(0, len(old))
        end = rng.randint(start, len(old))
        new = old[:start] + "".join(rng.choices("ab", k=rng.randrange(4))) + old[end:]
        moved = shift(old, new)
        ends = {there + size for _, there, size in moved.blocks}
        for offset, char in enumerate(old):
            there = moved.to_new(offset)
            if offset < start:
                assert there == offset
            elif there is not None and there not in ends:
                assert new[there] == char
        assert applied(moved, old, new) == new
        assert moved.to_new(len(old)) is not None


def test_shift_keeps_what_lies_between_two_edits() -> None:
    old = "".join(f"line {number}\n" for number in range(40))
    new = old.replace("line 3\n", "line three\n").replace("line 30\n", "")
    moved = shift(old, new)
    assert applied(moved, old, new) == new
    for number in set(range(40)) - {3, 30}:
        there = moved.to_new(old.index(f"line {number}\n") + 1)
        assert there == new.index(f"line {number}\n") + 1
        assert moved.to_old(there) == old.index(f"line {number}\n") + 1
    assert moved.to_new(old.index("line 30") + 3) is None
