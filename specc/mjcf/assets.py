"""Which files an MJCF model names beside those that it includes."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field

_FACES = ("fileright", "fileleft", "fileup", "filedown", "filefront", "fileback")
_FILLED = ("mesh", "gmsh")
"""Types of `<flexcomp>` that come from a file; the others count points."""
_KINDS = {"hfield": "height field"} | {tag: tag for tag in ("mesh", "model", "skin", "texture")}


@dataclass(eq=False, slots=True)
class Assets:
    """Meshes, height fields, textures, skins and models, and the folders where they are.

    MuJoCo looks for a file in one folder, which depends on its version where sections contradict
    one another; every folder that may be meant counts. Attributes that MuJoCo does not look at, as
    the file of a texture that it draws itself, name nothing that the model uses.
    """

    _files: list[tuple[str, str]] = field(default_factory=list)
    _unopened: list[tuple[str, str]] = field(default_factory=list)
    _models: list[tuple[str, str]] = field(default_factory=list)
    _folders: dict[str, set[str]] = field(default_factory=dict)
    _stripped: bool = False

    def take(self, tag: str, attributes: Mapping[str, str]) -> None:
        """Take note of an element."""
        if tag == "compiler":
            for name in ("assetdir", "meshdir", "texturedir"):
                if name in attributes:
                    self._folders.setdefault(name, set()).add(attributes[name])
            self._stripped |= attributes.get("strippath") == "true"
        elif tag != "include":
            opened = _opened(tag, attributes)
            for name, value in attributes.items():
                if value and name.startswith("file"):
                    (self._files if name in opened else self._unopened).append((tag, value))
            if tag == "model":
                self._models.append((attributes.get("name", ""), attributes.get("file", "")))

    def paths(self, base: str) -> Iterator[tuple[str, bool]]:
        """Where the files may be for a model in the folder `base`; whether MuJoCo opens them."""
        for named, is_opened in ((self._files, True), (self._unopened, False)):
            for tag, file in named:
                yield from ((place, is_opened) for place in self._places(base, tag, file))

    def there(self, base: str) -> Iterator[tuple[str, ...]]:
        """The places of each file where there is one."""
        for tag, file in dict.fromkeys(self._files):
            if found := tuple(filter(os.path.isfile, self._places(base, tag, file))):
                yield found

    def unopened(self, base: str) -> Iterator[str]:
        """Files that are there and that are named where MuJoCo does not look."""
        for tag, file in dict.fromkeys(self._unopened):
            yield from filter(os.path.isfile, self._places(base, tag, file))

    def missing(self, base: str) -> Iterator[str]:
        """What is in none of the places where it may be, in words."""
        for tag, file in dict.fromkeys(self._files):
            if not any(map(os.path.isfile, self._places(base, tag, file))):
                yield f"the {_KINDS.get(tag, 'file')} {file}"

    def models(self, base: str) -> Iterator[tuple[str, str]]:
        """The models to attach: a name, which may be empty, and where the file may be."""
        for name, file in self._models:
            yield from ((name, path) for path in self._places(base, "model", file))

    def _places(self, base: str, tag: str, file: str) -> Iterator[str]:
        name = os.path.basename(file) if self._stripped else file
        yield from (os.path.join(base, folder, name) for folder in sorted(self._folders_of(tag)))

    def _folders_of(self, tag: str) -> set[str]:
        own = self._folders.get("texturedir" if tag == "texture" else "meshdir", set())
        found = own | self._folders.get("assetdir", set())
        beside = tag not in ("mesh", "hfield", "texture")
        return found | {""} if beside or not found else found


def _opened(tag: str, attributes: Mapping[str, str]) -> Collection[str]:
    """The attributes of an element that name a file which MuJoCo opens."""
    if tag == "flexcomp":
        return ("file",) if attributes.get("type") in _FILLED else ()
    if tag not in _KINDS or attributes.get("builtin", "none") != "none":
        return ()
    return _FACES if tag == "texture" and not attributes.get("file") else ("file",)
