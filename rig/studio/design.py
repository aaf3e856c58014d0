"""A design while somebody types it: a form made from the specs, and what is wrong with it."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

from rig.mechanics.model import available_models
from rig.report.build import write_text
from rig.spec.actuator import ActuatorSpec, Geometry
from rig.spec.base import SpecModel
from rig.spec.consistency import pressure_beyond_material
from rig.spec.errors import SpecError
from rig.spec.explain import unit_of
from rig.spec.loading import parse, read_text
from rig.spec.material import MaterialSpec
from rig.spec.tree import parse_tree
from rig.spec.workspace import FOLDERS, Workspace
from rig.studio.errors import StudioError

FAMILIES: dict[str, type[SpecModel]] = {
    get_args(model.model_fields["family"].annotation)[0]: model
    for model in get_args(get_args(Geometry)[0])
}
"""Model of each geometry family, by name."""

LIMIT = "limits.pressure"
GEOMETRY = "geometry"
_PLAIN = re.compile(r"\d[0-9A-Za-z ./*]*")
"""Text that YAML takes for itself."""


@dataclass(frozen=True)
class FormField:
    """One thing to fill in."""

    name: str
    """Where it is in the spec, dotted, as `geometry.wall_thickness`."""
    label: str
    meaning: str
    unit: str
    """Of a bare number; empty for plain numbers and counts."""
    default: str
    choices: tuple[str, ...] = ()
    """Words that it takes; empty if it is free."""
    is_list: bool = False
    """Whether its text is JSON."""


def form_fields(family: str) -> tuple[FormField, ...]:
    """The parameters of a geometry family, in the order of its spec."""
    return tuple(_fields(FAMILIES[family], GEOMETRY))


def _fields(model: type[SpecModel], inside: str) -> Iterator[FormField]:
    for name, info in model.model_fields.items():
        kind = info.annotation
        if name == "family":
            continue
        if isinstance(kind, type) and issubclass(kind, SpecModel):
            yield from _fields(kind, f"{inside}.{name}")
            continue
        unit = unit_of(info)
        is_list = get_origin(kind) is tuple
        default: Any = info.default
        yield FormField(
            name=f"{inside}.{name}",
            label=f"{inside}.{name}".removeprefix(f"{GEOMETRY}.")
            .replace(".", " ")
            .replace("_", " "),
            meaning=info.description or "",
            unit=unit.lab if unit is not None else "",
            default=json.dumps(default)
            if is_list
            else str(default)
            if unit is None
            else unit.in_lab_units(default),
            choices=get_args(kind) if get_origin(kind) is Literal else (),
            is_list=is_list,
        )


def _tags(model: type[SpecModel]) -> Iterator[tuple[tuple[str, ...], str]]:
    """Where a family, or one inside of it, names itself."""
    for name, info in model.model_fields.items():
        kind = info.annotation
        if name == "family":
            yield (), str(get_args(kind)[0])
        elif isinstance(kind, type) and issubclass(kind, SpecModel):
            yield from (((name, *place), tag) for place, tag in _tags(kind))


@dataclass(frozen=True)
class Draft:
    """A form as it was filled in; nothing of it need make sense."""

    name: str
    family: str
    values: Mapping[str, str]
    """Text of each field of the family and of the pressure limit, by dotted name."""
    material: str
    description: str = ""
    tolerances: Mapping[str, str] = field(default_factory=dict)
    """How well the printed part is known; travels along unchanged."""

    def with_value(self, name: str, text: str) -> Draft:
        """The same with another text in one field."""
        return replace(self, values={**self.values, name: text})

    def in_family(self, family: str) -> Draft:
        """Another family with its defaults; the pressure limit stays."""
        return replace(
            self,
            family=family,
            tolerances={},
            values={**_defaults(family), LIMIT: self.values[LIMIT]},
        )

    @property
    def text(self) -> str:
        """The spec as YAML, as it would be saved."""
        lines = [
            "# yaml-language-server: $schema=../schemas/actuator.json",
            "kind: actuator",
            f"name: {_scalar(self.name)}",
            f"description: {_scalar(self.description)}",
            "geometry:",
        ]
        sections: dict[tuple[str, ...], list[str]] = {
            place: [f"family: {tag}"] for place, tag in _tags(FAMILIES[self.family])
        }
        for item in form_fields(self.family):
            _, *place, key = item.name.split(".")
            text = self.values[item.name]
            value = _list(text) if item.is_list else _scalar(text)
            sections.setdefault(tuple(place), []).append(f"{key}: {value}")
        for where, entries in sections.items():
            indent = "  " * (len(where) + 1)
            lines += [f"{indent[2:]}{where[-1]}:"] if where else []
            lines += [indent + entry for entry in entries]
        lines += [
            f"material: {_scalar(self.material)}",
            "limits:",
            f"  pressure: {_scalar(self.values[LIMIT])}",
        ]
        if self.tolerances:
            lines.append("tolerances:")
            lines += [f"  {key}: {_scalar(text)}" for key, text in self.tolerances.items()]
        lines.append(f"predictions: [{', '.join(available_models(self.family))}]")
        return "\n".join(lines) + "\n"


def blank(family: str, material: str) -> Draft:
    """A draft with the defaults of a family."""
    values = {**_defaults(family), LIMIT: "10 kPa"}
    return Draft(name="new-actuator", family=family, values=values, material=material)


def draft_of(text: str, path: Path) -> Draft:
    """The form of a spec's text, its values as they are written; raises SpecError."""
    spec = parse(text, path, ActuatorSpec).spec
    tree = parse_tree(text, path)
    family = spec.geometry.family
    values = {LIMIT: str(tree.value(("limits", "pressure")))}
    for item in form_fields(family):
        value = tree.value(tuple(item.name.split(".")))
        written = json.dumps(value) if item.is_list else str(value)
        values[item.name] = item.default if value is None else written
    tolerances = tree.data.get("tolerances") or {}
    return Draft(
        name=spec.name,
        family=family,
        values=values,
        material=spec.material,
        description=spec.description,
        tolerances={key: str(value) for key, value in tolerances.items()},
    )


