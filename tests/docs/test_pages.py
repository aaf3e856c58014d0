"""The site's generated pages hold what the code says; those written by hand leave nothing out."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest
from ruamel.yaml import YAML

import rig
from rig.link.faults import HINTS
from rig.spec.schema import schemas
from tests.evidence import Evidence
from tools.sitegen.commands import commands_page
from tools.sitegen.evidence import FOLDER, evidence_pages, read_evidence
from tools.sitegen.pins import HEADER, PinError, read_pins, wiring_diagram, wiring_table
from tools.sitegen.plots import curves, read_table
from tools.sitegen.specs import spec_pages

ROOT = Path(__file__).resolve().parents[2]
PINS = (ROOT / HEADER).read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def commands() -> str:
    return commands_page()


def test_every_module_of_a_verb_has_its_command_on_the_page(commands: str) -> None:
    modules = {path.stem for path in (ROOT / "rig/cli").glob("[a-z]*.py")} - {"app", "main"}
    verbs = {name.replace("_", "-") for name in modules if not name.startswith("calibrate_")}
    for verb in verbs:
        assert f"## `rig {verb}`" in commands
    for name in modules:
        if name.startswith("calibrate_"):
            assert f"### `rig calibrate {name.removeprefix('calibrate_')}`" in commands


def test_every_extra_is_on_the_page_of_the_installation() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    section = (ROOT / "docs/install.md").read_text("utf-8").split("## Extras")[1].split("\n## ")[0]
    extras = re.findall(r"^\| `(\w+)` \|", section, re.MULTILINE)
    assert sorted(extras) == sorted(project["optional-dependencies"])


def test_the_citation_names_the_version_of_the_package() -> None:
    citation = YAML(typ="safe").load((ROOT / "CITATION.cff").read_text("utf-8"))
    assert {"cff-version", "message", "title", "authors"} <= set(citation)
    assert citation["version"] == rig.__version__


def test_every_verb_is_in_the_table_of_the_readme(commands: str) -> None:
    readme = (ROOT / "README.md").read_text("utf-8")
    verbs = re.findall(r"^## `rig ([\w-]+)`", commands, re.MULTILINE)
    assert len(verbs) > 20
    assert [verb for verb in verbs if f"`rig {verb}" not in readme] == []


def test_options_stand_with_their_help_and_default(commands: str) -> None:
    predict = commands.split("## `rig predict`")[1].split("\n## ")[0]
    assert "* `--actuator" in predict
    assert "[required]" in predict
    assert "[default: pressure]" in predict


def test_every_field_of_every_kind_of_file_is_in_its_table() -> None:
    pages = spec_pages()
    assert set(pages) == set(schemas())
    for kind, schema in schemas().items():
        for model in (schema, *schema.get("$defs", {}).values()):
            for name in model.get("properties", {}):
                assert f"| `{name}` |" in pages[kind], (kind, name)


def test_a_field_shows_bounds_default_and_unit() -> None:
    (row,) = [
        line
        for line in spec_pages()["actuator"].splitlines()
        if line.startswith("| `radius_ratio`")
    ]
    assert "above 0" in row
    assert "below 1" in row
    assert "plain number" in row
    (row,) = [
        line
        for line in spec_pages()["actuator"].splitlines()
        if line.startswith("| `effective_length`")
    ]
    assert "`66 mm`" in row


def test_models_are_linked_to_a_section_that_is_there() -> None:
    for kind, page in spec_pages().items():
        sections = {name.lower() for name in re.findall(r"^## (\w+)$", page, re.MULTILINE)}
        assert set(re.findall(r"\]\(#(\w+)\)", page)) <= sections, kind


def test_the_wiring_is_that_of_the_header_and_of_the_firmwares_manual() -> None:
    pins = read_pins(PINS)
    manual = (ROOT / "firmware/README.md").read_text(encoding="utf-8")
    section = manual.split("## Pins of the Mega")[1].split("\n## ")[0]
    rows = "".join(line.split("|")[1] for line in section.splitlines() if line.startswith("|"))
    assert {pin.name for pin in pins} == set(re.findall(r"[AD]\d+", rows))
    for pin in pins:
        assert f"| {pin.name} | {pin.port} | {pin.wire.device} |" in wiring_table(pins)
        assert f">{pin.name}</text>" in wiring_diagram(pins)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("_BV(PA0);         // D22", "_BV(PA0);         // D23"),
        ("_BV(PA0);         // D22", "_BV(PA7);         // D22"),
        ("constexpr uint8_t kStep", "constexpr uint8_t kStride"),
        (
            "constexpr uint8_t kStep",
            "constexpr uint8_t kBrake = _BV(PB0);\nconstexpr uint8_t kStep",
        ),
    ],
)
def test_a_header_that_was_changed_without_the_wiring_is_refused(old: str, new: str) -> None:
    assert old in PINS
    with pytest.raises(PinError):
        read_pins(PINS.replace(old, new))


@pytest.mark.parametrize("page", ["docs/troubleshooting.md", "docs/firmware/faults.md"])
def test_every_fault_of_the_board_has_an_entry(page: str) -> None:
    """The hints hold every fault of the schema: tests/link/test_client.py."""
    entries = re.findall(r"^\| `(\w+)` \|", (ROOT / page).read_text("utf-8"), re.MULTILINE)
    assert sorted(entry for entry in entries if entry in HINTS) == sorted(HINTS)


def test_plots_hold_the_numbers_of_the_pages_table() -> None:
    page = "# P\n\n## T: a\n\n| x | y | z |\n| --- | --- | --- |\n| 1 | 2 | -3 |\n| RMSE | | 4 |\n"
    table = read_table(page, "T")
    assert table == {"x": [1.0], "y": [2.0], "z": [-3.0]}
    assert curves(table, "a (b)", "c").startswith("<svg")
    with pytest.raises(ValueError, match="no table"):
        read_table(page, "U")


def test_the_results_page_shows_every_table_of_a_test_that_is_there() -> None:
    pages = evidence_pages(ROOT)
    page = str(pages["validation/results.md"])
    files = sorted((ROOT / FOLDER).glob("*.csv"))
    assert files
    for path in files:
        head, columns = read_evidence(path.read_text("utf-8"))
        assert f"## {head['title']}" in page
        assert f"| {' | '.join(columns)} |" in page
        module, test = head["by"].split("::")
        assert f"def {test}(" in (ROOT / module).read_text("utf-8")
        picture = f"images/evidence/{path.stem}.svg"
        assert (f"](../{picture})" in page) == (picture in pages) == (head["plot"] != "none")


def test_what_a_test_finds_otherwise_than_the_site_shows_fails(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tests.evidence.ROOT", tmp_path)
    (tmp_path / FOLDER).mkdir(parents=True)
    table = {"case": ["a", "b"], "found (m)": [1.0, 2.0]}
    with pytest.raises(AssertionError, match="not there yet"):
        Evidence("here", renewing=False)("some", "Some", table)
    Evidence("here", renewing=True)("some", "Some", table)
    check = Evidence("here", renewing=False)
    check("some", "Some", table)
    check("some", "Some", {**table, "found (m)": [1.0, 2.01]}, rel=0.01)
    for title, changed in (
        ("Some", {**table, "found (m)": [1.0, 2.1]}),
        ("Some", {**table, "case": ["a", "c"]}),
        ("Some", {"case": ["a", "b"]}),
        ("Other", table),
    ):
        with pytest.raises(AssertionError, match="pytest --evidence here"):
            check("some", title, changed, rel=0.01)


def test_no_formula_of_a_theory_page_is_a_block_of_code() -> None:
    for page in sorted((ROOT / "docs/theory").glob("*.md")):
        prose = re.sub(
            r"^ *```.*?^ *```", "", page.read_text("utf-8"), flags=re.DOTALL | re.MULTILINE
        )
        assert re.findall(r"^    \S.*=.*", prose, re.MULTILINE) == [], page.name
