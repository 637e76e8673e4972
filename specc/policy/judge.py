"""Which findings are shown, and which of them refuse a specification.

A comment `# specc: ignore[W0412] reason` suppresses warnings on its line, settings suppress them
everywhere.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from specc.diagnostics import Diagnostic, Edit, Fix, nearest, severity_of
from specc.diagnostics.code import MERGED, all_codes
from specc.limits import MAX_IGNORED
from specc.policy.settings import Settings
from specc.reachable import grouped
from specc.read.document import Comment, comments_of
from specc.source import Place, SourceFile, Sources

_OF_OTHERS = "W10", "W11"
"""Codes of what only `specc explore` and `specc coverage` find; other commands leave comments about
them alone."""


@dataclass(frozen=True, slots=True)
class Judgement:
    """Findings that are left; `used` are the places of the codes in comments that suppressed some.

    `ignored` counts the findings that comments or settings suppress.
    """

    diagnostics: tuple[Diagnostic, ...]
    ignored: int = 0
    used: frozenset[Place] = frozenset()

    @property
    def refused(self) -> bool:
        """Whether an error is left."""
        return any(finding.severity == "error" for finding in self.diagnostics)


def judge(
    diagnostics: Iterable[Diagnostic],
    sources: Sources,
    settings: Settings,
    is_complete: bool = True,
) -> Judgement:
    """Apply ignore comments, then settings.

    Errors and open points always pass. A comment counts as used also if the settings would hold the
    finding back too. While there are errors or open points, or if the users of a file are left
    open (it is not complete), not everything has been checked, and no comment is called unused.
    """
    found = list(dict.fromkeys(diagnostics))
    ignores: list[tuple[SourceFile, Ignore]] = []
    others: list[Diagnostic] = []
    for source in sources:
        entries, faults = ignores_of(source)
        ignores += [(source, entry) for entry in entries]
        others += faults
    by_line = grouped(((s.path, entry.line, entry.code), entry.place) for s, entry in ignores)
    shown: list[Diagnostic] = []
    used: set[Place] = set()
    for finding in found:
        places = None
        if by_line:
            span = sources.span(finding.primary)
            places = by_line.get((span.file, span.line, finding.code))
        if places is not None:
            used.update(places)
        elif settings.shows(finding):
            shown.append(finding)
    ignored = len(found) - len(shown)
    if is_complete and all(finding.severity == "warning" for finding in found):
        others += [
            _unused_ignore(source, entry)
            for source, entry in ignores
            if entry.place not in used and not entry.code.startswith(_OF_OTHERS)
        ]
    shown += filter(settings.shows, others)
    if settings.strict:
        shown = [replace(finding, promoted=not finding.code.startswith("E")) for finding in shown]
    return Judgement(tuple(shown), ignored, frozenset(used))


# Comments for specc, and what is wrong with them.


_ADDRESSED = re.compile(r"#\s*specc:\s*(?P<words>.*)")
_IGNORE = r"ignore\s*\[(?P<codes>[^\]]*)\]\s*[:—-]?\s*(?P<reason>.*)"
_LIKE_A_CODE = re.compile(r"\b[EWO]\d{4}\b")
_LINE_BREAK = re.compile(r"\r\n|\r|\n")
_CODE = re.compile(r"[^\s,]+")
_FORM = "write `# specc: ignore[W0412] reason`"


@dataclass(frozen=True, slots=True)
class Ignore:
    """One code of an ignore comment: it suppresses findings on `line` if there is a reason."""

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
        if (addressed := _ADDRESSED.fullmatch(comment.text)) is None:
            continue
        match = re.fullmatch(_IGNORE, addressed["words"])
        if match is None or _ADDRESSED.search(match["reason"]):
            message = "specc does not understand this comment"
            findings.append(_finding(source, comment, "E0903", message, _hint_for_comment(comment)))
            continue
        codes = list(_CODE.finditer(match["codes"]))
        if len(codes) > MAX_IGNORED:
            hint = f"a comment names at most {MAX_IGNORED} codes"
            findings.append(_finding(source, comment, "E0903", "this names too many codes", hint))
            continue
        begin = comment.start + addressed.start("words") + match.start("codes")
        for entry in _ignores_in_comment(source, comment, match["reason"], codes, begin):
            if fault := _ignore_fault(source, entry):
                findings.append(fault)
            else:
                ignores.append(entry)
    return ignores, findings


def _ignores_in_comment(
    source: SourceFile, comment: Comment, reason: str, codes: list[re.Match[str]], begin: int
) -> Iterator[Ignore]:
    line = source.span(_text(source, comment.start, comment.end)).line
    if comment.is_whole_line:
        line = source.next_with_content[line]
    for number, code in enumerate(codes):
        place = _text(source, begin + code.start(), begin + code.end())
        others = tuple(other[0] for other in codes[:number] + codes[number + 1 :])
        yield Ignore(code[0], line, place, comment, reason, others)
    if not codes:
        yield Ignore("", line, _text(source, begin, begin), comment, "", ())


def _ignore_fault(source: SourceFile, entry: Ignore) -> Diagnostic | None:
    known = all_codes()
    if entry.code not in known and entry.code not in MERGED:
        message = f"no finding has the code `{entry.code}`" if entry.code else "no code is given"
        hint = _FORM
        if entry.code and any(code.startswith(entry.code) for code in known):
            hint = "a comment must name whole codes"
        elif close := nearest(entry.code, known):
            same = [code for code in close if code.casefold() == entry.code.casefold()]
            hint = f"did you mean {' or '.join(f'`{code}`' for code in same or close)}?"
        return Diagnostic("E0903", message, entry.place, help=hint)
    if severity_of(entry.code) != "warning":
        message = f"{entry.code} is not a warning and cannot be ignored"
        return Diagnostic("E0903", message, entry.place, help="correct what it reports")
    if not entry.reason:
        hint = f"give the reason: `# specc: ignore[{entry.code}] because ...`"
        return _finding(source, entry.comment, "E0903", "the reason is missing", hint)
    return None


def _hint_for_comment(comment: Comment) -> str:
    """What a comment of another form was probably meant to be."""
    codes = [code for code in _LIKE_A_CODE.findall(comment.text) if code in all_codes()]
    if not codes:
        return _FORM
    reason = comment.text[comment.text.rindex(codes[-1]) + len(codes[-1]) :].strip(" ]):,—-")
    return f"write `# specc: ignore[{', '.join(codes)}] {reason or 'reason'}`"


def _unused_ignore(source: SourceFile, entry: Ignore) -> Diagnostic:
    """The finding about a code that suppresses nothing."""
    text, start, end = source.text, entry.comment.start, entry.comment.end
    if entry.other_codes:
        first = text.index("[", start) + 1
        edit = Edit(_text(source, first, text.index("]", first)), ", ".join(entry.other_codes))
        fix = Fix(f"take {entry.code} out of the comment", (edit,))
    else:
        start = len(text[:start].rstrip(" \t"))
        if entry.comment.is_whole_line and (line_break := _LINE_BREAK.match(text, end)):
            end = line_break.end()
        fix = Fix("delete the comment", (Edit(_text(source, start, end), ""),))
    hint = "delete it: it would hide a finding that appears here later"
    message = f"there is no {entry.code} here to ignore"
    return Diagnostic("W0901", message, entry.place, help=hint, fix=fix)


def _finding(
    source: SourceFile, comment: Comment, code: str, message: str, hint: str
) -> Diagnostic:
    place = _text(source, comment.start, comment.start + len(comment.text))
    return Diagnostic(code, message, place, help=hint)


def _text(source: SourceFile, start: int, end: int) -> Place:
    return Place(source.path, (), "text", start, end)
