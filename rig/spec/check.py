"""Checks of whole files: what is in them, and what they refer to."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from rig.spec.actuator import ActuatorSpec
from rig.spec.bench import BenchSpec
from rig.spec.errors import Problem, SpecError
from rig.spec.loading import Loaded, parse_any, read_text
from rig.spec.material import MaterialSpec
from rig.spec.protocol import ProtocolSpec
from rig.spec.workspace import SUFFIXES, Workspace, with_curves


@dataclass(frozen=True)
class FileReport:
    """The outcome of checking one file."""

    path: Path
    kind: str
    """Kind of the spec; empty if the file is none."""
    problems: tuple[Problem, ...]
    material: Loaded[MaterialSpec] | None = None
    """The material that the file is, or that its actuator is made of."""

    @property
    def is_ok(self) -> bool:
        """Whether nothing is wrong."""
        return not self.problems


def check(paths: list[Path]) -> list[FileReport]:
    """Check files, and all YAML beneath directories, with the files that they refer to."""
    reports = []
    for path in paths:
        if not path.is_dir():
            reports.append(check_file(path))
            continue
        files = yaml_beneath(path)
        reports.extend(check_file(file) for file in files)
        if not files:
            nothing = Problem(path, "no YAML files in this directory; expected specs to check")
            reports.append(FileReport(path, "", (nothing,)))
    return reports


def check_file(path: Path) -> FileReport:
    """Check one file.

    Names in it are looked up in the workspace around it, else in the one around the current
    directory, else in the library shipped with rig.
    """
    kind, material = "", None
    try:
        source = parse_any(read_text(path), path)
        kind = source.spec.kind
        workspace = Workspace.find(path.parent)
        if workspace.is_library:
            workspace = Workspace.find()
        if isinstance(source.spec, ActuatorSpec):
            material = workspace.resolve_actuator(source)
        elif isinstance(source.spec, BenchSpec):
            workspace.resolve_bench_file(source)
        elif isinstance(source.spec, ProtocolSpec):
            with_curves(source)
        elif isinstance(source.spec, MaterialSpec):
            material = source
    except SpecError as error:
        return FileReport(path, kind, error.problems)
    except Exception as error:  # a defect must not hide what is wrong with the other files
        why = f"{type(error).__name__}: {error}"
        message = f"could not be checked; this is a defect in rig, please report it: {why}"
        return FileReport(path, kind, (Problem(path, message),))
    return FileReport(path, kind, (), material)


def yaml_beneath(folder: Path) -> list[Path]:
    """All YAML files beneath `folder`, sorted; hidden folders are left out."""
    found = []
    for place, folders, files in os.walk(folder):
        folders[:] = [name for name in folders if not name.startswith(".")]
        found += [Path(place) / name for name in files if Path(name).suffix in SUFFIXES]
    return sorted(found)
