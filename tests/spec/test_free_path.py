"""Nothing is overwritten: the next free name of a file or folder."""

from __future__ import annotations

from pathlib import Path

from rig.spec.free_path import first_free


def test_the_first_free_name_keeps_dots_in_names_and_the_suffix_last(tmp_path: Path) -> None:
    for suffix, second in (("", "bench-1.5-2"), (".csv", "bench-1.5-2.csv")):
        first = first_free(tmp_path / "bench-1.5", suffix)
        assert first == tmp_path / f"bench-1.5{suffix}"
        first.touch()
        assert first_free(tmp_path / "bench-1.5", suffix) == tmp_path / second
