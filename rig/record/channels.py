"""Topics of a run's log and their schemas, so that any MCAP reader understands the file.

Log times count nanoseconds of bench time from zero: a run on the virtual bench begins at 1970-01-01
in tools that show dates. JSON channels carry JSON Schemas, images and log lines Foxglove's
published protobuf schemas, CAN frames the small protobuf message `rig.CanFrame` defined here.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from numbers import Real
from typing import Any, Literal

from foxglove_schemas_protobuf.Log_pb2 import Log
from google.protobuf.descriptor_pb2 import (
    DescriptorProto,
    FieldDescriptorProto,
    FileDescriptorProto,
    FileDescriptorSet,
)
from mcap_protobuf.schema import build_file_descriptor_set
from pydantic import BaseModel

LOG_FILE = "run.mcap"
Level = Literal["debug", "info", "warning", "error"]
LEVELS: dict[Level, int] = {
    "debug": Log.DEBUG,
    "info": Log.INFO,
    "warning": Log.WARNING,
    "error": Log.ERROR,
}

CAN_TOPIC = "/can"
CAMERA_TOPIC = "/camera"
CAMERA_KEY_TOPIC = "/camera/key"
DEFORMATION_TOPIC = "/vision/deformation"
REST_TOPIC = "/camera/rest"
POINTS_TOPIC = "/points"
GAS_TOPIC = "/gas"
PARTS_TOPIC = "/parts"
LOOKS_TOPIC = "/looks"
LOG_TOPIC = "/log"
TELEMETRY_PREFIX = "/rig/"

START_METADATA = "rig.start"
RESUME_METADATA = "rig.resume"
STOP_METADATA = "rig.stop"

SchemaRecord = tuple[str, str, bytes]
"""Name, encoding and data of an MCAP schema."""


def telemetry_topic(message: str) -> str:
    """Topic of the decoded CAN message `message`."""
    return TELEMETRY_PREFIX + message.lower()


def telemetry_schema(
    message: str, row: Mapping[str, object], units: Mapping[str, str]
) -> SchemaRecord:
    """JSON Schema of a decoded CAN message; types after `row`, an example of it."""
    properties: dict[str, Any] = {}
    for name, value in row.items():
        text = not isinstance(value, Real)
        properties[name] = {"type": "string" if text else "number"}
        if units.get(name):
            properties[name]["description"] = f"in {units[name]}"
            properties[name]["unit"] = units[name]
    return _json_schema(f"rig.{message}", f"CAN message {message} of rig.dbc", properties)


def _json_schema(name: str, description: str, properties: Mapping[str, Any]) -> SchemaRecord:
    schema = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": name,
        "description": description,
        "type": "object",
        "properties": properties,
    }
    return name, "jsonschema", json.dumps(schema).encode()


def document_schema(model: type[BaseModel]) -> SchemaRecord:
    """JSON Schema of a document, flat and free of references and unions.

    Foxglove's JSON Schema reader knows neither; values that are None are left out of messages
    instead, so the plain types stay true.
    """
    schema = model.model_json_schema()
    definitions = schema.get("$defs", {})
    properties = {
        name: _flat(property_schema, definitions)
        for name, property_schema in schema["properties"].items()
    }
    return _json_schema(f"rig.{model.__name__}", (model.__doc__ or "").strip(), properties)


def _flat(schema: Mapping[str, Any], definitions: Mapping[str, Any]) -> dict[str, Any]:
    if "$ref" in schema:
        return _flat(definitions[schema["$ref"].rsplit("/", 1)[1]], definitions)
    if "anyOf" in schema:
        (some,) = (option for option in schema["anyOf"] if option.get("type") != "null")
        return _flat(some, definitions) | {"description": "left out where there is none"}
    flat: dict[str, Any] = {"type": schema["type"]}
    if "enum" in schema:
        flat["enum"] = schema["enum"]
    if "items" in schema:
        flat["items"] = _flat(schema["items"], definitions)
    if "properties" in schema:
        flat["properties"] = {
            name: _flat(inner, definitions) for name, inner in schema["properties"].items()
        }
    return flat


def camera_key_schema() -> SchemaRecord:
    """JSON Schema of the note that says which point an image belongs to."""
    properties = {
        "experiment": {"type": "string"},
        "repeat": {"type": "integer"},
        "direction": {"type": "string"},
        "target_kpa": {"type": "number", "unit": "kPa"},
        "frame": {"type": "integer"},
    }
    return _json_schema(
        "rig.CameraKey", "The point of the image with the same time; empty if of none", properties
    )


def protobuf_schema(message_class: Any) -> SchemaRecord:
    """Schema of a protobuf message class with all it depends on."""
    descriptors = build_file_descriptor_set(message_class)
    return message_class.DESCRIPTOR.full_name, "protobuf", descriptors.SerializeToString()


def can_frame_schema() -> SchemaRecord:
    """`rig.CanFrame { fixed32 id = 1; bytes data = 2; }`: 11-bit id and payload of a CAN frame.

    The fixed width makes frames of one length equally long, so they are written in bulk.
    """
    message = DescriptorProto(name="CanFrame")
    message.field.add(
        name="id",
        number=1,
        type=FieldDescriptorProto.TYPE_FIXED32,
        label=FieldDescriptorProto.LABEL_OPTIONAL,
    )
    message.field.add(
        name="data",
        number=2,
        type=FieldDescriptorProto.TYPE_BYTES,
        label=FieldDescriptorProto.LABEL_OPTIONAL,
    )
    file = FileDescriptorProto(name="rig/CanFrame.proto", package="rig", syntax="proto3")
    file.message_type.append(message)
    return "rig.CanFrame", "protobuf", FileDescriptorSet(file=[file]).SerializeToString()
