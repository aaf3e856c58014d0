"""The cache of long calculations: whole entries or none, and never a stale one."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

from rig.mechanics import store
from rig.mechanics.store import FolderStore, NoStore, Remembering, content_key

ENTRY = {"angle": np.array([0.1, 0.2]), "stopped": np.array("far"), "final": np.array(True)}


def test_an_entry_comes_back_bit_for_bit(tmp_path: Path) -> None:
    kept = FolderStore(tmp_path / "not there yet")
    kept.save("key", ENTRY)
    found = kept.load("key")
    assert found is not None
    assert found.keys() == ENTRY.keys()
    for name, values in ENTRY.items():
        np.testing.assert_array_equal(found[name], values)
    assert kept.load("other") is None


@pytest.mark.parametrize("damage", [b"", b"PK\x03\x04 nonsense", None])
def test_a_damaged_entry_is_no_entry(tmp_path: Path, damage: bytes | None) -> None:
    kept = FolderStore(tmp_path)
    kept.save("key", ENTRY)
    (file,) = tmp_path.glob("*.npz")
    file.write_bytes(file.read_bytes()[:-20] if damage is None else damage)
    assert kept.load("key") is None


def test_pickled_objects_are_not_loaded(tmp_path: Path) -> None:
    kept = FolderStore(tmp_path)
    np.savez(tmp_path / "key.npz", evil=np.array([{"run": "me"}], dtype=object))
    assert kept.load("key") is None


def test_a_folder_that_cannot_be_written_loses_nothing_but_time(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.touch()
    FolderStore(file / "below a file").save("key", ENTRY)
    assert FolderStore(file / "below a file").load("key") is None


def test_the_entries_used_longest_ago_make_room(tmp_path: Path) -> None:
    FolderStore(tmp_path).save("first", ENTRY)
    size = next(tmp_path.glob("*.npz")).stat().st_size
    kept = FolderStore(tmp_path, size_limit=2 * size)
    kept.save("second", ENTRY)
    for age, name in ((300, "first"), (600, "second")):
        os.utime(tmp_path / f"{name}.npz", (1e9 - age, 1e9 - age))
    kept.save("third", ENTRY)
    assert {path.stem for path in tmp_path.iterdir()} == {"first", "third"}


def test_a_key_knows_what_was_asked_and_the_code(monkeypatch: pytest.MonkeyPatch) -> None:
    key = content_key(geometry={"wall": 1.5}, limit=12e3)
    assert key == content_key(limit=12e3, geometry={"wall": 1.5})
    assert key != content_key(geometry={"wall": 1.6}, limit=12e3)
    monkeypatch.setattr(store, "_code_version", lambda: "another")
    assert key != content_key(geometry={"wall": 1.5}, limit=12e3)


def test_the_cache_folder_can_be_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RIG_CACHE_DIR", str(tmp_path))
    assert FolderStore.of_user().folder == tmp_path


def test_a_remembering_store_answers_from_memory_and_fills_the_one_behind(tmp_path: Path) -> None:
    behind = FolderStore(tmp_path)
    behind.save("before", ENTRY)
    remembering = Remembering(behind)
    assert remembering.load("before") is not None
    remembering.save("new", ENTRY)
    assert behind.load("new") is not None
    for file in tmp_path.glob("*.npz"):
        file.unlink()
    assert remembering.load("before") is not None
    assert remembering.load("new") is ENTRY
    assert remembering.load("other") is None
    assert Remembering(NoStore()).load("new") is None, "nothing is shared between two of them"


def test_every_source_of_the_mechanics_counts_as_code() -> None:
    package = Path(store.__file__).parent
    shipped = subprocess.run(
        ["git", "ls-files", "."], cwd=package, capture_output=True, text=True, check=False
    ).stdout.split()
    if not shipped:
        pytest.skip("not in a checkout, which alone tells sources from what was built")
    assert {Path(name).suffix for name in shipped} <= store.SOURCES
