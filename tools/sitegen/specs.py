"""The pages of spec fields, from the JSON Schemas of the pydantic models."""

from __future__ import annotations

import json
import re
from typing import Any

from rig.spec.schema import schemas
from rig.spec.workspace import FOLDERS

Schema = dict[str, Any]

_BOUNDS = {
    "exclusiveMinimum": "above {}",
    "minimum": "at least {}",
    "exclusiveMaximum": "below {}",
    "maximum": "at most {}",
    "minItems": "{} or more items",
    "maxItems": "{} items or fewer",
    "minLength": "{} characters or more",
    "maxLength": "{} characters or fewer",
}


def spec_pages() -> dict[str, str]:
    """Kind of file to its page in Markdown: every field with its values, default and meaning."""
    return {kind: _page(kind, schema) for kind, schema in sorted(schemas().items())}


def _page(kind: str, schema: Schema) -> str:
    definitions: dict[str, Schema] = schema.get("$defs", {})
    parts = [f"# {kind.capitalize()} files"]
    if kind in FOLDERS:
        parts.append(
            f"Kept in `{FOLDERS[kind]}`; `rig check FILE` validates one. A quantity is text with a "
            f"unit (`66 mm`) or a bare number in the unit that is named here."
        )
    if "properties" in schema:
        parts.append(_section(schema))
    else:
        parts.append("One of " + ", ".join(_values(s) for s in _options(schema)) + ".")
    for name, definition in definitions.items():
        parts.append(f"## {name}")
        parts.append(_section(definition) if "properties" in definition else _values(definition))
    return "\n\n".join(parts) + "\n"


def _section(model: Schema) -> str:
    """What the model says of itself, then its fields as a table."""
    rows = ["| field | values | default | meaning |", "| --- | --- | --- | --- |"]
    required = model.get("required", [])
    for name, field in model["properties"].items():
        default = "**required**" if name in required else _default(field)
        meaning = _cell(field.get("description", ""))
        rows.append(f"| `{name}` | {_values(field)} | {default} | {meaning} |")
    return "\n\n".join(filter(None, (model.get("description", ""), "\n".join(rows))))


def _default(field: Schema) -> str:
    if field.get("default") is None:
        return "none" if "default" in field else "see there"
    value = field["default"]
    if value == "":
        return "empty"
    return f"`{_cell(value if isinstance(value, str) else json.dumps(value))}`"


def _options(field: Schema) -> list[Schema]:
    for word in ("anyOf", "oneOf", "allOf"):
        if word in field:
            options: list[Schema] = field[word]
            return options
    return []


def _values(field: Schema) -> str:
    """What may stand there, in a few words; models are links to their section."""
    if "$ref" in field:
        name = field["$ref"].rsplit("/", 1)[1]
        return f"[{name}](#{name.lower()})"
    if "const" in field:
        return f"`{field['const']}`"
    if "enum" in field:
        return " or ".join(f"`{value}`" for value in field["enum"])
    options = [option for option in _options(field) if option.get("type") != "null"]
    if options:
        if _is_quantity(options):
            return ", ".join(["quantity", *_bounds(options[0])])
        return " or ".join(dict.fromkeys(_values(option) for option in options))
    return ", ".join([_type(field), *_bounds(field)])


def _is_quantity(options: list[Schema]) -> bool:
    """A number in the lab unit or text with a unit, as `rig.spec.quantity` takes them."""
    flat = [inner for option in options for inner in (option.get("anyOf") or [option])]
    return [option.get("type") for option in flat] == ["number", "string"]


def _type(field: Schema) -> str:
    kind = field.get("type")
    if kind == "array":
        if "prefixItems" in field:
            return "list of " + ", ".join(_values(item) for item in field["prefixItems"])
        return f"list of {_values(field.get('items', {}))}"
    if kind == "object":
        inner = field.get("additionalProperties")
        return f"mapping to {_values(inner)}" if isinstance(inner, dict) else "mapping"
    names = {"string": "text", "boolean": "true or false", "integer": "integer", "number": "number"}
    return names.get(str(kind), "anything")


def _bounds(field: Schema) -> list[str]:
    return [text.format(f"{field[key]:g}") for key, text in _BOUNDS.items() if key in field]


def _cell(text: str) -> str:
    """Text for a cell of a table: one line, with what Markdown would read as markup escaped."""
    return re.sub(r"([|*_<])", r"\\\1", " ".join(text.split()))
