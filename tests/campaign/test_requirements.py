"""Every safety requirement has a scenario, and every scenario a requirement."""

from __future__ import annotations

import re
from pathlib import Path

from rig.link.schema import load_schema
from rig.spec import faults
from rig.spec.workspace import Workspace

ROOT = Path(__file__).resolve().parents[2]
REQUIREMENTS = ROOT / "docs" / "safety" / "requirements.md"
ROW = re.compile(r"\| (SR-\d\d) \| (.+?) \| (.+?) \| (.+?) \|")


def documented() -> dict[str, set[str]]:
    """Requirement to its scenarios, as the document says."""
    rows = [ROW.fullmatch(line) for line in REQUIREMENTS.read_text(encoding="utf-8").splitlines()]
    return {row[1]: set(row[4].split(", ")) for row in rows if row is not None}


def scripted() -> dict[str, set[str]]:
    """Requirement to its scenarios, as the scripts say."""
    workspace = Workspace(ROOT)
    found: dict[str, set[str]] = {}
    for name in workspace.names("faults"):
        for requirement in workspace.faults(name).requirements:
            found.setdefault(requirement, set()).add(name)
    return found


def test_document_and_scripts_link_the_same_scenarios() -> None:
    assert len(documented()) > 10
    assert documented() == scripted()


def test_every_scenario_is_for_something() -> None:
    linked = set().union(*scripted().values())
    assert linked == set(Workspace(ROOT).names("faults"))


def test_requirements_are_numbered_without_gaps() -> None:
    assert list(documented()) == [f"SR-{n:02d}" for n in range(1, len(documented()) + 1)]


def test_every_kind_of_fault_is_in_some_scenario() -> None:
    workspace = Workspace(ROOT)
    used = {f.kind for name in workspace.names("faults") for f in workspace.faults(name).faults}
    schema = faults.FaultScript.model_json_schema()["$defs"]
    known: set[str] = set()
    for definition in schema.values():
        kind = definition.get("properties", {}).get("kind", {})
        known |= {kind["const"]} if "const" in kind else set(kind.get("enum", []))
    assert len(known) > 20
    assert used == known


def test_fault_codes_and_states_are_those_of_the_link() -> None:
    codes = set(load_schema().choices("HEARTBEAT", "fault_code").values())
    assert {*faults.FaultCode.__args__, "none"} == codes  # type: ignore[attr-defined]
    states = set(load_schema().choices("HEARTBEAT", "state").values())
    assert set(faults.BoardState.__args__) == states  # type: ignore[attr-defined]


def test_every_fault_code_of_the_link_is_provoked() -> None:
    workspace = Workspace(ROOT)
    expected = {
        c for name in workspace.names("faults") for c in workspace.faults(name).expect.codes
    }
    assert expected == set(faults.FaultCode.__args__)  # type: ignore[attr-defined]
