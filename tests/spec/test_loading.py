"""Spec files: what is wrong with them, and where."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rig.spec.actuator import ActuatorSpec
from rig.spec.calibration import CameraCalibration
from rig.spec.errors import SpecError
from rig.spec.loading import (
    load,
    load_actuator,
    load_bench,
    load_calibration,
    load_material,
    load_protocol,
    load_published,
    parse,
    parse_any,
)

ROOT = Path(__file__).resolve().parents[2]
ACTUATOR = ROOT / "models/actuators/bellow-bending.yaml"
BENCH = ROOT / "models/benches/virtual.yaml"
CAMERA = ROOT / "calibration/camera-virtual.yaml"
PROTOCOL = ROOT / "models/protocols/default.yaml"
MATERIAL = ROOT / "models/materials/agilus30.yaml"
SHIPPED = sorted([*ROOT.glob("models/**/*.yaml"), *ROOT.glob("calibration/*.yaml")])

SMALL = """\
kind: actuator
name: small
geometry:
  family: bellow-bending
material: agilus30
limits: {pressure: 12 kPa}
"""


def complaints(text: str) -> list[str]:
    """The problems of a file with `text`, as printed."""
    with pytest.raises(SpecError) as caught:
        parse_any(text, Path("file.yaml"))
    return [str(problem) for problem in caught.value.problems]


def place(path: Path, found: str) -> str:
    """`line:column` of the first occurrence of `found` in a file, comments left out."""
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(True), 1):
        line = re.sub(r"^#.*", "", line)
        if found in line:
            return f"{number}:{line.index(found) + 1}"
    raise AssertionError(f"no '{found}' in {path}")


def test_defaults_are_those_of_table_1() -> None:
    text = parse(SMALL, Path("file.yaml"), ActuatorSpec).spec.geometry
    assert text == load_actuator(ACTUATOR).geometry


def test_a_file_is_loaded_with_its_path_and_text() -> None:
    loaded = parse(SMALL, Path("file.yaml"), ActuatorSpec)
    assert (loaded.path, loaded.text) == (Path("file.yaml"), SMALL)
    assert len(loaded.sha256) == 64


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: str(path.relative_to(ROOT)))
def test_a_shipped_spec_survives_json(path: Path) -> None:
    spec = load(path)
    assert type(spec).model_validate_json(spec.model_dump_json()) == spec


@pytest.mark.parametrize(
    ("path", "old", "new", "at", "field", "message"),
    [
        (ACTUATOR, "66 mm", "66 kPa", "66 mm", "geometry.effective_length", "is a pressure, not a"),
        (ACTUATOR, "66 mm", "66,5 mm", "66 mm", "geometry.effective_length",
         "'66,5 mm' has a comma; write a decimal point"),
        (ACTUATOR, "66 mm", ".nan", "66 mm", "geometry.effective_length", "not a finite number"),
        (ACTUATOR, "66 mm", "-1", "66 mm", "geometry.effective_length", "'-1' is out of range"),
        (ACTUATOR, "66 mm ", "yes ", "66 mm", "geometry.effective_length", "is not a number with"),
        (ACTUATOR, "66 mm ", "true ", "66 mm", "geometry.effective_length", "true is no quantity"),
        (ACTUATOR, "1/3", "4/3", "1/3", "geometry.radius_ratio", "above 0 and below 1"),
        (ACTUATOR, ": 6  ", ": 6.5", "6   ", "geometry.bellow_number", "expected a whole number"),
        (ACTUATOR, ": 6  ", ": true", "6   ", "geometry.bellow_number", "true does not fit"),
        (ACTUATOR, "wall_thickness", "wal_thickness", "wall_t", "geometry.wal_thickness",
         "unknown key 'wal_thickness'; did you mean 'wall_thickness'?"),
        (ACTUATOR, "limits:", "limit:", "limits:", "limit", "did you mean 'limits'?"),
        (ACTUATOR, "[beam, fe]", "[beem, fe]", "beam, fe]",
         "predictions[0]", "did you mean 'beam'?"),
        (ACTUATOR, "bellow-bending\n  eff", "bellow-bendig\n  eff", None,
         "geometry.family", "did you mean 'bellow-bending'?"),
        (ACTUATOR, "material: agilus30\n", "", "kind", "material", "required, but missing"),
        (ACTUATOR, "name: bellow-bending", "name: [a]", "bellow-bending\n", "name", "a list does"),
        (BENCH, "bits: 10", "bits: 99", "10  ", "adc.bits", "at least 8 and at most 16"),
        (BENCH, "bits: 10", "bits: 7", "10  ", "adc.bits", "at least 8 and at most 16"),
        (BENCH, "blur: 0.8", "blur: 21", "0.8", "virtual.optics.blur", "at most 20"),
        (BENCH, "noise: 3", "noise: 101", "3\n", "virtual.optics.noise", "at most 100"),
        (BENCH, "tilt: 1 deg", "tilt: 21 deg", None, "virtual.optics.tilt", "at most 20 deg"),
        (BENCH, "25 %", "101 %", "25 %", "virtual.optics.light_gradient", "at most 1"),
        (BENCH, "30 Hz", "0.01 Hz", "30 Hz", "camera.frame_rate", "at least 0.1 Hz"),
        (BENCH, "{kind: virtual}", "{kind: serial, port: ''}", None, "board.port", "not empty"),
        (ACTUATOR, ": 6  ", ": 1001  ", "6   ", "geometry.bellow_number", "at most 1000"),
        (ACTUATOR, ": 6  ", f": {'9' * 400}  ", "6   ", "geometry.bellow_number", "at most 1000"),
        (PROTOCOL, "repeats: 5", "repeats: 1001", None, "deformation.repeats", "at most 1000"),
        (PROTOCOL, "hold: 30 s", "hold: 25 h", None, "deformation.hold", "at most 86400 s"),
        (PROTOCOL, "rest: 10 s", "rest: 25 h", None, "deformation.rest", "at most 86400 s"),
        (PROTOCOL, "window: 1 s", "window: 60 s", None, "deformation.settling",
         "window is 60 s, timeout 60 s; expected window below timeout"),
        (BENCH, "0.8\n", ".inf\n", "0.8", "virtual.optics.blur", "expected a number, at least 0"),
        (BENCH, "board: {kind: virtual}", "board: {kind: vrtual}", "virtual}", "board.kind",
         "did you mean 'virtual'? expected one of 'virtual', 'emulated', 'serial'"),
        (BENCH, "board: {kind: virtual}", "board: {}", "{kind", "board.kind",
         "required, but missing; expected one of 'virtual', 'emulated', 'serial'"),
        (BENCH, "23 degC", "-300 degC", "23 degC", "ambient.temperature", "above -273.15 degC"),
        (BENCH, "device: {kind: virtual}", "device: {kind: opencv, source: [1]}", None,
         "camera.device.source", "expected a whole number or text"),
        (CAMERA, "-0.0002, 0.0", "-0.0002", "[-0.12", "distortion[4]", "required, but missing"),
        (CAMERA, "0.0003", "x", "0.0003", "distortion[2]", "expected a number"),
        (CAMERA, "2025-01-01", "0", "2025-01-01", "provenance.date", "expected a date as 2025-"),
        (CAMERA, "instrument: camera\n", "instrument: camra\n", "camera\n", "instrument",
         "did you mean 'camera'?"),
        (MATERIAL, "0.49", "0.5", "0.49", "poisson_ratio.value", "below 0.5"),
        (MATERIAL, "low: 2.4", "low: 3.2", "low: 2.4", "tensile_strength", "'low' at most 'high'"),
        (PROTOCOL, "step: 1 kPa", "step: 3 kPa", "{start", "deformation.pressures",
         "3.333 steps; expected a whole number from 1 to 1000"),
        (PROTOCOL, "step: 1 kPa", "step: 1e-9 kPa", "{start", "deformation.pressures",
         "expected a whole number from 1 to 1000"),
        (PROTOCOL, "descending_repeats: 1", "descending_repeats: 6", "pressures: {", "deformation",
         "descending_repeats is 6; expected at most the 5 of repeats"),
    ],
)  # fmt: skip
def test_one_mistake_is_one_problem_at_its_line_and_field(
    path: Path, old: str, new: str, at: str | None, field: str, message: str
) -> None:
    text = path.read_text(encoding="utf-8")
    assert old in text
    problems = complaints(text.replace(old, new, 1))
    here = [p for p in problems if f": {field}: " in p and message in p]
    assert here, problems
    if at is not None:
        assert here[0].startswith(f"file.yaml:{place(path, at)}: ")
    others = [p for p in problems if p not in here]
    assert all("required, but missing" in p for p in others)  # of the key that was misspelt


def test_the_exact_place_and_words_of_a_wrong_unit() -> None:
    text = SMALL.replace("12 kPa", "12 mm")
    assert complaints(text) == [
        "file.yaml:6:20: limits.pressure: '12 mm' is a length, not a pressure; "
        "expected a pressure such as '10 kPa' (a bare number is in kPa)"
    ]


def test_all_mistakes_of_a_file_are_told_at_once_in_its_order() -> None:
    text = """\
