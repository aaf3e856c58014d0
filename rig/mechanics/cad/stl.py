"""Binary STL files: only of closed surfaces, in millimetres."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.cad.errors import CadError

Array = NDArray[np.float64]

_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_HEADER = b"rig, millimetres"


def write_stl(path: Path, triangles: Array) -> int:
    """Write triangles (n, 3, 3) in metres, normals outwards; returns how many were written.

    STL keeps single precision: triangles that collapse by that are dropped. Raises CadError if
    the surface is not watertight as it would be written.
    """
    corners = printable(triangles)
    if not is_watertight(corners):
        raise CadError(
            f"The surface for {path.name} would not be watertight in the single precision of "
            f"STL files. Choose another tolerance, or write a STEP file."
        )
    records = np.zeros(len(corners), dtype=_RECORD)
    records["corners"] = corners
    edges = corners.astype(float)
    normal = np.cross(edges[:, 1] - edges[:, 0], edges[:, 2] - edges[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    records["normal"] = normal / np.where(length > 0, length, 1.0)
    content = _HEADER.ljust(80, b"\0") + np.uint32(len(corners)).tobytes() + records.tobytes()
    try:
        path.write_bytes(content)
    except OSError as error:
        raise CadError(
            f"{path} cannot be written: {error.strerror}. Choose another file."
        ) from error
    return len(corners)


def read_stl(path: Path) -> Array:
    """Triangles (n, 3, 3) of a binary STL file in metres."""
    content = path.read_bytes()
    count = int(np.frombuffer(content, "<u4", 1, offset=80)[0])
    records = np.frombuffer(content, _RECORD, count, offset=84)
    return np.asarray(records["corners"], dtype=float) / 1e3


def printable(triangles: Array) -> NDArray[np.float32]:
    """Triangles in millimetres and single precision, without those that collapse."""
    corners = np.asarray(triangles * 1e3, dtype=np.float32)
    same = [np.all(corners[:, i] == corners[:, (i + 1) % 3], axis=1) for i in range(3)]
    return np.asarray(corners[~(same[0] | same[1] | same[2])])


def is_watertight(triangles: NDArray[np.floating]) -> bool:
    """Whether every directed edge is met by as many reversed ones: closed, consistently turned."""
    _, vertex = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    faces = vertex.reshape(-1, 3)
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    size = int(vertex.max()) + 1
    forward, forward_count = np.unique(start * size + end, return_counts=True)
    backward, backward_count = np.unique(end * size + start, return_counts=True)
    return np.array_equal(forward, backward) and np.array_equal(forward_count, backward_count)


def volume(triangles: NDArray[np.floating]) -> float:
    """Volume within a closed surface, positive where its normals point outwards."""
    corner = np.asarray(triangles, dtype=float)
    triple = np.einsum("ij,ij->i", corner[:, 0], np.cross(corner[:, 1], corner[:, 2]))
    return float(triple.sum() / 6)
