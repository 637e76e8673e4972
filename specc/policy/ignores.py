"""Comments for specc: `# specc: ignore[W0412] reason`, and what is wrong with them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

from specc.diagnostics import Diagnostic, Edit, Fix, nearest, severity_of
from specc.diagnostics.code import all_codes
from specc.limits import MAX_IGNORED
from specc.read.comments import Comment, comments_of
from specc.source import Place, SourceFile

_ADDRESSED = re.compile(r"#\s*specc:\s*(?P<words>.*)")
_IGNORE = r"ignore\s*\[(?P<codes>[^\]]*)\]\s*[:—-]?\s*(?P<reason>.*)"
_LIKE_A_CODE = re.compile(r"\b[EWO]\d{4}\b")
_LINE_BREAK = re.compile(r"\r\n|\r|\n")
_CODE = re.compile(r"[^\s,]+")
_FORM = "write `# specc: ignore[W0412] reason`"


@dataclass(frozen=True, slots=True)
class Ignore:
    """One code of an ignore comment.

    Findings of this code on `line` are suppressed if the comment gives a reason; `rest` are the
    other codes of the same comment.
    """

    code: str
    line: int
    place: Place
    comment: Comment
    reason: str
    other_codes: tuple[str, ...]


def ignores_of(source: SourceFile) -> tuple[list[Ignore], list[Diagnostic]]:
    """The codes that comments of a file suppress, and findings about such comments."""
    ignores: list[Ignore] = []
    findings: list[Diagnostic] = []
    # Most files have no such comment; looking for all comments would cost more than this.
    if _ADDRESSED.search(source.text) is None:
        return ignores, findings
    for comment in comments_of(source):
        if words := _ADDRESSED.fullmatch(comment.text):
            taken = re.fullmatch(_IGNORE, words["words"])
            if taken is None or _ADDRESSED.search(taken["reason"]):
                findings.append(_not_understood(source, comment))
                continue
            codes = list(_CODE.finditer(taken["codes"]))
            if len(codes) > MAX_IGNORED:
                findings.append(_too_many(source, comment))
                continue
            begin = comment.start + words.start("words") + taken.start("codes")
            for entry in _entries(source, comment, taken["reason"], codes, begin):
                fault = _fault(source, entry)
                if fault is None:
                    ignores.append(entry)
                else:
                    findings.append(fault)
    return ignores, findings


def unused(source: SourceFile, entry: Ignore) -> Diagnostic:
    """The finding about a code that suppresses nothing."""
    message = f"there is no {entry.code} here to ignore"
    if entry.other_codes:
        codes = ", ".join(entry.other_codes)
        edit = Edit(_codes_place(source, entry.comment), codes)
        fix = Fix(f"take {entry.code} out of the comment", (edit,))
    else:
        fix = Fix("delete the comment", (Edit(_whole(source, entry.comment), ""),))
    hint = "delete it: it would hide a finding that appears here later"
    return Diagnostic("W0901", message, entry.place, help=hint, fix=fix)


def _entries(
    source: SourceFile, comment: Comment, reason: str, codes: list[re.Match[str]], begin: int
) -> Iterator[Ignore]:
    line = _line_meant(source, comment)
    for number, code in enumerate(codes):
        place = Place(source.path, (), "text", begin + code.start(), begin + code.end())
        rest = tuple(other[0] for other in codes[:number] + codes[number + 1 :])
        yield Ignore(code[0], line, place, comment, reason, rest)
    if not codes:
        yield Ignore("", line, Place(source.path, (), "text", begin, begin), comment, "", ())


def _line_meant(source: SourceFile, comment: Comment) -> int:
    """The line of the comment, or the next one that is neither empty nor a comment alone."""
    line = source.span(Place(source.path, (), "text", comment.start, comment.end)).line
    return source.next_with_content[line] if comment.is_whole_line else line


def _fault(source: SourceFile, entry: Ignore) -> Diagnostic | None:
    if entry.code not in all_codes():
        what = f"no finding has the code `{entry.code}`" if entry.code else "no code is given"
        return Diagnostic("E0903", what, entry.place, help=_code_hint(entry.code))
    if severity_of(entry.code) != "warning":
        message = f"{entry.code} is not a warning and cannot be ignored"
        return Diagnostic("E0904", message, entry.place, help="correct what it reports")
    if not entry.reason:
        hint = f"give the reason: `# specc: ignore[{entry.code}] because ...`"
        return _finding(source, entry.comment, "E0902", "the reason is missing", hint)
    return None


@lru_cache
def _code_hint(code: str) -> str:
    if code and any(known.startswith(code) for known in all_codes()):
        return "a comment must name whole codes"
    close = nearest(code, all_codes())
    same = [known for known in close if known.casefold() == code.casefold()]
    listed = " or ".join(f"`{known}`" for known in same or close)
    return f"did you mean {listed}?" if listed else _FORM


def _not_understood(source: SourceFile, comment: Comment) -> Diagnostic:
    """The finding about a comment of another form, with what it was probably meant to say."""
    codes = [code for code in _LIKE_A_CODE.findall(comment.text) if code in all_codes()]
    if not codes:
        return _finding(source, comment, "E0903", "specc does not understand this comment")
    rest = comment.text[comment.text.rindex(codes[-1]) + len(codes[-1]) :].strip(" ]):,—-")
    hint = f"write `# specc: ignore[{', '.join(codes)}] {rest or 'reason'}`"
    return _finding(source, comment, "E0903", "specc does not understand this comment", hint)


def _too_many(source: SourceFile, comment: Comment) -> Diagnostic:
    hint = f"a comment names at most {MAX_IGNORED} codes"
    return _finding(source, comment, "E0903", "this names too many codes", hint)


def _finding(
    source: SourceFile, comment: Comment, code: str, message: str, hint: str = _FORM
) -> Diagnostic:
    place = Place(source.path, (), "text", comment.start, comment.start + len(comment.text))
    return Diagnostic(code, message, place, help=hint)


def _codes_place(source: SourceFile, comment: Comment) -> Place:
    start = source.text.index("[", comment.start) + 1
    return Place(source.path, (), "text", start, source.text.index("]", start))


def _whole(source: SourceFile, comment: Comment) -> Place:
    """The comment with the white space before it, and its line if it stands there alone."""
    text, start = source.text, comment.start
    while start > 0 and text[start - 1] in " \t":
        start -= 1
    end = comment.end
    if comment.is_whole_line:
        end = broken.end() if (broken := _LINE_BREAK.match(text, end)) else end
    return Place(source.path, (), "text", start, end)
