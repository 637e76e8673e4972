"""Which files a specification may name: those inside its project."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass

from specc.diagnostics import Diagnostic
from specc.limits import MAX_ENTRIES
from specc.resources import is_library_part
from specc.source import Place

_CLAIM = re.compile(r"""(?:^|[\r{,])\ufeff?[ \t]*(["']?)specc\1[ \t]*:""", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class AllowedPaths:
    """Folders, by their real paths, of which the first is the project; without any, everything."""

    folders: tuple[str, ...] = ()

    def contains(self, path: str) -> bool:
        """Whether a file lies inside, wherever links lead, or is a part of the library."""
        if is_library_part(path):
            return True
        try:
            real = os.path.realpath(path)
        except ValueError:  # not a valid file name, which reading it will report
            return True
        return not self.folders or any(
            os.path.commonpath((real, folder)) == folder for folder in self.folders
        )

    def hint_to_allow(self, path: str) -> str:
        """What to do about a file that lies outside."""
        real = os.path.realpath(path)
        folder = real if os.path.isdir(real) else os.path.dirname(real)
        beyond = os.path.relpath(folder, self.folders[0])
        return (
            "move it below the folder of the specification or of the pyproject.toml above it, or "
            f'allow its folder in that file: `[tool.specc]` with `allow = ["{beyond}"]`'
        )

    def escaping_link(self, folder: str) -> str | None:
        """A link below a folder that leads outside; None if there is none.

        Raises:
            OverflowError: there is more below it than `MAX_ENTRIES`.
        """
        seen, waiting = {os.path.realpath(folder)}, [folder]
        count = 0
        while waiting and self.folders:
            for path in _entries(waiting.pop()):
                count += 1
                if count > MAX_ENTRIES:
                    raise OverflowError(f"the folder has more than {MAX_ENTRIES} files")
                if os.path.islink(path) and not self.contains(path):
                    return path
                if os.path.isdir(path) and (real := os.path.realpath(path)) not in seen:
                    seen.add(real)
                    waiting.append(path)
        return None

    def link_finding(self, path: str) -> Diagnostic:
        """The finding about a path that the command line gives, and that lies outside."""
        message = "a symbolic link leads out of the project"
        return Diagnostic("E0021", message, Place(path), help=self.hint_to_allow(path))


def _entries(folder: str) -> list[str]:
    try:
        return [os.path.join(folder, name) for name in sorted(os.listdir(folder))]
    except OSError:  # a folder that cannot be listed is not read either
        return []


ANYWHERE = AllowedPaths()


def claims_to_be_specification(text: str) -> bool:
    """Whether a text says that it is a specification; any other must not be shown."""
    return _CLAIM.search(text) is not None
