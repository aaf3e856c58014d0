"""A new workspace: a copy of the library, with schemas and editor settings."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

from rig.errors import RigError
from rig.spec.schema import editor_associations, write_schemas
from rig.spec.workspace import library_root

SCHEMAS = "models/schemas"
"""Where a workspace keeps its JSON Schemas; the first line of every shipped YAML points there."""

_LOGS_README = "Recorded runs land here, one folder a run; see `rig characterise --help`.\n"


class WorkspaceError(RigError):
    """A workspace that cannot be made."""


def make_workspace(folder: Path) -> None:
    """Copy the library's models and calibrations into `folder`, and make it pleasant to edit.

    Raises WorkspaceError, with nothing written, if `folder` is a file or holds anything already.
    """
    try:
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise WorkspaceError(
                f"{folder} exists and is not an empty directory; nothing was written. Name a new "
                f"or empty directory, or move what is there out of the way."
            )
        library = library_root()
        for part in ("models", "calibration"):
            shutil.copytree(library / part, folder / part)
        logs = folder / "logs"
        logs.mkdir()
        (logs / "README.md").write_text(_LOGS_README, encoding="utf-8")
        write_schemas(folder / SCHEMAS)
        settings = folder / ".vscode" / "settings.json"
        settings.parent.mkdir()
        settings.write_text(
            json.dumps({"yaml.schemas": editor_associations(SCHEMAS)}, indent=2) + "\n",
            encoding="utf-8",
        )
    except OSError as error:
        raise WorkspaceError(
            f"the workspace {folder} cannot be made: {error.strerror or error} "
            f"({error.filename}); choose a directory that you may write to."
        ) from error


def refresh_schemas(folder: Path) -> list[Path]:
    """Write this version's JSON Schemas into `folder`; raises WorkspaceError."""
    try:
        return write_schemas(folder)
    except OSError as error:
        raise WorkspaceError(
            f"the schemas cannot be written to {folder}: {error.strerror or error}; choose a "
            f"directory that you may write to."
        ) from error
