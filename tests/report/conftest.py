"""Synthetic runs that several tests read; nobody changes them."""

from __future__ import annotations

from pathlib import Path

import pytest
from synthetic_run import SHORT, Story, write_synthetic_run


@pytest.fixture(scope="session")
def run_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A complete run with both experiments."""
    return write_synthetic_run(tmp_path_factory.mktemp("runs") / "whole", Story(**SHORT))


@pytest.fixture(scope="session")
def other_run_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same with another seed."""
    return write_synthetic_run(tmp_path_factory.mktemp("runs") / "other", Story(**SHORT, seed=2))
