"""JSON Schemas of the spec files, so that editors complete and check the YAML."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, Field, TypeAdapter

from rig.spec.explain import models_in, unit_of
from rig.spec.loading import INSTRUMENTS, KINDS, AnyCalibration
from rig.spec.workspace import FOLDERS

_BOUNDS = {
    "gt": "exclusiveMinimum",
    "ge": "minimum",
    "lt": "exclusiveMaximum",
    "le": "maximum",
}


def schemas() -> dict[str, dict[str, Any]]:
    """JSON Schema of each kind of file; quantities are described and bounded in lab units."""
    calibration: TypeAdapter[AnyCalibration] = TypeAdapter(
        Annotated[AnyCalibration, Field(discriminator="instrument")]
    )
    result = {kind: _described(model.model_json_schema(), [model]) for kind, model in KINDS.items()}
    result["calibration"] = _described(calibration.json_schema(), list(INSTRUMENTS.values()))
    for kind, schema in result.items():
        schema["$schema"] = "https://json-schema.org/draft/2020-12/schema"
        schema["title"] = f"rig {kind}"
    return result


def schema_texts() -> dict[str, str]:
    """File name to JSON text of every schema; the same on every call."""
    return {
        f"{kind}.json": json.dumps(schema, indent=2, sort_keys=True) + "\n"
        for kind, schema in schemas().items()
    }


def write_schemas(folder: Path) -> list[Path]:
    """Write every schema into `folder`, made if need be; the files written."""
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for name, text in schema_texts().items():
        path = folder / name
        path.write_text(text, encoding="utf-8")
        written.append(path)
    return written


def editor_associations(folder: str) -> dict[str, list[str]]:
    """Schema file to the globs it is for, as the YAML extension of VS Code wants them."""
    return {f"./{folder}/{kind}.json": [f"{place}/*.yaml"] for kind, place in FOLDERS.items()}


def _described(schema: dict[str, Any], roots: list[type[BaseModel]]) -> dict[str, Any]:
    """The schema with quantities as people write them: pydantic knows their SI values only."""
    for model in _reachable(roots):
        definition = schema.get("$defs", {}).get(model.__name__, schema)
        for name, field in model.model_fields.items():
            unit = unit_of(field)
            if unit is None:
                continue
            definition["properties"][name] = quantity = {
                **definition["properties"][name],
                "description": "; ".join(filter(None, (field.description, unit.expected))),
            }
            if field.default is not None and not field.is_required():
                quantity["default"] = unit.in_lab_units(field.default)
            first, *others = quantity["anyOf"]
            # of a quantity that may be left out, pydantic nests the quantity beside null
            (number, text), nothing = (
                (first["anyOf"], others) if "anyOf" in first else ([first, *others], [])
            )
            bounds = {
                word: unit.to_lab(bound)
                for metadata in field.metadata
                for key, word in _BOUNDS.items()
                if (bound := getattr(metadata, key, None)) is not None
            }
            quantity["anyOf"] = [{**number, **bounds}, text, *nothing]
    return schema


def _reachable(roots: list[type[BaseModel]]) -> list[type[BaseModel]]:
    found: dict[type[BaseModel], None] = {}
    queue = list(roots)
    while queue:
        model = queue.pop()
        if model not in found:
            found[model] = None
            for field in model.model_fields.values():
                queue.extend(models_in(field.annotation))
    return list(found)
