"""The log of the server: a line for each event."""

from __future__ import annotations

import logging

import pytest

from rig.studio.log import LONGEST, OneLine, configure
from rig.studio.runs import matching


def record(error: BaseException | None, text: str) -> logging.LogRecord:
    failed = None if error is None else (type(error), error, error.__traceback__)
    return logging.LogRecord("nicegui", logging.ERROR, "there", 1, text, None, failed)


def test_an_exception_is_one_line_that_says_where() -> None:
    with pytest.raises(AttributeError) as caught:
        matching((), 3)  # type: ignore[arg-type]
    line = OneLine().format(record(caught.value, "it\nfailed"))
    assert line.startswith("error, nicegui: it failed (AttributeError: ")
    assert "rig/studio/runs.py:" in line
    assert "\n" not in line
    assert len(OneLine().format(record(None, "x" * 9999))) == LONGEST


def test_a_library_does_not_write_past_it(monkeypatch: pytest.MonkeyPatch) -> None:
    root = logging.getLogger()
    monkeypatch.setattr(root, "handlers", list(root.handlers))
    library = logging.getLogger("engineio.server")
    library.addHandler(logging.StreamHandler())
    level = root.level
    try:
        configure(verbose=False)
        assert library.handlers == []
        (handler,) = root.handlers
        assert isinstance(handler.formatter, OneLine)
        configure(verbose=True)
        assert not isinstance(root.handlers[0].formatter, OneLine)
    finally:
        root.setLevel(level)
