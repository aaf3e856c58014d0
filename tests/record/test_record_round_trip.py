"""What goes into a run comes out of it, through our reader and through mcap's own."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from pydantic import ValidationError
from recorded_runs import (
    ATTACHMENTS,
    JPEG,
    ROWS_PER_POINT,
    START,
    UNITS,
    point,
    write_point,
    write_run,
)

from rig.record.channels import document_schema
from rig.record.documents import (
    DeformationReading,
    PointDocument,
    ResumeDocument,
    StartDocument,
    StopDocument,
)
from rig.record.errors import RecordError
from rig.record.layout import foxglove_layout
from rig.record.reader import RunReader
from rig.record.telemetry import RowFormatter, columns
from rig.record.writer import RunWriter


def test_a_run_reads_back_as_it_was_written(tmp_path: Path) -> None:
    reader = RunReader(write_run(tmp_path / "run"))
    assert reader.complete
    assert reader.problem is None
    assert reader.start() == START
    assert reader.stop() == StopDocument(exit_status="success", reason="")
    assert reader.resumes() == ()
    assert reader.attachments() == ATTACHMENTS
    assert reader.points() == tuple(point(number) for number in range(4))
    assert [r.value for r in reader.deformation_readings()] == [0, 0, 5, 5, None, None, 15, 15]
    assert reader.deformation_readings()[4].reason == "blurred"


def test_images_carry_the_point_they_belong_to(tmp_path: Path) -> None:
    images = list(RunReader(write_run(tmp_path / "run")).images())
    assert len(images) == 8
    assert {image.jpeg for image in images} == {JPEG}
    assert [image.frame for image in images] == [0, 1] * 4
    assert [image.key for image in images[::2]] == [point(number).key for number in range(4)]
    assert images[3].time_s == pytest.approx(7.1, abs=1e-9)


def test_an_image_of_no_point_has_no_key(tmp_path: Path) -> None:
    with RunWriter.create(tmp_path / "run", START, {}) as writer:
        writer.image(0.5, JPEG, None, 7)
    (image,) = RunReader(tmp_path / "run").images()
    assert image.key is None
    assert image.frame == 7


def test_telemetry_reads_back_in_columns(tmp_path: Path) -> None:
    reader = RunReader(write_run(tmp_path / "run"))
    assert reader.telemetry_messages() == ("HEARTBEAT", "PRESSURE")
    pressure = reader.telemetry("PRESSURE")
    assert set(pressure) == {"time_s", "pressure_kpa", "setpoint_kpa"}
    assert len(pressure["time_s"]) == 4 * ROWS_PER_POINT
    np.testing.assert_allclose(pressure["time_s"][:3], [0, 0.02, 0.04], atol=1e-12)
    np.testing.assert_allclose(pressure["pressure_kpa"][201], 1.001, atol=1e-12)
    assert reader.telemetry("HEARTBEAT")["state"].tolist() == ["run", "hold"] * 4


def test_a_message_that_never_came_has_no_rows(tmp_path: Path) -> None:
    fault = RunReader(write_run(tmp_path / "run")).telemetry("FAULT")
    assert {name: len(column) for name, column in fault.items()} == {"time_s": 0}


def test_raw_frames_read_back_in_order(tmp_path: Path) -> None:
    frames = RunReader(write_run(tmp_path / "run", points=1)).can_frames()
    assert frames.ids.tolist() == [0x110] * 200
    assert frames.payloads == [bytes([i, *range(7)]) for i in range(200)]
    np.testing.assert_allclose(frames.time_s, np.arange(200) * 0.02, atol=1e-9)


def test_raw_frames_of_different_lengths_read_back(tmp_path: Path) -> None:
    payloads = [b"", b"\x01", bytes(8)]
    with RunWriter.create(tmp_path / "run", START, {}) as writer:
        writer.can_frames([0.0, 0.1, 0.2], [1, 2, 0x7FF], payloads)
        writer.can_frames([0.3], [4], [b""])
        writer.can_frames(np.array([0.4, 0.5]), [5, 6], np.arange(16, dtype=np.uint8).reshape(2, 8))
    frames = RunReader(tmp_path / "run").can_frames()
    assert frames.ids.tolist() == [1, 2, 0x7FF, 4, 5, 6]
    assert frames.payloads == [*payloads, b"", bytes(range(8)), bytes(range(8, 16))]


def test_events_keep_their_level_and_data(tmp_path: Path) -> None:
    with RunWriter.create(tmp_path / "run", START, {}) as writer:
        writer.event(1.25, "fault", {"code": "leak", "value": 0.5}, "error")
    (event,) = RunReader(tmp_path / "run").events()
    assert (event.time_s, event.name, event.level) == (1.25, "fault", "error")
    assert event.data == {"code": "leak", "value": 0.5}


def test_mcaps_own_reader_finds_schemas_channels_and_counts(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run")
    with (folder / "run.mcap").open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        counts = {
            summary.channels[number].topic: count
            for number, count in summary.statistics.channel_message_counts.items()
        }
        assert counts == {
            "/camera": 8,
            "/camera/key": 8,
            "/can": 800,
            "/log": 5,
            "/points": 4,
            "/rig/heartbeat": 8,
            "/rig/pressure": 800,
            "/vision/deformation": 8,
        }
        assert summary.statistics.message_count == sum(counts.values())
        schemas = {
            channel.topic: summary.schemas[channel.schema_id]
            for channel in summary.channels.values()
        }
        assert schemas["/camera"].name == "foxglove.CompressedImage"
        assert schemas["/log"].name == "foxglove.Log"
        assert schemas["/can"].encoding == "protobuf"
        pressure = json.loads(schemas["/rig/pressure"].data)
        assert pressure["properties"]["pressure_kpa"] == {
            "type": "number",
            "description": "in kPa",
            "unit": "kPa",
        }
        read = dict.fromkeys(counts, 0)
        for _, channel, _ in reader.iter_messages():
            read[channel.topic] += 1
        assert read == counts
        times = [message.log_time for _, _, message in reader.iter_messages()]
        assert times == sorted(times)
        assert {a.name: a.data for a in reader.iter_attachments()} == ATTACHMENTS
        assert [m.name for m in reader.iter_metadata()] == ["rig.start", "rig.stop"]


def test_protobuf_channels_decode_with_the_schemas_in_the_file(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", points=1)
    with (folder / "run.mcap").open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        decoded = {
            message.channel.topic: message.decoded_message
            for message in reader.iter_decoded_messages(["/can", "/camera", "/log"])
        }
    assert decoded["/can"].id == 0x110
    assert decoded["/can"].data == bytes([199, *range(7)])
    assert decoded["/camera"].format == "jpeg"
    assert decoded["/camera"].timestamp.nanos == 100_000_000
    assert CompressedImage.DESCRIPTOR.full_name == decoded["/camera"].DESCRIPTOR.full_name
    assert decoded["/log"].name == "stop"


def test_every_json_message_obeys_its_schema(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run")
    kinds = {"number": (int, float), "integer": int, "string": str, "array": list}
    kinds |= {"object": dict, "boolean": bool}
    with (folder / "run.mcap").open("rb") as stream:
        seen = 0
        for schema, _, message in make_reader(stream).iter_messages():
            if schema is None or schema.encoding != "jsonschema":
                continue
            properties = json.loads(schema.data)["properties"]
            for name, value in json.loads(message.data).items():
                assert isinstance(value, kinds[properties[name]["type"]]), (schema.name, name)
            seen += 1
    assert seen == 800 + 8 + 8 + 8 + 4


@pytest.mark.parametrize("model", [PointDocument, DeformationReading])
def test_document_schemas_are_flat(model: type) -> None:
    _, encoding, data = document_schema(model)
    text = data.decode()
    assert encoding == "jsonschema"
    assert "anyOf" not in text
    assert "$ref" not in text
    assert set(json.loads(text)["properties"]) == set(model.model_fields)


def test_the_same_run_gives_the_same_bytes(tmp_path: Path) -> None:
    one = write_run(tmp_path / "one") / "run.mcap"
    two = write_run(tmp_path / "two") / "run.mcap"
    assert one.read_bytes() == two.read_bytes()


def test_a_layout_for_foxglove_lies_beside_the_log(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", points=1)
    assert (folder / "foxglove-layout.json").read_text() == foxglove_layout()


def test_a_folder_that_is_not_empty_is_refused(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(RecordError, match="never overwrites"):
        RunWriter.create(tmp_path, START, {})
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


def test_a_second_writer_is_refused(tmp_path: Path) -> None:
    pytest.importorskip("fcntl")
    with RunWriter.create(tmp_path / "run", START, {}) as writer:
        write_point(writer, 0)
        with pytest.raises(RecordError, match="another process"):
            RunWriter.resume(tmp_path / "run")


@pytest.mark.parametrize("content", [b"", b"\x89MCAP", b"not an mcap file at all", bytes(100)])
def test_a_file_that_is_no_mcap_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "run.mcap"
    path.write_bytes(content)
    with pytest.raises(RecordError, match="not an MCAP"):
        RunReader(path)


def test_a_missing_run_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RecordError, match="no readable run"):
        RunReader(tmp_path / "nowhere")
    with pytest.raises(RecordError, match="no readable run"):
        RunReader(tmp_path)


def test_a_document_with_a_number_that_is_none_is_refused_before_it_is_written() -> None:
    values = point(1).model_dump() | {"value_u": float("nan")}
    with pytest.raises(ValidationError, match="finite"):
        PointDocument.model_validate(values)


NUMBERS = st.floats(allow_nan=False, allow_infinity=False)
st.register_type_strategy(float, NUMBERS)
ON_DISK = settings(max_examples=30)
TEXTS = st.text(max_size=20)


@ON_DISK
@given(
    document=st.builds(
        StartDocument,
        actuator=TEXTS,
        created=st.none() | TEXTS,
        seed=st.integers(-(2**63), 2**63),
        versions=st.dictionaries(TEXTS, TEXTS, max_size=3),
        parameters=st.dictionaries(TEXTS, NUMBERS, max_size=3),
    )
)
def test_any_start_document_survives(
    document: StartDocument, tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.mktemp("any") / "run"
    RunWriter.create(folder, document, {}).close()
    assert RunReader(folder).start() == document


@ON_DISK
@given(documents=st.lists(st.builds(PointDocument, value=st.none() | NUMBERS), max_size=4))
def test_any_points_survive(
    documents: list[PointDocument], tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.mktemp("any") / "run"
    with RunWriter.create(folder, START, {}) as writer:
        for document in documents:
            writer.point(document, 1.0)
    assert RunReader(folder).points() == tuple(documents)


@ON_DISK
@given(reason=TEXTS, status=st.sampled_from(["success", "aborted", "failed"]))
def test_any_stop_survives(
    reason: str, status: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.mktemp("any") / "run"
    stop = StopDocument(exit_status=status, reason=reason)
    note = ResumeDocument(resumed_s=1.5, points_kept=2, seed=3)
    with RunWriter.create(folder, START, {}) as writer:
        writer.resume_note(note, 1.5)
        writer.stop(stop, 2.0)
    reader = RunReader(folder)
    assert reader.stop() == stop
    assert reader.resumes() == (note,)
    assert reader.complete


@given(values=arrays(np.float32, st.integers(1, 30), elements=st.floats(width=32)))
def test_every_32_bit_float_survives_telemetry(values: np.ndarray) -> None:
    rows = [{"a_kpa": float(v), "state": "run", "n": i} for i, v in enumerate(values)]
    payloads = RowFormatter(rows[0])(rows)
    types = {"a_kpa": {"type": "number"}, "state": {"type": "string"}, "n": {"type": "number"}}
    back = columns(payloads, types)
    expected = np.where(np.isfinite(values), values, np.nan)
    np.testing.assert_array_equal(back["a_kpa"].astype(np.float32), expected)
    assert back["n"].tolist() == list(range(len(values)))


@given(texts=st.lists(st.text(), min_size=1, max_size=10))
def test_any_text_survives_telemetry(texts: list[str]) -> None:
    rows = [{"state": text} for text in texts]
    payloads = RowFormatter(rows[0])(rows)
    assert [json.loads(payload)["state"] for payload in payloads] == texts


def test_rows_may_lack_signals_or_bring_new_ones(tmp_path: Path) -> None:
    with RunWriter.create(tmp_path / "run", START, {}, UNITS) as writer:
        rows = [{"pressure_kpa": 1.0, "mode": "a"}, {"pressure_kpa": 2.0}, {"mode": "b"}]
        writer.telemetry("PRESSURE", [0.0, 0.1, 0.2], rows)
    table = RunReader(tmp_path / "run").telemetry("PRESSURE")
    np.testing.assert_array_equal(table["pressure_kpa"], [1.0, 2.0, np.nan])
    assert table["mode"].tolist() == ["a", "", "b"]
