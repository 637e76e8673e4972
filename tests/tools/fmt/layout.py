"""What the formatter keeps of any text."""

from specc.read import read_text
from specc.read.document import comments_of
from specc.tools.fmt import format_text


def words(text: str) -> str:
    """The letters of all comments, in an order that does not depend on the layout."""
    found = comments_of(read_text("a.yaml", text).source)
    return "".join(sorted("".join("".join(comment.text for comment in found).split())))


def keeps_what_is_written(text: str) -> None:
    """The layout keeps data and comments, and is its own layout."""
    new = format_text(text)
    assert all(line == line.rstrip() for line in new.splitlines())
    if new == text:
        return
    before, after = read_text("a.yaml", text), read_text("a.yaml", new)
    assert before.ok and after.ok
    assert before.data == after.data
    assert words(text) == words(new)
    assert format_text(new) == new
