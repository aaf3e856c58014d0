"""What may be asked of a point beside the columns of `rig predict`."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))
from test_run import LIBRARY

from rig.errors import RigError
from rig.mechanics.beam import BeamTheory
from rig.mechanics.bellow import BellowShape
from rig.mechanics.job import Job
from rig.mechanics.simulate.families import FAMILIES, Family, Meshing
from rig.mechanics.store import FolderStore
from rig.spec.actuator import BellowBendingGeometry
from rig.spec.errors import SpecError
from rig.spec.loading import parse
from rig.spec.study import StudyResponse, StudySpec
from rig.study import quantities
from rig.study.errors import StudyError
from rig.study.evaluate import evaluate
from rig.study.plan import Task
from rig.study.quantities import Asked, tip
from tests.mechanics.test_simulate_inflation import BendingTube, tube

ACTUATOR, MATERIAL = LIBRARY.actuator("bellow-bending"), LIBRARY.material("agilus30")


def asked(model: str = "beam", *pressures: float) -> Asked:
    return Asked(ACTUATOR, MATERIAL, model, list(pressures or (5e3,)), Job())


def test_the_tip_of_a_quarter_turn_is_where_a_quarter_circle_ends() -> None:
    radius = 0.06 / (np.pi / 2)
    assert tip(np.pi / 2, 0.06, 0.003) == pytest.approx([radius, radius + 0.003])
    assert tip(0.0, 0.06, 0.003) == pytest.approx([0.063, 0.0])


def test_the_tip_travels_along_its_arc() -> None:
    """The speed along the curve, by differences: L |d(sinc)| and the cap's turn, closed form."""
    angles = np.linspace(0, np.pi, 2001)
    path = np.array([tip(a, 0.06, 0.0) for a in angles])
    middle = (angles[1:] + angles[:-1]) / 2
    s = np.sin(middle / 2) / (middle / 2)
    # |d/da of the chord s(a) L at the angle a/2|
    slope = 0.06 * np.hypot((np.cos(middle / 2) - s) / middle, s / 2)
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    assert steps == pytest.approx(slope * np.diff(angles), rel=1e-5)


def test_the_workspace_is_between_rest_and_the_pressure() -> None:
    assert isinstance(ACTUATOR.geometry, BellowBendingGeometry)
    angle = float(BeamTheory.of(ACTUATOR.geometry, MATERIAL).angle(5e3))
    one = asked()
    assert one.value("angle_range", 5e3) == pytest.approx(np.degrees(angle))
    shape = BellowShape.of(ACTUATOR.geometry)
    beyond = shape.tip - shape.effective_length
    expected = np.linalg.norm(tip(angle, 0.066, beyond) - [shape.tip, 0])
    assert one.value("tip_travel", 5e3) == pytest.approx(1e3 * expected)


def test_the_inner_side_bends_to_an_arc_of_its_own_length() -> None:
    angle = asked().value("angle", 5e3)
    assert asked().value("inner_radius", 5e3) == pytest.approx(66 / np.radians(angle))


def test_what_is_straight_has_an_infinite_radius() -> None:
    one = asked("beam", 0.0)
    assert one.value("angle", 0.0) == 0.0
    assert one.value("inner_radius", 0.0) == np.inf


def test_shapes_are_told_without_a_calculation(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(quantities, "predict", None)
    assert asked("shape").value("outer_diameter", 0.0) == pytest.approx(2 * (10 + 1.5))
    assert asked("shape").value("groove_width", 0.0) == pytest.approx(2 * (66 / 24 - 1.5))


@pytest.mark.parametrize(
    "quantity", ["angle_range", "inner_radius", "tip_travel", "outer_diameter"]
)
def test_other_families_have_no_such_quantity(quantity: quantities.QuantityName) -> None:
    linear = LIBRARY.actuator("bellow-axisymmetric")
    one = Asked(linear, LIBRARY.material("dragon-skin-30"), "beam", [5e3], Job())
    with pytest.raises(RigError, match=r"bellow-(bending|axisymmetric)"):
        one.value(quantity, 5e3)


def test_strain_and_safety_are_those_of_the_strength_report(tmp_path: Path) -> None:
    """An axisymmetric bellow by finite elements, at a pressure between two rungs."""
    from rig.mechanics.simulate.prediction import free_inflation
    from rig.mechanics.strength import safety

    linear, soft = LIBRARY.actuator("bellow-axisymmetric"), LIBRARY.material("dragon-skin-30")
    linear = linear.model_copy(
        update={"geometry": linear.geometry.model_copy(update={"bellow_number": 3})}
    )
    job = Job(FolderStore(tmp_path))
    rung = linear.limits.pressure / 12
    one = Asked(linear, soft, "fe", [1.5 * rung], job)
    found = free_inflation(linear, soft).curves(2 * rung, job).extremes
    strains = [e.principal_strain.value for e in found]
    governing = [safety(e, soft).governing for e in found]
    factors = [g.factor for g in governing if g is not None]
    assert 100 * strains[1] < one.value("max_strain", 1.5 * rung) < 100 * strains[2]
    assert factors[2] < one.value("safety_factor", 1.5 * rung) < factors[1]
    assert one.value("safety_factor", 2 * rung) == pytest.approx(factors[2])
    unknown = soft.model_copy(update={"tensile_strength": None, "elongation_at_break": None})
    with pytest.raises(StudyError, match="neither tensile_strength"):
        Asked(linear, unknown, "fe", [rung], job).value("safety_factor", rung)


@pytest.mark.parametrize(
    ("response", "words"),
    [
        ("{name: s, quantity: safety_factor, model: beam, pressure: 5 kPa}", "'fe' only"),
        ("{name: s, quantity: groove_width, model: fe, pressure: 5 kPa}", "'shape'"),
        ("{name: s, quantity: angle, model: shape}", "'shape'"),
        ("{name: s, quantity: angle, model: beam}", "expected 'pressure'"),
    ],
)
def test_what_a_model_cannot_tell_is_refused(response: str, words: str) -> None:
    text = (
        "kind: study\nname: small\nactuator: bellow-bending\n"
        "factors:\n  - {name: a, field: actuator.geometry.wall_thickness, low: 1 mm, high: 2 mm}\n"
        f"design: {{kind: full-factorial}}\nresponses:\n  - {response}\n"
    )
    with pytest.raises(SpecError, match=words):
        parse(text, Path("study.yaml"), StudySpec)


@pytest.mark.parametrize("quantity", ["angle", "blocked_force"])
def test_the_tip_is_blocked_only_where_its_force_is_asked_for(
    quantity: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    built = []

    def held(geometry: object, material: object) -> BendingTube:
        built.append("blocked")
        return tube(geometry, material)

    tubes = Meshing(tube, held)
    monkeypatch.setitem(FAMILIES, "bellow-bending", Family(tubes, tubes))
    monkeypatch.setenv("RIG_CACHE_DIR", str(tmp_path))
    wanted = StudyResponse.model_validate(
        {"name": "wanted", "quantity": quantity, "model": "fe", "pressure": "1 kPa"}
    )
    values = evaluate(Task("one", ACTUATOR, MATERIAL, (wanted,), None))
    assert values["wanted"] > 0
    assert built == (["blocked"] if quantity == "blocked_force" else [])
