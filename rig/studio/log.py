"""What the server writes for whoever started it: a line for each event, also where a library fails.

Anybody who may open a page may send nonsense over its channel; a traceback for each would bury what
matters. `verbose` brings them back.
"""

from __future__ import annotations

import logging
import traceback
from pathlib import PurePath

LONGEST = 500
"""Characters of a line."""


LIBRARIES = ("engineio.server", "socketio.server")
"""They bring a way of writing of their own."""


class OneLine(logging.Formatter):
    """A record as one line; of an exception what it was and where it came from."""

    def format(self, record: logging.LogRecord) -> str:
        """The line."""
        text = f"{record.levelname.lower()}, {record.name}: {record.getMessage()}"
        error = record.exc_info[1] if record.exc_info else None
        if error is not None:
            text = f"{text} ({type(error).__name__}: {error}; {_place(error)})"
        return " ".join(text.split())[:LONGEST]


def _place(error: BaseException) -> str:
    """The innermost line of code in the error's own traceback."""
    frames = traceback.extract_tb(error.__traceback__)
    if not frames:
        return "nowhere"
    path = PurePath(frames[-1].filename)
    return f"{'/'.join(path.parts[-3:])}:{frames[-1].lineno}"


def configure(*, verbose: bool) -> None:
    """Send warnings and errors of this process to its standard error."""
    handler = logging.StreamHandler()
    handler.setFormatter(logging.Formatter(logging.BASIC_FORMAT) if verbose else OneLine())
    logging.basicConfig(level=logging.WARNING, handlers=[handler], force=True)
    for name in LIBRARIES:
        logging.getLogger(name).handlers.clear()
