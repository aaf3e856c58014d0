"""Spec files as validated models; every problem of a file at once, with line, column and field."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar, get_args

from pydantic import BaseModel, ValidationError

from rig.spec.actuator import ActuatorSpec
from rig.spec.bench import BenchSpec
from rig.spec.calibration import (
    CameraCalibration,
    LoadCellCalibration,
    RulerCalibration,
    SyringeCalibration,
    TransducerCalibration,
)
from rig.spec.errors import Problem, SpecError
from rig.spec.explain import did_you_mean, one_of, problems_of
from rig.spec.faults import FaultScript
from rig.spec.material import MaterialSpec
from rig.spec.optimisation import OptimisationSpec
from rig.spec.protocol import ProtocolSpec
from rig.spec.published import PublishedReference
from rig.spec.study import StudySpec
from rig.spec.tree import MAX_CHARACTERS, Tree, parse_tree

AnyCalibration = (
    TransducerCalibration
    | LoadCellCalibration
    | SyringeCalibration
    | CameraCalibration
    | RulerCalibration
)
AnySpec = (
    ActuatorSpec
    | MaterialSpec
    | BenchSpec
    | ProtocolSpec
    | FaultScript
    | PublishedReference
    | StudySpec
    | OptimisationSpec
    | AnyCalibration
)

KINDS: dict[str, type[BaseModel]] = {
    "actuator": ActuatorSpec,
    "material": MaterialSpec,
    "bench": BenchSpec,
    "protocol": ProtocolSpec,
    "faults": FaultScript,
    "published": PublishedReference,
    "study": StudySpec,
    "optimisation": OptimisationSpec,
}
"""Model of each `kind`, but for `calibration`, which depends on its `instrument`."""

INSTRUMENTS: dict[str, type[AnyCalibration]] = {
    "transducer": TransducerCalibration,
    "load-cell": LoadCellCalibration,
    "syringe": SyringeCalibration,
    "camera": CameraCalibration,
    "ruler": RulerCalibration,
}
"""Model of each calibrated `instrument`."""

MAX_BYTES = 4 * MAX_CHARACTERS
"""The most that UTF-8 takes for the longest text that is parsed."""

S_co = TypeVar("S_co", bound=BaseModel, covariant=True)
S = TypeVar("S", bound=BaseModel)


@dataclass(frozen=True)
class Loaded(Generic[S_co]):
    """A spec together with the very text that it came from, so that a run can attach it."""

    spec: S_co
    path: Path
    text: str

    @property
    def sha256(self) -> str:
        """Hash of the text, in hexadecimal."""
        return hashlib.sha256(self.text.encode()).hexdigest()


def load(path: Path) -> AnySpec:
    """The spec in `path`, of whatever kind; raises SpecError with all its problems."""
    spec: AnySpec = read_any(path).spec
    return spec


def load_actuator(path: Path) -> ActuatorSpec:
    """The actuator in `path`; raises SpecError with all its problems."""
    return read(path, ActuatorSpec).spec


def load_material(path: Path) -> MaterialSpec:
    """The material in `path`; raises SpecError with all its problems."""
    return read(path, MaterialSpec).spec


def load_bench(path: Path) -> BenchSpec:
    """The bench in `path`; raises SpecError with all its problems."""
    return read(path, BenchSpec).spec


def load_protocol(path: Path) -> ProtocolSpec:
    """The protocol in `path`; raises SpecError with all its problems."""
    return read(path, ProtocolSpec).spec


def load_published(path: Path) -> PublishedReference:
    """The published reference values in `path`; raises SpecError with all its problems."""
    return read(path, PublishedReference).spec


def load_calibration(path: Path) -> AnyCalibration:
    """The calibration in `path`, of whatever instrument; raises SpecError with all its problems."""
    return parse_calibration(read_text(path), path).spec


def read(path: Path, model: type[S]) -> Loaded[S]:
    """File `path` as `model`; raises SpecError with all its problems."""
    return parse(read_text(path), path, model)


def read_any(path: Path) -> Loaded[Any]:
    """File `path` as the model that its `kind` (and `instrument`) asks for; raises SpecError."""
    return parse_any(read_text(path), path)


def parse(text: str, path: Path, model: type[S]) -> Loaded[S]:
    """`text` as `model`; `path` is where errors say that it came from. Raises SpecError."""
    return Loaded(_validate(parse_tree(text, path), model), path, text)


def parse_any(text: str, path: Path) -> Loaded[Any]:
    """`text` as the model that its `kind` (and `instrument`) asks for; raises SpecError."""
    tree = parse_tree(text, path)
    kind = _choice(tree, "kind", [*KINDS, "calibration"])
    model = KINDS.get(kind) or INSTRUMENTS[_choice(tree, "instrument", list(INSTRUMENTS))]
    return Loaded(_validate(tree, model), path, text)


def parse_calibration(text: str, path: Path) -> Loaded[AnyCalibration]:
    """`text` as the calibration of the `instrument` that it names; raises SpecError."""
    tree = parse_tree(text, path)
    _choice(tree, "kind", ["calibration"])
    model = INSTRUMENTS[_choice(tree, "instrument", list(INSTRUMENTS))]
    return Loaded(_validate(tree, model), path, text)


def read_text(path: Path) -> str:
    """Text of `path`; raises SpecError if there is none to read."""
    try:
        if path.exists() and not (path.is_file() or path.is_dir()):  # would block or never end
            raise SpecError([Problem(path, "is a device or a pipe; expected a YAML file")])
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
        if len(data) > MAX_BYTES:
            raise SpecError([Problem(path, f"larger than {MAX_BYTES} bytes: no spec")])
        return data.decode("utf-8-sig")
    except FileNotFoundError:
        problem = "no such file"
    except IsADirectoryError:
        problem = "is a directory; expected a YAML file"
    except UnicodeDecodeError as error:
        lines = error.object[: error.start].split(b"\n")
        place = f"byte 0x{error.object[error.start]:02x}"
        message = f"{place} is not UTF-8 text; save the file as UTF-8"
        raise SpecError([Problem(path, message, "", len(lines), len(lines[-1]) + 1)]) from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        problem = f"cannot be read: {reason}"
    raise SpecError([Problem(path, problem)])


def _validate(tree: Tree, model: type[S]) -> S:
    try:
        return model.model_validate(tree.data)
    except ValidationError as error:
        # A sound file of another kind: its "errors" against this model would only confuse.
        for key, known in (("kind", [*KINDS, "calibration"]), ("instrument", list(INSTRUMENTS))):
            given = tree.data.get(key)
            wanted = _literal(model, key)
            if isinstance(given, str) and given in known and wanted and given != wanted:
                place = tree.place_of_value((key,))
                message = f"this file is for '{given}'; expected '{wanted}'"
                problem = Problem(tree.path, message, key, place.line, place.column)
                raise SpecError([problem]) from None
        raise SpecError(problems_of(error, tree, model)) from None


def _literal(model: type[BaseModel], key: str) -> str:
    field = model.model_fields.get(key)
    return str(get_args(field.annotation)[0]) if field is not None else ""


def _choice(tree: Tree, key: str, known: list[str]) -> str:
    if key not in tree.data:
        place = tree.place_of_value(())
        message = f"required, but missing; expected {one_of(known)}"
    else:
        value = tree.data[key]
        if isinstance(value, str) and value in known:
            return value
        place = tree.place_of_value((key,))
        message = f"'{value}' is not known{did_you_mean(str(value), known)}"
    raise SpecError([Problem(tree.path, message, key, place.line, place.column)])