def open_draft(workspace: Workspace, name: str) -> Draft:
    """The form of an actuator of the workspace; raises SpecError."""
    path = workspace.path("actuator", name)
    return draft_of(read_text(path), path)


@dataclass(frozen=True)
class Checked:
    """A draft, and either what it means or what is wrong with it."""

    draft: Draft
    spec: ActuatorSpec | None = None
    material: MaterialSpec | None = None
    problems: Mapping[str, str] = field(default_factory=dict)
    """What is wrong, by field of the form."""
    general: tuple[str, ...] = ()
    """What is wrong with several fields together."""

    @property
    def is_sound(self) -> bool:
        """Whether the draft is a spec."""
        return self.spec is not None and not self.problems and not self.general


def check(draft: Draft, workspace: Workspace) -> Checked:
    """Validate a draft as `rig check` validates a file."""
    if draft.material not in workspace.names("material"):
        # names only: a path would read files outside of the workspace
        why = f"'{draft.material[:40]}' is no material of this workspace"
        return Checked(draft, problems={"material": why})
    try:
        spec = parse(draft.text, Path("draft.yaml"), ActuatorSpec).spec
        material = workspace.material(draft.material)
    except SpecError as error:
        known = {*draft.values, "name", "description", "material"}
        problems: dict[str, str] = {}
        general: list[str] = []
        for problem in error.problems:
            if problem.field in known:
                problems[problem.field] = problem.message
            else:
                general += problem.message.split("; the ")  # constraints of one geometry
        return Checked(draft, problems=problems, general=tuple(general))
    torn = pressure_beyond_material(spec, material)
    if torn is not None:
        return Checked(draft, spec, material, problems={LIMIT: torn})
    return Checked(draft, spec, material)


def save(checked: Checked, workspace: Workspace, *, replacing: bool = False) -> Path:
    """Write a sound design into the workspace; raises StudioError where that cannot be done."""
    if checked.spec is None or not checked.is_sound:
        raise StudioError("this design cannot be saved: mend what is marked first.")
    if workspace.is_library:
        raise StudioError(
            "there is no workspace to save to: the library that ships with rig stays as it is. "
            "Make one with `rig init DIR` and start `rig studio` there."
        )
    # the name of a spec cannot leave its folder: see `rig.spec.base.Name`
    path = workspace.root / FOLDERS["actuator"] / f"{checked.spec.name}.yaml"
    if path.exists() and not replacing:
        raise StudioError(
            f"there is an actuator '{checked.spec.name}' already. Choose another name, or tick "
            "'replace'."
        )
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_text(path, checked.draft.text)
    except OSError as error:
        raise StudioError(f"{path} cannot be written: {error.strerror}.") from error
    return path


def _defaults(family: str) -> dict[str, str]:
    return {item.name: item.default for item in form_fields(family)}


def _list(text: str) -> str:
    """A list in the notation that YAML and JSON share; anything else stays text."""
    try:
        value = json.loads(text)
    except (ValueError, RecursionError):
        return _scalar(text)
    return json.dumps(value) if isinstance(value, list) else _scalar(text)


def _scalar(text: str) -> str:
    """A YAML scalar that reads back as this text, or as the number that it is."""
    text = text.strip()
    return text if _PLAIN.fullmatch(text) else json.dumps(text)
