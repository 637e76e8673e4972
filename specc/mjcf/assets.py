"""Which files an MJCF model names beside those that it includes."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import field

from specc.frozen import mutable

_KINDS = {"hfield": "height field"} | {tag: tag for tag in ("mesh", "model", "skin", "texture")}


@mutable
class Assets:
    """Meshes, height fields, textures, skins and models, and the folders where they are.

    MuJoCo looks for a file in one folder, which depends on its version where sections contradict
    one another; every folder that may be meant counts.
    """

    _files: list[tuple[str, str]] = field(default_factory=list)
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
            # A texture of a cube has six: `fileright`, `fileleft`, ...
            named = (value for name, value in attributes.items() if name.startswith("file"))
            self._files += [(tag, value) for value in named if value]
            if tag == "model":
                self._models.append((attributes.get("name", ""), attributes.get("file", "")))

    def paths(self, base: str) -> Iterator[str]:
        """Where the files may be for a model in the folder `base`."""
        for tag, file in self._files:
            yield from self._places(base, tag, file)

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
