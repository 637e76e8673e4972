"""Meshes as binary glTF 2.0 files (GLB) of bounded size, for views in 3D.

Source: Khronos Group, glTF 2.0 specification, https://registry.khronos.org/glTF/specs/2.0/.
"""

from __future__ import annotations

from struct import pack
from typing import Any

import numpy as np

from specc_runtime.plant import Mesh
from specc_runtime.recording.pictures import png
from specc_runtime.recording.text import dumped

MOST_TRIANGLES = 10_000
"""Triangles of a mesh; a larger one is made coarser."""
MOST_OF_ALL = 200_000
"""Triangles of all meshes of a scene."""
_MOST_TEXELS = 256
"""Texels along an edge of a texture."""
_UP = [-(0.5**0.5), 0.0, 0.0, 0.5**0.5]
"""In glTF y points up, in a scene z: readers turn by 90 degrees about x."""
_FLOAT, _WHOLE = 5126, 5125
_CELLS = 256

Array = np.ndarray[Any, Any]


def glb(mesh: Mesh, most: int = MOST_TRIANGLES) -> bytes:
    """The file of a mesh, with its colour or texture, made coarser down to `most` triangles.

    A mesh that is made coarser loses its texture.
    """
    corners, triangles = coarser(mesh.corners, mesh.triangles, most)
    positions = corners.astype("<f4")
    views = [positions.tobytes(), triangles.astype("<u4").tobytes()]
    bounds = {"min": positions.min(axis=0).tolist(), "max": positions.max(axis=0).tolist()}
    accessors = [
        _accessor(0, _FLOAT, "VEC3", len(corners)) | bounds,
        _accessor(1, _WHOLE, "SCALAR", triangles.size),
    ]
    attributes = {"POSITION": 0}
    look: dict[str, Any] = {"baseColorFactor": list(mesh.colour), "metallicFactor": 0.0}
    more: dict[str, Any] = {}
    if mesh.texels is not None and mesh.uv is not None and triangles is mesh.triangles:
        attributes["TEXCOORD_0"] = 2
        accessors.append(_accessor(2, _FLOAT, "VEC2", len(mesh.uv)))
        every = -(-max(mesh.texels.shape[:2]) // _MOST_TEXELS)
        views += [mesh.uv.astype("<f4").tobytes(), png(mesh.texels[::every, ::every])]
        more = {
            "textures": [{"source": 0}],
            "images": [{"bufferView": 3, "mimeType": "image/png"}],
        }
        look["baseColorTexture"] = {"index": 0}
    primitive = {"attributes": attributes, "indices": 1, "material": 0}
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "rotation": _UP}],
        "meshes": [{"primitives": [primitive]}],
        "materials": [{"pbrMetallicRoughness": look, "doubleSided": True}],
        "accessors": accessors,
        **more,
    }
    return _packed(document, views)


def _accessor(view: int, kind: int, form: str, count: int) -> dict[str, Any]:
    return {"bufferView": view, "componentType": kind, "type": form, "count": count}


def _packed(document: dict[str, Any], views: list[bytes]) -> bytes:
    """The file of a glTF document and the parts of its buffer, aligned to words."""
    parts, places, size = [view + bytes(-len(view) % 4) for view in views], [], 0
    for part, view in zip(parts, views, strict=True):
        places.append({"buffer": 0, "byteOffset": size, "byteLength": len(view)})
        size += len(part)
    text = dumped(document | {"buffers": [{"byteLength": size}], "bufferViews": places})
    text += b" " * (-len(text) % 4)
    head = pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + size)
    return (
        head
        + pack("<I4s", len(text), b"JSON")
        + text
        + pack("<I4s", size, b"BIN\0")
        + b"".join(parts)
    )


def coarser(corners: Array, triangles: Array, most: int) -> tuple[Array, Array]:
    """Vertex clustering: merge the corners in each cell of a grid, as fine as `most` allows.

    Triangles that collapse to lines or points, and duplicates, are left out.
    """
    if len(triangles) <= most:
        return corners, triangles
    cells = _CELLS
    vertices, found = corners, triangles
    low = corners.min(axis=0)
    edge = float((corners.max(axis=0) - low).max()) or 1.0
    while len(found) > most and cells > 1:
        x, y, z = ((corners - low) * (cells * (1 - 1e-6) / edge)).astype(np.int64).T
        keys, of = np.unique((x * cells + y) * cells + z, return_inverse=True)
        count = np.bincount(of, minlength=len(keys))
        vertices = np.stack([np.bincount(of, axis) / count for axis in corners.T], axis=1)
        three = of[triangles]
        a, b, c = three.T
        three = three[(a != b) & (b != c) & (a != c)]
        _, first = np.unique(np.sort(three, axis=1), axis=0, return_index=True)
        found = three[np.sort(first)]
        cells //= 2
    return vertices, found[:most]
