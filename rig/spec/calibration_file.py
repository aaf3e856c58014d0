"""Calibrations as files: dated YAML that reads back as the same calibration."""

from __future__ import annotations

from io import StringIO
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

from rig.spec.calibration import Calibration
from rig.spec.errors import Problem, SpecError
from rig.spec.free_path import first_free
from rig.spec.loading import AnyCalibration, parse_calibration

HEADER = "# yaml-language-server: $schema=../models/schemas/calibration.json\n"


def calibration_text(calibration: AnyCalibration) -> str:
    """YAML text of a calibration; quantities carry SI units.

    Raises SpecError if it would not read back as what it is.
    """
    stream = StringIO()
    yaml = YAML()
    yaml.width = 100
    yaml.default_flow_style = None
    yaml.dump(_plain(calibration.model_dump(mode="json", exclude_none=True)), stream)
    text = HEADER + stream.getvalue()
    parse_calibration(text, Path("calibration"))
    return text


def free_path(folder: Path, calibration: Calibration, instrument: str) -> Path:
    """A file in `folder` that is not there yet: instrument, serial number if known, and date."""
    provenance = calibration.provenance
    serial = "".join(c if c.isalnum() else "-" for c in provenance.serial_number).strip("-")
    stem = "-".join(part for part in (instrument, serial, str(provenance.date)) if part)
    return first_free(folder / stem, ".yaml")


def write_calibration(calibration: AnyCalibration, path: Path) -> None:
    """Write a new file, with its folder if need be; raises SpecError where that is impossible."""
    text = calibration_text(calibration)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("x", encoding="utf-8", newline="\n") as file:
            file.write(text)
    except FileExistsError:
        message = "is there already; a calibration is never overwritten. Give another name"
        raise SpecError([Problem(path, message)]) from None
    except OSError as error:
        raise SpecError([Problem(path, f"cannot be written: {error.strerror}")]) from None


def _plain(value: Any) -> Any:
    """Without empty parts: a file says what is known."""
    if isinstance(value, dict):
        plain = {key: _plain(item) for key, item in value.items()}
        return {key: item for key, item in plain.items() if item not in ("", {}, [])}
    if isinstance(value, list):
        return [_plain(item) for item in value]
    return value
