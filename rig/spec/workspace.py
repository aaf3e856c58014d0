"""A lab's folder of files, and the names in it: models/, calibration/, logs/.

Specs name each other (`material: agilus30`); here names become files, and files one `Setup`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel

from rig.spec.actuator import ActuatorSpec
from rig.spec.bench import BenchSpec
from rig.spec.calibration import (
    CameraCalibration,
    LoadCellCalibration,
    RulerCalibration,
    SyringeCalibration,
    TransducerCalibration,
)
from rig.spec.consistency import pressure_beyond_material
from rig.spec.curve import read_curve
from rig.spec.errors import Problem, SpecError
from rig.spec.explain import did_you_mean, show
from rig.spec.faults import FaultScript
from rig.spec.loading import AnyCalibration, Loaded, parse, parse_calibration, read, read_text
from rig.spec.material import MaterialSpec
from rig.spec.protocol import ProtocolSpec
from rig.spec.published import PublishedReference
from rig.spec.tree import Location, dotted, parse_tree

FOLDERS: dict[str, str] = {
    "actuator": "models/actuators",
    "material": "models/materials",
    "bench": "models/benches",
    "protocol": "models/protocols",
    "faults": "models/faults",
    "published": "models/published",
    "study": "models/studies",
    "optimisation": "models/optimisations",
    "calibration": "calibration",
}
"""Where a workspace keeps the files of each kind."""

SUFFIXES = (".yaml", ".yml")

_CALIBRATIONS: dict[str, tuple[Location, type[AnyCalibration]]] = {
    "transducer": (("transducer", "calibration"), TransducerCalibration),
    "load_cell": (("load_cell", "calibration"), LoadCellCalibration),
    "camera": (("camera", "calibration"), CameraCalibration),
    "ruler": (("camera", "ruler"), RulerCalibration),
    "syringe": (("syringe", "calibration"), SyringeCalibration),
}
OPTIONAL = {"syringe"}
"""Roles of calibrations that a bench need not name."""

S = TypeVar("S", bound=BaseModel)


@dataclass(frozen=True)
class BenchCalibrations:
    """The calibrations that a bench names, validated."""

    transducer: TransducerCalibration
    load_cell: LoadCellCalibration
    camera: CameraCalibration
    ruler: RulerCalibration
    syringe: SyringeCalibration | None = None
    """None if the bench names none: the drive is then as drawn."""

    def by_role(self) -> dict[str, AnyCalibration]:
        """Those that there are, by what they are of."""
        return {role: calibration for role, calibration in vars(self).items() if calibration}

    def expired(self, today: date) -> dict[str, date]:
        """Last valid day of each calibration whose time is over, by what it is of."""
        return {
            role: calibration.provenance.valid_until
            for role, calibration in self.by_role().items()
            if calibration.provenance.valid_until is not None
            and calibration.provenance.valid_until < today
        }


@dataclass(frozen=True)
class Setup:
    """All that a run is made of, with the text of every file behind it."""

    actuator: ActuatorSpec
    material: MaterialSpec
    bench: BenchSpec
    protocol: ProtocolSpec
    calibrations: BenchCalibrations
    sources: Mapping[str, Loaded[Any]]
    """By role: actuator, material, bench, protocol, transducer, load_cell, camera, ruler, and
    syringe if the bench names a calibration of it."""

    def attachments(self) -> dict[str, str]:
        """File name to text, for a run to carry along; `from_attachments` reads them back."""
        return {f"{role}.yaml": source.text for role, source in self.sources.items()}

    @classmethod
    def from_attachments(cls, texts: Mapping[str, str], origin: Path) -> Setup:
        """The set-up that a run was made with.

        `texts` is what `attachments` gave, `origin` where errors say that they come from. Raises
        SpecError for attachments that are missing or broken.
        """
        problems = _Problems()
        sources: dict[str, Loaded[Any]] = {}
        for role, model in _MODELS.items():
            name = f"{role}.yaml"
            if name not in texts and role in OPTIONAL:
                continue
            if name not in texts:
                problems.found.append(Problem(origin / name, "the attachment is missing"))
                continue
            with problems.collected():
                sources[role] = parse(texts[name], origin / name, model)
        problems.raise_any()
        return _assemble(sources)


_MODELS: dict[str, type[BaseModel]] = {
    "actuator": ActuatorSpec,
    "material": MaterialSpec,
    "bench": BenchSpec,
    "protocol": ProtocolSpec,
    **{role: model for role, (_, model) in _CALIBRATIONS.items()},
}


def _assemble(sources: dict[str, Loaded[Any]]) -> Setup:
    specs = {role: source.spec for role, source in sources.items()}
    named = [role for role in _CALIBRATIONS if role in specs]
    calibrations = BenchCalibrations(**{role: specs.pop(role) for role in named})
    return Setup(**specs, calibrations=calibrations, sources=sources)


@dataclass
class _Problems:
    """Collects the problems of several files; used as `with problems.collected(): ...`."""

    found: list[Problem] = field(default_factory=list)

    def collected(self) -> _Problems:
        return self

    def __enter__(self) -> None:
        return None

    def __exit__(self, kind: Any, error: BaseException | None, traceback: Any) -> bool:
        if isinstance(error, SpecError):
            self.found.extend(error.problems)
            return True
        return False

    def raise_any(self) -> None:
        if self.found:
            raise SpecError(list(dict.fromkeys(self.found)))


@dataclass(frozen=True)
class Workspace:
    """A folder with models/ and calibration/; runs are recorded in its logs/."""

    root: Path
    is_library: bool = False
    """Whether this is the library shipped with rig, for want of a workspace of one's own."""

    @classmethod
    def find(cls, start: Path | None = None) -> Workspace:
        """The workspace around `start` (default: here), else the library shipped with rig."""
        here = (start or Path.cwd()).resolve()
        for folder in (here, *here.parents):
            if is_workspace(folder):
                return cls(folder)
        return cls(library_root(), is_library=True)

    @property
    def logs(self) -> Path:
        """Where runs are recorded: in the current directory if there is no workspace around."""
        return (Path.cwd() if self.is_library else self.root) / "logs"

    def names(self, kind: str) -> list[str]:
        """Names of the files of `kind` (see FOLDERS), sorted."""
        folder = self.root / FOLDERS[kind]
        files = folder.iterdir() if folder.is_dir() else ()
        return sorted(file.stem for file in files if file.suffix in SUFFIXES)

    def path(self, kind: str, reference: str | Path, beside: Path | None = None) -> Path:
        """File that `reference` means: a name in the workspace, or a path.

        Relative paths count from `beside` (default: the current directory), then from the
        workspace. Raises SpecError that lists the names there are.
        """
        folder = self.root / FOLDERS[kind]
        given = Path(reference)
        bases = [beside or Path.cwd(), self.root, folder] if is_path(given) else [folder]
        for base in bases:
            for name in (given, *(given.with_name(given.name + s) for s in SUFFIXES if given.name)):
                if name.suffix in SUFFIXES and _is_file(base / name):
                    return base / name
        if is_path(given):
            message = f"no such {kind} file; expected a path to one"
            names = self.names(kind)
            known = f", or a name from {folder}: {', '.join(names)}" if names else ""
            raise SpecError([Problem(given, message + known)])
        wanted = str(reference)
        message = f"{show(wanted)} is no {kind} there{did_you_mean(wanted, self.names(kind))}"
        raise SpecError([Problem(folder, message)])

    def actuator(self, reference: str | Path) -> ActuatorSpec:
        """Actuator by name or path; raises SpecError."""
        return read(self.path("actuator", reference), ActuatorSpec).spec

    def material(self, reference: str | Path) -> MaterialSpec:
        """Material by name or path; raises SpecError."""
        return read(self.path("material", reference), MaterialSpec).spec

    def bench(self, reference: str | Path) -> BenchSpec:
        """Bench by name or path; raises SpecError."""
        return read(self.path("bench", reference), BenchSpec).spec

    def protocol(self, reference: str | Path) -> ProtocolSpec:
        """Protocol by name or path; raises SpecError."""
        return read(self.path("protocol", reference), ProtocolSpec).spec

    def faults(self, reference: str | Path) -> FaultScript:
        """Fault script by name or path; raises SpecError."""
        return read(self.path("faults", reference), FaultScript).spec

    def calibration(self, reference: str | Path) -> AnyCalibration:
        """Calibration by name or path; raises SpecError."""
        path = self.path("calibration", reference)
        return parse_calibration(read_text(path), path).spec

    def published(self) -> tuple[PublishedReference, ...]:
        """All published reference values, by name; raises SpecError."""
        return tuple(
            read(self.path("published", name), PublishedReference).spec
            for name in self.names("published")
        )

    def resolve_actuator(self, source: Loaded[ActuatorSpec]) -> Loaded[MaterialSpec]:
        """The material of an actuator that was read from a file.

        Raises SpecError at the line that names it if there is none, and at the pressure limit if
        that would tear the material.
        """
        material = self._referred(source, ("material",), "material", MaterialSpec)
        why = pressure_beyond_material(source.spec, material.spec)
        if why is not None:
            raise SpecError([problem_at(source, ("limits", "pressure"), why)])
        return material

    def resolve_bench_file(self, source: Loaded[BenchSpec]) -> dict[str, Loaded[Any]]:
        """The calibrations that a bench names, by role; raises SpecError with all problems."""
        problems = _Problems()
        found: dict[str, Loaded[Any]] = {}
        for role, (location, model) in _CALIBRATIONS.items():
            if role in OPTIONAL and _value_at(source.spec, location) is None:
                continue
            with problems.collected():
                found[role] = self._referred(source, location, "calibration", model)
        problems.raise_any()
        return found

    def resolve_bench(self, bench: BenchSpec) -> BenchCalibrations:
        """The calibrations that `bench` names; raises SpecError with all problems."""
        source = Loaded(bench, self.root / FOLDERS["bench"] / f"{bench.name}.yaml", "")
        found = self.resolve_bench_file(source)
        return BenchCalibrations(**{role: loaded.spec for role, loaded in found.items()})

    def setup(
        self, actuator: str | Path, bench: str | Path = "virtual", protocol: str | Path = "default"
    ) -> Setup:
        """Everything for a run, by names or paths; raises SpecError with all problems."""
        problems = _Problems()
        sources: dict[str, Loaded[Any]] = {}
        with problems.collected():
            drawing = read(self.path("actuator", actuator), ActuatorSpec)
            sources["actuator"] = drawing
            sources["material"] = self.resolve_actuator(drawing)
        with problems.collected():
            equipment = read(self.path("bench", bench), BenchSpec)
            sources["bench"] = equipment
            sources |= self.resolve_bench_file(equipment)
        with problems.collected():
            steps = read(self.path("protocol", protocol), ProtocolSpec)
            sources["protocol"] = with_curves(steps)
        problems.raise_any()
        return _assemble(sources)

    def _referred(
        self, source: Loaded[Any], location: Location, kind: str, model: type[S]
    ) -> Loaded[S]:
        """The file that the field at `location` of `source` names; read as `model`."""
        reference = _value_at(source.spec, location)
        try:
            path = self.path(kind, reference, beside=source.path.parent)
        except SpecError as error:
            why = error.problems[0]
            message = f"{why.path}: {why.message}"
            raise SpecError([problem_at(source, location, message)]) from None
        return read(path, model)


