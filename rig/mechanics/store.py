"""Results of long calculations on disk, under a hash of everything that they depend on.

A key holds what was asked and the source text of the mechanics: a changed material, mesh or line
of code finds nothing. Entries are replaced as a whole, so that a killed process leaves the last
complete one. Arrays only, never pickled objects: a cache folder is not trusted to run code.
"""

from __future__ import annotations

import hashlib
import json
import os
import tempfile
import zipfile
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Entry = dict[str, NDArray[Any]]

FOLDER_VARIABLE = "RIG_CACHE_DIR"
SIZE_LIMIT = 2 << 30
"""Bytes that a store may take; the entries used longest ago go first."""
SOURCES = {".py", ".cpp", ".h", ".inc"}
"""Endings of the files that an answer may depend on."""


class Store(Protocol):
    """Where arrays are kept between calculations."""

    def load(self, key: str) -> Entry | None:
        """The entry of a key, if there is one."""
        ...

    def save(self, key: str, entry: Entry) -> None:
        """Keep an entry, replacing any other of the key."""
        ...


class NoStore:
    """Keeps nothing."""

    def load(self, _key: str) -> None:
        """Nothing is known."""
        return

    def save(self, _key: str, _entry: Entry) -> None:
        """Forget it at once."""


@dataclass(frozen=True)
class Remembering:
    """Another store, whose entries are kept in memory, too: good for several questions in a row."""

    store: Store
    known: dict[str, Entry] = field(default_factory=dict)

    def load(self, key: str) -> Entry | None:
        """The entry of a key, if there is one."""
        if key not in self.known and (found := self.store.load(key)) is not None:
            self.known[key] = found
        return self.known.get(key)

    def save(self, key: str, entry: Entry) -> None:
        """Keep an entry in both."""
        self.known[key] = entry
        self.store.save(key, entry)


@dataclass(frozen=True)
class FolderStore:
    """A folder with one file an entry."""

    folder: Path
    size_limit: int = SIZE_LIMIT

    @classmethod
    def of_user(cls) -> FolderStore:
        """The user's cache folder, or the one that RIG_CACHE_DIR names."""
        named = os.environ.get(FOLDER_VARIABLE)
        if named:
            return cls(Path(named))
        import platformdirs

        return cls(Path(platformdirs.user_cache_dir("rig")))

    def load(self, key: str) -> Entry | None:
        """The entry of a key; None also where it cannot be read: it is then computed again."""
        path = self._path(key)
        try:
            with np.load(path, allow_pickle=False) as archive:
                entry = {name: archive[name] for name in archive.files}
            os.utime(path)
        except (OSError, ValueError, EOFError, zipfile.BadZipFile, KeyError):
            return None
        return entry

    def save(self, key: str, entry: Entry) -> None:
        """Keep an entry. A cache that cannot be written costs time later, not the result now."""
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            with tempfile.NamedTemporaryFile(
                dir=self.folder, suffix=".partial", delete=False
            ) as file:
                np.savez(file, allow_pickle=False, **entry)
            Path(file.name).replace(self._path(key))
            self._make_room()
        except OSError:
            return

    def _path(self, key: str) -> Path:
        return self.folder / f"{key}.npz"

    def _make_room(self) -> None:
        found = [(path, path.stat()) for path in self.folder.glob("*.npz")]
        newest_first = sorted(found, key=lambda pair: pair[1].st_mtime, reverse=True)
        used = 0
        for path, status in newest_first:
            used += status.st_size
            if used > self.size_limit and path != newest_first[0][0]:
                path.unlink(missing_ok=True)


def content_key(**asked: Any) -> str:
    """Hash of what was asked (anything that JSON can say) and of the code that answers."""
    text = json.dumps(asked, sort_keys=True, default=str)
    return hashlib.sha256(f"{_code_version()}\n{text}".encode()).hexdigest()[:32]


@lru_cache(maxsize=1)
def _code_version() -> str:
    """Hash of the mechanics' source."""
    package = Path(__file__).resolve().parent
    digest = hashlib.sha256()
    for path in sorted(p for p in package.rglob("*") if p.suffix in SOURCES):
        digest.update(path.relative_to(package).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()
