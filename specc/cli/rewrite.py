"""Files written anew by `fmt` and `--fix`: aside, then renamed."""

from __future__ import annotations

import contextlib
import difflib
import errno
import os
import shlex
import shutil
import tomllib
from argparse import Namespace
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from specc.atomic_files import replacing_file
from specc.cli import streams
from specc.cli.targets import find_targets, is_argument
from specc.diagnostics import Diagnostic
from specc.diagnostics.report import Finding, Repair, report, resolve, shown_path
from specc.policy import allowed_paths
from specc.read import read_file, read_text, specification
from specc.refusal import reason_of
from specc.repair import Accepts, apply_compatible, changes_elsewhere, is_wrong_again
from specc.source import Place, Sources, real_path
from specc.tools.fmt import formatted, upgrade

# Writing a file: whole or not at all.


def rewrite_file(path: str, text: str) -> None:
    """Make `text` the content of a file that exists; links, owner and permissions stay.

    Raises:
        OSError: the system refuses, nobody may write the file, or a link leads out of the project;
            the file is unchanged.
    """
    if not allowed_paths(path).contains(path):
        raise OSError(errno.EPERM, "a link leads out of the project", path)
    try:
        _rewrite(Path(os.path.realpath(path)), text.encode())
    except OSError as error:
        # Not the name of the new file beside it, which nobody knows.
        raise OSError(error.errno, error.strerror, path) from error


def unwritable(error: OSError) -> Diagnostic:
    """The finding about a file that could not be rewritten."""
    message = f"the file cannot be written: {reason_of(error)}"
    hint = "it is unchanged; check its permissions, those of its directory and the space there"
    return Diagnostic("E0090", message, Place(str(error.filename)), help=hint)


def _rewrite(target: Path, content: bytes) -> None:
    status = target.stat()
    if not os.access(target, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    with replacing_file(target) as aside:
        aside.write_bytes(content)
        shutil.copymode(target, aside)
        with contextlib.suppress(OSError):
            os.chown(aside, status.st_uid, status.st_gid)


# `specc validate --fix`: makes the repairs that findings carry, file by file.


ROUNDS = 10
"""A repair can uncover what another one hid; more rounds than this would be a cycle."""
_MARK = "\ufeff"


def apply_repairs(findings: Iterable[Finding], arguments: Sequence[str], earlier: set[str]) -> bool:
    """Make the repairs of findings in files that arguments name, and say which; whether any was.

    No repair leads back to one of the `earlier` texts; those that are repaired now join them.

    Raises:
        OSError: a file cannot be written; those before it are repaired.
    """
    found = repairs_by_file(findings)
    named = [(path, wanted) for path, wanted in found.items() if is_argument(path, arguments)]
    made = [_mend(path, wanted, earlier) for path, wanted in named]
    return any(made)


def print_unapplied(findings: Iterable[Finding], arguments: Sequence[str]) -> None:
    """Say which files could be repaired but were not named, and how to have them repaired."""
    for path, wanted in repairs_by_file(findings).items():
        if is_argument(path, arguments):
            continue
        repairs = "1 repair" if len(wanted) == 1 else f"{len(wanted)} repairs"
        name = (os.path.dirname(path) or ".") if path.endswith(".toml") else path
        command = shlex.join(["specc", "validate", "--fix", *arguments, name])
        streams.print_message(
            f"not repaired, since it was not named: {path} ({repairs}); `{command}`"
        )


def repairs_by_file(findings: Iterable[Finding]) -> dict[str, dict[Repair, Finding]]:
    """Repairs that findings carry, each once, by the file that they change."""
    found: dict[str, dict[Repair, Finding]] = {}
    seen: dict[object, str] = {}
    for finding in findings:
        if (repair := finding.repair) is None:
            continue
        # A file that was read under two names is still one file.
        real = os.path.realpath(repair.file)
        path = seen.setdefault(real, repair.file)
        edits = real, tuple((change.start, change.end, change.text) for change in repair.changes)
        if edits not in seen:
            seen[edits] = path
            found.setdefault(path, {})[repair] = finding
    return found


def _mend(path: str, wanted: dict[Repair, Finding], earlier: set[str]) -> bool:
    with open(path, encoding="utf-8", newline="") as file:
        text = file.read()
    mark = _MARK if text.startswith(_MARK) else ""
    earlier.add(text.removeprefix(_MARK))
    is_meant = _accepts(path, wanted)

    def accepts(new: str, repairs: tuple[Repair, ...]) -> bool:
        return new not in earlier and is_meant(new, repairs)

    result = apply_compatible(text.removeprefix(_MARK), wanted, accepts)
    if result.applied:
        rewrite_file(path, mark + result.text)
    for repair in result.applied:
        line = repair.changes[0].span.line
        code = wanted[repair].diagnostic.code
        streams.print_message(f"repaired {path}:{line}: {code}: {repair.title}")
    return bool(result.applied)


def _accepts(path: str, wanted: dict[Repair, Finding]) -> Accepts:
    if path.endswith(".toml"):
        return lambda text, _: _is_toml(text)
    from specc.pipeline import read_spec

    before = read_spec(path).system

    def accepts(text: str, repairs: tuple[Repair, ...]) -> bool:
        if not read_text("mended", text).ok:
            return False
        after = read_spec(path, {real_path(path): text})
        found = [wanted[repair].diagnostic for repair in repairs]
        if is_wrong_again(found, after.diagnostics):
            return False
        places = [edit.place for one in found if one.fix for edit in one.fix.edits]
        if before is None or after.system is None:
            return True
        return not changes_elsewhere(before, after.system, places)

    return accepts


def _is_toml(text: str) -> bool:
    try:
        tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        return False
    return True


# `specc fmt`: the canonical layout of files, written, compared or shown as a difference.


def fmt(options: Namespace) -> int:
    """Put files into the canonical layout, or say which are not in it; the exit code."""
    meant = find_targets(options.files)
    findings = resolve(meant.faults, Sources())
    changed, readable, files = [], 0, [*meant.systems, *meant.parts]
    only_look = options.check or options.diff
    for path in files:
        reach = allowed_paths(path)
        if not reach.contains(path):
            findings += resolve([reach.link_finding(path)], Sources())
            continue
        document = specification(read_file(path))
        if not document.ok:
            findings += resolve(document.diagnostics, Sources([document.source]))
            continue
        readable += 1
        old = document.source.text
        new = formatted(old, upgrade if options.upgrade else None)
        if new == old:
            continue
        changed.append(path)
        if options.diff:
            streams.print_output("".join(_difference(path, old, new)))
        if not only_look:
            findings += resolve(_rewritten(path, new), Sources())
    if readable:
        _summarise(changed, readable, only_look)
    code = streams.print_report(report(findings, files)) if findings else 0
    return code or int(bool(changed) and options.check)


def _rewritten(path: str, text: str) -> Iterator[Diagnostic]:
    try:
        rewrite_file(path, text)
    except OSError as error:
        yield unwritable(error)


def _difference(path: str, old: str, new: str) -> Iterator[str]:
    name = shown_path(path)
    before, after = old.splitlines(keepends=True), new.splitlines(keepends=True)
    for line in difflib.unified_diff(before, after, f"{name} (now)", f"{name} (formatted)"):
        yield line if line.endswith("\n") else f"{line}\n"


def _summarise(changed: list[str], files: int, only_looked: bool) -> None:
    what = "would be formatted" if only_looked else "formatted"
    for path in changed:
        streams.print_message(f"{what}: {shown_path(path)}")
    same = files - len(changed)
    streams.print_message(f"{len(changed)} of {files} {what}, {same} left as they are")