def with_curves(source: Loaded[ProtocolSpec]) -> Loaded[ProtocolSpec]:
    """The protocol with its CSV files read into it: a run's attachment must not need them.

    Raises SpecError for a file that is missing or wrong.
    """
    trials, problems = [], _Problems()
    for trial in source.spec.trials:
        read_in = {}
        for name, curve in getattr(trial, "curves", {}).items():
            if curve.file is not None:
                with problems.collected():
                    read_in[name] = read_curve(source.path.parent / curve.file)
        trials.append(trial.model_copy(update=read_in))
    problems.raise_any()
    if trials == list(source.spec.trials):
        return source
    spec = source.spec.model_copy(update={"trials": tuple(trials)})
    # JSON is YAML, too; validated again, as curves of files meet here for the first time
    return parse(
        spec.model_dump_json(exclude_none=True, indent=1) + "\n", source.path, ProtocolSpec
    )


def _value_at(spec: Any, location: Location) -> Any:
    for name in location:
        spec = getattr(spec, str(name))
    return spec


def is_path(reference: str | Path) -> bool:
    """Whether `reference` names a file by its path, not by its name in a workspace."""
    return Path(reference).suffix in SUFFIXES or len(Path(reference).parts) > 1


def is_workspace(folder: Path) -> bool:
    """Whether `folder` has what makes a workspace."""
    return (folder / "models").is_dir() and (folder / "calibration").is_dir()


def library_root() -> Path:
    """The library that ships with rig: beside the package in a checkout, inside it in a wheel."""
    package = Path(__file__).resolve().parents[1]
    shipped = package / "_library"
    return shipped if shipped.is_dir() else package.parent


def problem_at(source: Loaded[Any], location: Location, message: str) -> Problem:
    """A problem with the value at a location of a file, with its line and column."""
    if not source.text:
        return Problem(source.path, message, dotted(location))
    place = parse_tree(source.text, source.path).place_of_value(location)
    return Problem(source.path, message, dotted(location), place.line, place.column)


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):  # a name that no file system takes
        return False
