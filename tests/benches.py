"""Benches for tests of what is not mechanics: their specimens need no finite elements."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from rig.spec.workspace import Setup, Workspace

ROOT = Path(__file__).resolve().parents[1]
BEAM_ACTUATOR = ROOT / "tests/specs/bellow-bending.yaml"
"""The shipped actuator with the prediction of beam theory alone."""


def with_beam_specimen(setup: Setup) -> Setup:
    """The set-up with a specimen that obeys beam theory."""
    beam, virtual = Workspace(ROOT).bench("virtual-beam").virtual, setup.bench.virtual
    assert beam is not None
    assert virtual is not None
    quick = virtual.model_copy(update={"specimen": beam.specimen})
    return replace(setup, bench=setup.bench.model_copy(update={"virtual": quick}))
