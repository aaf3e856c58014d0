"""JSON Schemas: up to date, and of the same opinion as the loader."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from datetime import date
from pathlib import Path
from typing import Any

import pytest

from rig.spec.base import SpecModel
from rig.spec.check import yaml_beneath
from rig.spec.schema import editor_associations, schema_texts, schemas
from rig.spec.tree import parse_tree

ROOT = Path(__file__).resolve().parents[2]
SHIPPED = yaml_beneath(ROOT / "models") + yaml_beneath(ROOT / "calibration")
SCHEMAS = schemas()

TYPES: dict[str, tuple[type, ...]] = {
    "object": (dict,),
    "array": (list,),
    "string": (str, date),  # YAML writes dates without quotes
    "number": (int, float),
    "integer": (int,),
    "null": (type(None),),
    "boolean": (bool,),
}

KNOWN = {
    "$defs", "$ref", "$schema", "additionalProperties", "anyOf", "const", "default", "description",
    "discriminator", "enum", "exclusiveMaximum", "exclusiveMinimum", "format", "items", "maxItems",
    "maximum", "minItems", "minLength", "minimum", "oneOf", "pattern", "prefixItems", "properties",
    "required", "title", "type",
}  # fmt: skip


def is_valid(data: Any, schema: dict[str, Any], root: dict[str, Any]) -> bool:
    """Whether `data` obeys `schema`: the part of JSON Schema 2020-12 that ours use."""
    assert set(schema) <= KNOWN, set(schema) - KNOWN
    if "$ref" in schema:
        target = root["$defs"][schema["$ref"].removeprefix("#/$defs/")]
        if not is_valid(data, target, root):
            return False
    if "anyOf" in schema and not any(is_valid(data, s, root) for s in schema["anyOf"]):
        return False
    if "oneOf" in schema and sum(is_valid(data, s, root) for s in schema["oneOf"]) != 1:
        return False
    if "type" in schema and (
        not isinstance(data, TYPES[schema["type"]])
        or (isinstance(data, bool) and schema["type"] != "boolean")
    ):
        return False
    if "const" in schema and data != schema["const"]:
        return False
    if "enum" in schema and data not in schema["enum"]:
        return False
    if isinstance(data, int | float) and not (
        data > schema.get("exclusiveMinimum", -float("inf"))
        and data >= schema.get("minimum", -float("inf"))
        and data < schema.get("exclusiveMaximum", float("inf"))
        and data <= schema.get("maximum", float("inf"))
    ):
        return False
    if isinstance(data, str):
        if len(data) < schema.get("minLength", 0):
            return False
        return re.search(schema.get("pattern", ""), data) is not None
    if isinstance(data, list):
        if not schema.get("minItems", 0) <= len(data) <= schema.get("maxItems", len(data)):
            return False
        first = schema.get("prefixItems", [])
        rest = schema.get("items", {})
        members = [*first[: len(data)], *[rest] * (len(data) - len(first))]
        return all(is_valid(item, s, root) for item, s in zip(data, members, strict=True))
    if isinstance(data, dict):
        properties = schema.get("properties", {})
        if not set(schema.get("required", [])) <= set(data):
            return False
        if schema.get("additionalProperties") is False and not set(data) <= set(properties):
            return False
        return all(is_valid(data[k], s, root) for k, s in properties.items() if k in data)
    return True


def test_the_committed_schemas_are_those_of_the_code() -> None:
    folder = ROOT / "models" / "schemas"
    committed = {path.name: path.read_text(encoding="utf-8") for path in folder.iterdir()}
    del committed["run-summary.json"]  # that of summary.json, checked where it is made
    assert committed == schema_texts(), "run: rig init --schemas models/schemas"


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_shipped_file_obeys_its_schema(path: Path) -> None:
    data = parse_tree(path.read_text(encoding="utf-8"), path).data
    schema = SCHEMAS[data["kind"]]
    assert is_valid(data, schema, schema)


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("models/actuators/bellow-bending.yaml", "wall_thickness", "wal_thickness"),
        ("models/actuators/bellow-bending.yaml", "66 mm", "-66"),
        ("models/actuators/bellow-bending.yaml", "66 mm", "true"),
        ("models/actuators/bellow-bending.yaml", "66 mm", "long"),
        ("models/actuators/bellow-bending.yaml", "[beam, fe]", "[beem, fe]"),
        ("models/actuators/bellow-bending.yaml", "material: agilus30", ""),
        ("models/benches/virtual.yaml", "23 degC", "-274"),
        ("models/benches/virtual.yaml", "{kind: virtual}", "{kind: vrtual}"),
        ("models/benches/virtual.yaml", "bits: 10", "bits: 10.5"),
        ("calibration/camera-virtual.yaml", "-0.0002, 0.0", "-0.0002"),
        ("calibration/camera-virtual.yaml", "instrument: camera", "instrument: ruler"),
    ],
)
def test_an_editor_sees_mistakes(file: str, old: str, new: str) -> None:
    text = (ROOT / file).read_text(encoding="utf-8")
    assert old in text
    data = parse_tree(text.replace(old, new, 1), Path(file)).data
    schema = SCHEMAS[data["kind"]]
    assert not is_valid(data, schema, schema)


def test_defaults_and_bounds_are_in_the_units_that_people_write() -> None:
    geometry = SCHEMAS["actuator"]["$defs"]["BellowBendingGeometry"]["properties"]
    assert geometry["effective_length"]["default"] == "66 mm"
    assert "a bare number is in mm" in geometry["effective_length"]["description"]
    temperature = SCHEMAS["bench"]["$defs"]["Ambient"]["properties"]["temperature"]
    assert temperature["anyOf"][0]["exclusiveMinimum"] == -273.15


def test_every_key_is_described_for_whoever_fills_it_in() -> None:
    for kind, schema in SCHEMAS.items():
        for name, definition in {kind: schema, **schema["$defs"]}.items():
            assert definition.get("description") or "oneOf" in definition, name


def test_editors_are_told_which_schema_is_for_which_file() -> None:
    associations = editor_associations("models/schemas")
    for schema, globs in associations.items():
        assert json.loads((ROOT / schema).read_text(encoding="utf-8"))["title"].startswith("rig ")
        for glob in globs:
            assert list(ROOT.glob(glob))


def models(model: type[SpecModel] = SpecModel) -> Iterator[type[SpecModel]]:
    for inner in model.__subclasses__():
        yield inner
        yield from models(inner)


def test_every_field_says_what_it_means() -> None:
    """The form of the studio, editors and the site's reference show it."""
    silent = {
        f"{model.__name__}.{name}"
        for model in models()
        if model.__module__.startswith("rig.spec")
        for name, field in model.model_fields.items()
        if not field.description
    }
    assert silent == set()