kind: actuator
nam: x
geometry:
  family: bellow-bending
  effective_lenght: 66 mm
  bellow_number: 2.5
  wall_thickness: 1 kPa
limits: {pressure: 12 bananas, foo: 1}
predictions: [bem]
"""
    places = [re.match(r"file.yaml:(\d+):(\d+): ([^:]*)", p) for p in complaints(text)]
    assert [match.groups() for match in places if match] == [
        ("1", "1", "name"),
        ("1", "1", "material"),
        ("2", "1", "nam"),
        ("5", "3", "geometry.effective_lenght"),
        ("6", "18", "geometry.bellow_number"),
        ("7", "19", "geometry.wall_thickness"),
        ("8", "20", "limits.pressure"),
        ("8", "32", "limits.foo"),
        ("9", "15", "predictions[0]"),
    ]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"wall_thickness": "2.75 mm"}, ["reduce wall_thickness below 2.75 mm"]),
        ({"bellow_number": "4"}, ["the flanks have no room", "increase average_radius"]),
        ({"radius_ratio": "0.6"}, ["the flanks have no room", "reduce radius_ratio"]),
        (
            {"effective_length": "200 mm", "wall_thickness": "9 mm"},
            ["the wall does not fit", "the flanks have no room"],
        ),
    ],
)
def test_impossible_geometry_says_which_parameter_to_change(
    change: dict[str, str], words: list[str]
) -> None:
    lines = "".join(f"  {key}: {value}\n" for key, value in change.items())
    (problem,) = complaints(SMALL.replace("material:", lines + "material:"))
    assert problem.startswith("file.yaml:4:3: geometry: ")
    assert all(word in problem for word in words)


def test_parts_of_a_bench_must_fit_together() -> None:
    text = BENCH.read_text(encoding="utf-8")
    text = text.replace("pressure: 15 kPa", "pressure: 50 kPa").replace(
        "reference: 5 V", "reference: 4 V"
    )
    text = text.replace("device: {kind: virtual}", "device: {kind: opencv, source: 0}")
    (problem,) = complaints(text)
    assert "safety.pressure is 50 kPa, beyond what the transducer can see" in problem
    assert "transducer.voltage_high is 4.5 V, beyond what the converter can see" in problem
    assert "expected both simulated or both real" in problem


def test_a_protocol_without_experiments_is_refused() -> None:
    (problem,) = complaints("kind: protocol\nname: nothing\n")
    assert "expected 'deformation', 'blocked_force' or 'trials'" in problem


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "file.yaml: the file is empty"),
        ("# only a comment\n", "file.yaml: the file is empty"),
        ("- 1\n- 2\n", "file.yaml:1:1: expected 'key: value' lines at the top level"),
        ("just text\n", "file.yaml:1:1: expected 'key: value' lines at the top level"),
        ("a: [1, 2\n", "file.yaml:2:1: not valid YAML: while parsing a flow sequence"),
        ("a: 1\n b: 2\n", "file.yaml:2:3: not valid YAML:"),
        ("a: 1\n\tb: 2\n", "file.yaml:2:1: not valid YAML:"),
        ("a: \x00\n", "file.yaml:1:4: the character U+0000 is not allowed in YAML"),
        ("a: 1\n---\nb: 2\n", "file.yaml:2:1: not valid YAML: expected a single document"),
        ("a: *b\n", "file.yaml:1:4: not valid YAML: found undefined alias"),
        ("a: &x [*x]\n", "file.yaml:1:4: a[0]: an alias refers to the value that contains it"),
        ("a: !!python/object:os.system x\n", "file.yaml:1:4: a: the tag 'tag:yaml.org,2002:py"),
        ("name: x\n", "file.yaml:1:1: kind: required, but missing; expected one of 'actuator'"),
        ("kind: actuatr\n", "file.yaml:1:7: kind: 'actuatr' is not known; did you mean 'actuator"),
        ("kind: [1]\n", "file.yaml:1:7: kind: '[1]' is not known"),
        ("kind: calibration\n", "file.yaml:1:1: instrument: required, but missing"),
        ("[" * 1000, "file.yaml: not valid YAML: nested too deeply"),
        ("a: 2025-13-45\n", "file.yaml:1:4: a: '2025-13-45' is not a valid timestamp"),
        ("a: " + "9" * 5000, f"file.yaml:1:4: a: '{'9' * 40}' is not a valid int"),
        ('a: "\\ud800"\n', "file.yaml:1:4: a: half a character"),
        ('"\\udc00": 1\n', "file.yaml:1:1: half a character"),
        ("a: &x {b: 1}\nc:\n  <<: *x\n", "file.yaml:3:3: c: merge keys are not used in specs; "
         "write the keys out"),
        ("? [1, 2]\n: 3\n", "file.yaml:1:3: expected plain text as key"),
    ],
)  # fmt: skip
def test_text_that_is_no_spec_is_told_in_the_same_style(text: str, expected: str) -> None:
    assert complaints(text)[0].startswith(expected)


def test_duplicate_keys_are_refused_with_both_lines() -> None:
    text = SMALL + "name: other\nmaterial: tangoplus\n"
    assert complaints(text) == [
        "file.yaml:7:1: name: duplicate key 'name', first given in line 2; keep one",
        "file.yaml:8:1: material: duplicate key 'material', first given in line 5; keep one",
    ]


def test_aliases_that_multiply_are_refused() -> None:
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 9)]
    assert "more than 50000 values" in complaints("\n".join(lines))[0]


def test_escaped_pairs_of_surrogates_are_one_character() -> None:
    text = SMALL + 'description: "\\ud83d\\ude42"\n'
    assert parse_any(text, Path("file.yaml")).spec.description == "\U0001f642"


@pytest.mark.parametrize("path", [ACTUATOR, BENCH, PROTOCOL, MATERIAL], ids=lambda p: p.parent.name)
@pytest.mark.parametrize("name", ["../up", "/etc/x", "a/b", "..", ".hidden", "-flag", "x" * 81, ""])
def test_a_name_that_could_leave_its_folder_is_refused(path: Path, name: str) -> None:
    text = re.sub(r"(?m)^name: .*$", f'name: "{name}"', path.read_text(encoding="utf-8"))
    (problem,) = complaints(text)
    assert ": name: " in problem
    assert "beginning with a letter or digit" in problem


def test_a_name_may_hold_dots_and_dashes_and_a_material_spaces() -> None:
    small = SMALL.replace("name: small", "name: Bellow_2.1-b")
    assert parse_any(small, Path("file.yaml")).spec.name == "Bellow_2.1-b"
    assert ": name: " in complaints(SMALL.replace("name: small", "name: two words"))[0]
    material = MATERIAL.with_name("agilus30-dm50.yaml")
    assert load_material(material).name == "Agilus30 DM50"


def test_an_alias_may_repeat_a_value() -> None:
    text = SMALL.replace("limits: {pressure: 12 kPa}", "limits: {pressure: &p 12 kPa}")
    assert parse_any(text + "description: *p\n", Path("file.yaml")).spec.description == "12 kPa"


def test_a_missing_file_a_directory_and_binary_are_told_in_the_same_style(tmp_path: Path) -> None:
    binary = tmp_path / "binary.yaml"
    binary.write_bytes(b"kind: actuator\nname: \xff\xfe\n")
    for path, expected in (
        (tmp_path / "none.yaml", f"{tmp_path / 'none.yaml'}: no such file"),
        (tmp_path, f"{tmp_path}: is a directory; expected a YAML file"),
        (binary, f"{binary}:2:7: byte 0xff is not UTF-8 text; save the file as UTF-8"),
        (Path("\0"), "\0: cannot be read: embedded null byte"),
    ):
        with pytest.raises(SpecError) as caught:
            load(path)
        assert str(caught.value) == expected


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_a_pipe_is_refused_without_waiting_for_it(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe.yaml"
    os.mkfifo(pipe)
    with pytest.raises(SpecError, match="is a device or a pipe; expected a YAML file"):
        load(pipe)


def test_a_device_without_end_is_refused() -> None:
    endless = Path("/dev/zero")
    if not endless.exists():
        pytest.skip("needs /dev/zero")
    with pytest.raises(SpecError, match="is a device or a pipe"):
        load(endless)


def test_of_a_huge_file_only_the_limit_is_read(tmp_path: Path) -> None:
    path = tmp_path / "huge.yaml"
    with path.open("wb") as file:
        file.truncate(50_000_000_000)  # sparse
    with pytest.raises(SpecError, match="larger than 4000000 bytes: no spec"):
        load(path)


def test_a_byte_order_mark_and_windows_line_ends_do_no_harm(tmp_path: Path) -> None:
    path = tmp_path / "windows.yaml"
    path.write_bytes(b"\xef\xbb\xbf" + SMALL.replace("\n", "\r\n").encode())
    assert load_actuator(path).name == "small"


@pytest.mark.parametrize(
    ("loader", "path", "message"),
    [
        (load_actuator, MATERIAL, "kind: this file is for 'material'; expected 'actuator'"),
        (load_material, BENCH, "kind: this file is for 'bench'; expected 'material'"),
        (load_bench, PROTOCOL, "kind: this file is for 'protocol'; expected 'bench'"),
        (load_protocol, CAMERA, "kind: this file is for 'calibration'; expected 'protocol'"),
        (load_published, ACTUATOR, "kind: this file is for 'actuator'; expected 'published'"),
        (load_calibration, ACTUATOR, "kind: 'actuator' is not known; expected 'calibration'"),
    ],
)
def test_a_file_of_another_kind_is_one_problem(
    loader: Callable[[Path], object], path: Path, message: str
) -> None:
    with pytest.raises(SpecError) as caught:
        loader(path)
    (problem,) = caught.value.problems
    assert message in str(problem)
    assert problem.line is not None


def test_a_calibration_of_another_instrument_is_one_problem() -> None:
    path = ROOT / "calibration/ruler-virtual.yaml"
    with pytest.raises(SpecError) as caught:
        parse(path.read_text(encoding="utf-8"), path, CameraCalibration)
    (problem,) = caught.value.problems
    assert "instrument: this file is for 'ruler'; expected 'camera'" in str(problem)


@given(st.text(max_size=300))
def test_any_text_is_a_spec_or_a_spec_error(text: str) -> None:
    with pytest.raises(SpecError) as caught:
        parse_any(text, Path("file.yaml"))
    assert caught.value.problems


@given(st.text(alphabet="abk: -[]{}&*!|>'\"%@`#,?\n\t0.~<=\\", max_size=60))
@settings(max_examples=300)
def test_any_punctuation_is_a_spec_or_a_spec_error(text: str) -> None:
    with pytest.raises(SpecError):
        parse_any(text, Path("file.yaml"))


@given(st.data())
@settings(max_examples=150, suppress_health_check=[HealthCheck.too_slow])
def test_a_damaged_file_loads_or_is_a_spec_error(data: st.DataObject) -> None:
    text = data.draw(st.sampled_from(SHIPPED)).read_text(encoding="utf-8")
    start = data.draw(st.integers(0, len(text)))
    end = data.draw(st.integers(start, min(len(text), start + 20)))
    damage = data.draw(st.text(max_size=10) | st.sampled_from(["\n", ": ", "{}", "[", "'", "1e9"]))
    try:
        parse_any(text[:start] + damage + text[end:], Path("file.yaml"))
    except SpecError as error:
        assert error.problems  # noqa: PT017 - both outcomes are right


@given(st.binary(max_size=200))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_bytes_are_a_spec_or_a_spec_error(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "bytes.yaml"
    path.write_bytes(content)
    with pytest.raises(SpecError):
        load(path)


json_like = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=10),
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3)
    ),
    max_leaves=8,
)


@given(st.sampled_from(SHIPPED), st.data())
@settings(max_examples=150, suppress_health_check=[HealthCheck.too_slow])
def test_any_value_in_any_field_is_taken_or_placed(path: Path, data: st.DataObject) -> None:
    lines = path.read_text(encoding="utf-8").splitlines()
    fields = [i for i, line in enumerate(lines) if re.match(r"^ *[a-z_]+: \S", line)]
    index = data.draw(st.sampled_from(fields))
    value = json.dumps(data.draw(json_like)).replace("Infinity", ".inf").replace("NaN", ".nan")
    lines[index] = lines[index].split(": ")[0] + ": " + value
    try:
        parse_any("\n".join(lines), Path("file.yaml"))
    except SpecError as error:
        assert all(problem.line for problem in error.problems)  # noqa: PT017
