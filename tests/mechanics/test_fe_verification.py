"""Problems with known answers: patch tests, thick walls, Cook's membrane, beams, large rotation.

The last test compares what they compute with the table in docs/theory/finite-elements.md.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
import skfem
from scipy.integrate import quad

from rig.mechanics.fe import (
    DisplacementControl,
    Kinematics,
    Model,
    Options,
    Point,
    PressureSurface,
    Solid,
    Support,
    discretise,
    follow,
    traction,
)
from rig.mechanics.fe.contact import settle
from rig.mechanics.fe.tie import Tie
from rig.mechanics.hyperelastic import MooneyRivlin, NeoHookean, QuadraticVolume
from tests.mechanics.fe_problems import curved_triangles, driven, meshes, ring

MESHES = meshes()

# Auysakul et al. (2023): W = C10 (I1 - 3) + C11 (I1 - 3)(I2 - 3) in MPa, lengths in mm
C10, C11 = 0.1192, 0.01484
INNER, OUTER = 10.0, 20.0
CYLINDER = {"bore": 18.0, "pressure": 0.149731}
SPHERE = {"bore": 15.0, "pressure": 0.227968}
RUBBER = MooneyRivlin(C10, 0.0, c11=C11)
BULK = 1e6 * C10
"""So stiff that a change of volume changes nothing in the digits compared."""
SHARP = Options(tolerance=1e-8, correction=0.0)


@pytest.mark.parametrize("name", MESHES)
def test_a_homogeneous_deformation_passes_the_patch_test(name: str) -> None:
    mesh, kinematics = MESHES[name]
    d = discretise(mesh, kinematics)
    solid = Solid(d, NeoHookean(1.0), QuadraticVolume(50.0))
    # where the third direction is free to follow, the linear field keeps the equilibrium
    slope = {
        Kinematics.SOLID: [[0.1, 0.2, 0.0], [0.05, -0.1, 0.1], [0.0, 0.1, 0.05]],
        Kinematics.PLANE_STRAIN: [[0.1, 0.2], [0.05, -0.1]],
        Kinematics.AXISYMMETRIC: [[0.1, 0.0], [0.0, -0.15]],
    }[kinematics]
    expected = d.nodes @ np.array(slope).T
    model = driven(d, [solid], np.array(slope))
    result = follow(model, [Point(0.0)], options=SHARP)
    assert result.failure is None
    found = result.solutions[0].state.x[: d.displacement_size].reshape(-1, d.dim)
    np.testing.assert_allclose(found, expected, atol=1e-11)
    f = np.eye(3)
    f[: d.dim, : d.dim] += slope
    if kinematics is Kinematics.AXISYMMETRIC:
        f = np.diag([1.1, 0.85, 1.1])
    state = result.solutions[0].state
    pressure = solid.pressure(state.x, state.points[0])
    np.testing.assert_allclose(pressure, 50.0 * (np.linalg.det(f) - 1), atol=1e-9)


def _closed_form(bore: float, exponent: int) -> float:
    """Pressure in MPa that widens the bore of an incompressible cylinder (2) or sphere (3)."""
    outer = (OUTER**exponent + bore**exponent - INNER**exponent) ** (1 / exponent)

    def integrand(s: float) -> float:
        if exponent == 2:
            i1 = i2 = s**2 + s**-2 + 1
            slopes = 2 * (s - s**-3), 2 * (s - s**-3)
        else:
            i1, i2 = 2 * s**2 + s**-4, s**4 + 2 * s**-2
            slopes = 4 * (s - s**-5), 4 * (s**3 - s**-3)
        energy_slope = (C10 + C11 * (i2 - 3)) * slopes[0] + C11 * (i1 - 3) * slopes[1]
        return energy_slope / (s**exponent - 1)

    return float(quad(integrand, outer / OUTER, bore / INNER)[0])


def test_the_published_pressures_are_those_of_the_closed_form_with_c11() -> None:
    assert _closed_form(CYLINDER["bore"], 2) == pytest.approx(CYLINDER["pressure"], abs=6e-7)
    assert _closed_form(SPHERE["bore"], 3) == pytest.approx(SPHERE["pressure"], abs=6e-7)


def _inflated(d, supports, bore_dof: int, bore: float):
    solid = Solid(d, RUBBER, QuadraticVolume(BULK))
    surface = PressureSurface(d, d.facets_on("bore"))
    model = Model(d, [solid], supports=supports, surface=surface)
    result = follow(
        model,
        [Point(bore - INNER)],
        DisplacementControl((bore_dof,)),
        options=SHARP,
    )
    assert result.failure is None
    return result.solutions[0]


@cache
def _pressure_of_cylinder(n: int, family: str) -> float:
    mesh = ring(n, 2 * n, INNER, OUTER)
    if family == "triangles":
        mesh = curved_triangles(mesh)
    d = discretise(mesh, Kinematics.PLANE_STRAIN)
    supports = [Support.of(d, d.nodes_at(x=0.0), (0,)), Support.of(d, d.nodes_at(y=0.0), (1,))]
    corner = 2 * int(d.nodes_at(x=INNER, y=0.0)[0])
    return _inflated(d, supports, corner, CYLINDER["bore"]).pressure


@cache
def _pressure_of_tied_cylinder(n: int) -> float:
    """The cylinder of two parts that are tied at radius 15, the outer one half as fine again."""
    parts = [
        skfem.MeshQuad.init_tensor(
            np.linspace(low, low + 5.0, n // 2 + 1), np.linspace(0.0, np.pi / 2, around + 1)
        )
        for low, around in ((INNER, 2 * n), (15.0, 3 * n))
    ]
    count = parts[0].nvertices
    straight = skfem.MeshQuad(
        np.hstack([part.p for part in parts]), np.hstack((parts[0].t, parts[1].t + count))
    )
    curved = skfem.MeshQuad2.from_mesh(straight)
    radius, angle = curved.doflocs
    places = np.stack((radius * np.cos(angle), radius * np.sin(angle)))
    places[np.abs(places) < 1e-14] = 0.0
    facets = straight.boundary_facets()
    at = straight.p[0][straight.facets[:, facets]]
    bore = facets[(at == INNER).all(axis=0)]
    joint = facets[(at == 15.0).all(axis=0)]
    outer = straight.f2t[0, joint] >= parts[0].nelements
    mesh = skfem.MeshQuad2(places, curved.t).with_boundaries({"bore": bore})
    d = discretise(mesh, Kinematics.PLANE_STRAIN)
    tie = Tie(d, joint[outer], joint[~outer], penalty=100.0, tolerance=1e-8)
    supports = [Support.of(d, d.nodes_at(x=0.0), (0,)), Support.of(d, d.nodes_at(y=0.0), (1,))]
    corner = 2 * int(d.nodes_at(x=INNER, y=0.0)[0])
    model = Model(
        d,
        [Solid(d, RUBBER, QuadraticVolume(BULK))],
        supports=supports,
        surface=PressureSurface(d, d.facets_on("bore")),
        items=[tie],
    )
    control = DisplacementControl((corner,))
    result = settle(model, [Point(CYLINDER["bore"] - INNER)], [tie], control, options=SHARP)
    assert result.failure is None, result.failure
    return result.solutions[0].pressure


def test_a_cylinder_of_tied_parts_inflates_as_the_closed_form_says() -> None:
    reference = _closed_form(CYLINDER["bore"], 2)
    errors = [abs(_pressure_of_tied_cylinder(n) / reference - 1) for n in (2, 4, 8)]
    assert errors[-1] < 1e-4
    assert errors[1] < errors[0] / 4
    assert errors[2] < errors[1] / 4


@cache
def _pressure_of_sphere(n: int, family: str) -> float:
    mesh = ring(n, 2 * n, INNER, OUTER)
    if family == "triangles":
        mesh = curved_triangles(mesh)
    d = discretise(mesh, Kinematics.AXISYMMETRIC)
    supports = [Support.of(d, d.nodes_at(r=0.0), (0,)), Support.of(d, d.nodes_at(z=0.0), (1,))]
    corner = 2 * int(d.nodes_at(r=INNER, z=0.0)[0])
    return _inflated(d, supports, corner, SPHERE["bore"]).pressure


@pytest.mark.parametrize(
    ("solve", "exact", "exponent"),
    [(_pressure_of_cylinder, CYLINDER, 2), (_pressure_of_sphere, SPHERE, 3)],
)
@pytest.mark.parametrize(("family", "bound"), [("quads", 4e-5), ("triangles", 2e-4)])
def test_thick_walls_inflate_as_the_closed_form_says_at_third_order(
    solve, exact, exponent: int, family: str, bound: float
) -> None:
    reference = _closed_form(exact["bore"], exponent)
    errors = [abs(solve(n, family) / reference - 1) for n in (2, 4, 8)]
    assert errors[-1] < bound
    # quadratic displacements at a point converge at third order
    assert np.log2(errors[0] / errors[1]) > 2.3
    assert np.log2(errors[1] / errors[2]) > 2.6


def test_the_site_shows_how_thick_walls_converge(evidence) -> None:
    counts = (2, 4, 8)
    columns: dict[str, list[float]] = {"elements across the wall": list(counts)}
    for body, solve, exact, exponent in (
        ("cylinder", _pressure_of_cylinder, CYLINDER, 2),
        ("sphere", _pressure_of_sphere, SPHERE, 3),
    ):
        reference = _closed_form(exact["bore"], exponent)
        for family in ("quads", "triangles"):
            errors = [abs(solve(n, family) / reference - 1) for n in counts]
            columns[f"{body}, {family}"] = errors
    evidence(
        "thick-walls",
        "Finite elements: pressure of thick cylinders and spheres of rubber against closed forms",
        columns,
        plot="loglog",
        quantity="relative error",
        rel=0.05,
    )


def test_pressure_control_finds_the_bore_that_displacement_control_was_given() -> None:
    mesh = ring(4, 8, INNER, OUTER)
    d = discretise(mesh, Kinematics.PLANE_STRAIN)
    supports = [Support.of(d, d.nodes_at(x=0.0), (0,)), Support.of(d, d.nodes_at(y=0.0), (1,))]
    solid = Solid(d, RUBBER, QuadraticVolume(BULK))
    model = Model(d, [solid], supports=supports, surface=PressureSurface(d, d.facets_on("bore")))
    result = follow(model, [Point(p * CYLINDER["pressure"]) for p in (0.5, 1.0)])
    assert result.failure is None
    corner = 2 * int(d.nodes_at(x=INNER, y=0.0)[0])
    bore = INNER + result.solutions[-1].state.x[corner]
    assert bore == pytest.approx(CYLINDER["bore"], rel=2e-4)


@cache
def _cook(n: int, family: str, mixed: bool = True) -> float:
    """Rise of the tip's upper corner of Cook's membrane, nu 0.4999, in plane strain."""
    mesh = skfem.MeshQuad.init_tensor(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1))
    s, t = mesh.p
    places = np.stack((48 * s, (44 * s) + t * (44 - 28 * s)))
    mesh = skfem.MeshQuad(places, mesh.t)
    if family == "triangles":
        mesh = mesh.to_meshtri()
    d = discretise(mesh, Kinematics.PLANE_STRAIN, mixed=mixed)
    solid = Solid(d, NeoHookean(80.1938), QuadraticVolume(400889.806))
    right = mesh.facets_satisfying(lambda x: np.isclose(x[0], 48.0))
    load = traction(d, right, np.array([0.0, 100.0 / 16.0]))
    clamp = Support.of(d, d.nodes_at(x=0.0), (0, 1))
    model = Model(d, [solid], supports=[clamp], dead_load=load)
    result = follow(model, [Point(0.0)], options=SHARP)
    assert result.failure is None
    corner = int(d.nodes_at(x=48.0, y=60.0)[0])
    return float(result.solutions[0].state.x[2 * corner + 1])


def test_cooks_membrane_does_not_lock_and_both_elements_agree() -> None:
    quads = [_cook(n, "quads") for n in (2, 4, 8, 16)]
    triangles = [_cook(n, "triangles") for n in (2, 4, 8, 16)]
    assert quads[-1] == pytest.approx(triangles[-1], rel=1e-3)
    reference = (quads[-1] + triangles[-1]) / 2
    for found in (quads, triangles):
        errors = np.abs(np.array(found[:3]) / reference - 1)
        assert errors[0] < 0.04
        assert np.all(errors[1:] < 0.6 * errors[:-1])


@pytest.mark.parametrize("family", ["quads", "triangles"])
def test_without_pressures_the_same_elements_lock(family: str) -> None:
    alone = [_cook(n, family, mixed=False) for n in (2, 4, 8)]
    mixed = [_cook(n, family) for n in (2, 4, 8)]
    stiffer = 1 - np.array(alone) / np.array(mixed)
    assert stiffer[0] > 0.05
    assert np.all(np.diff(stiffer) < 0)


def _cantilever(length: float, height: float, along: int):
    mesh = skfem.MeshQuad.init_tensor(
        np.linspace(0, length, along + 1), np.linspace(-height / 2, height / 2, 2)
    )
    d = discretise(mesh, Kinematics.PLANE_STRAIN)
    mu, kappa = 1.0, 50.0
    nu = (3 * kappa - 2 * mu) / (2 * (3 * kappa + mu))
    flexural = 2 * mu * (1 + nu) / (1 - nu**2) * height**3 / 12
    solid = Solid(d, NeoHookean(mu), QuadraticVolume(kappa))
    tip = mesh.facets_satisfying(lambda x: np.isclose(x[0], length))
    return d, solid, flexural, tip


def _clamped_line(d):
    """The slope is held, the thickness free to change, as in beam theory."""
    return [
        Support.of(d, d.nodes_at(x=0.0), (0,)),
        Support.of(d, d.nodes_at(x=0.0, y=0.0), (1,)),
    ]


@cache
def _euler() -> tuple[float, float]:
    """Rise of a slender cantilever's tip under a small load: ours, Euler's."""
    length, height = 1.0, 0.02
    d, solid, flexural, tip = _cantilever(length, height, 20)
    force = 1e-4 * flexural / length**2
    load = traction(d, tip, np.array([0.0, force / height]))
    model = Model(d, [solid], supports=_clamped_line(d), dead_load=load)
    result = follow(model, [Point(0.0)])
    node = int(d.nodes_at(x=length, y=0.0)[0])
    rise = float(result.solutions[0].state.x[2 * node + 1])
    return rise, force * length**3 / (3 * flexural)


def test_a_slender_beam_bends_as_euler_says() -> None:
    rise, expected = _euler()
    # shear adds (h / L)^2 / 2 or so
    assert rise == pytest.approx(expected, rel=4e-4)


# dead tip load P L2 / (E I): tip deflection w / L and shortening u / L of the elastica
# (Bisshopp & Drucker, Q. Appl. Math. 3 (1945) 272; Mattiasson, IJNME 17 (1981) 145, Table 1)
ELASTICA = {1.0: (0.30172, 0.05643), 2.0: (0.49346, 0.16064), 10.0: (0.81061, 0.55500)}


@cache
def _elastica() -> dict[float, tuple[float, float]]:
    length, height = 1.0, 0.01
    d, solid, flexural, tip = _cantilever(length, height, 25)
    load = traction(d, tip, np.array([0.0, flexural / length**2 / height]))
    model = Model(d, [solid], supports=_clamped_line(d), dead_load=load)
    result = follow(model, [Point(0.0, dead=p) for p in ELASTICA])
    assert result.failure is None
    node = int(d.nodes_at(x=length, y=0.0)[0])
    moved = (solution.state.x[2 * node : 2 * node + 2] for solution in result.solutions)
    return {p: (u[1] / length, -u[0] / length) for p, u in zip(ELASTICA, moved, strict=True)}


def test_a_cantilever_follows_the_elastica_through_large_rotation() -> None:
    for load, expected in ELASTICA.items():
        assert _elastica()[load] == pytest.approx(expected, rel=1e-3)


def test_the_site_shows_the_elastica(evidence) -> None:
    ours = _elastica()
    evidence(
        "elastica",
        "Finite elements: a cantilever through large rotation against the elastica",
        {
            "load P L2/(E I)": list(ELASTICA),
            "deflection w/L, elastica": [w for w, _ in ELASTICA.values()],
            "deflection w/L, ours": [ours[p][0] for p in ELASTICA],
            "shortening u/L, elastica": [u for _, u in ELASTICA.values()],
            "shortening u/L, ours": [ours[p][1] for p in ELASTICA],
        },
        rel=1e-4,
    )


def _figures() -> dict[str, tuple[float, float, float | None]]:
    """By problem: reference, ours, and the order at which it converges where there is one."""
    found: dict[str, tuple[float, float, float | None]] = {}
    for body, solve, exact, exponent in (
        ("cylinder", _pressure_of_cylinder, CYLINDER, 2),
        ("sphere", _pressure_of_sphere, SPHERE, 3),
    ):
        for family in ("quads", "triangles"):
            reference = _closed_form(exact["bore"], exponent)
            coarse, fine = (solve(n, family) for n in (4, 8))
            order = np.log2(abs(coarse - reference) / abs(fine - reference))
            found[f"thick {body}, {family}, MPa"] = (reference, fine, float(order))
    reference = _closed_form(CYLINDER["bore"], 2)
    coarse, fine = (_pressure_of_tied_cylinder(n) for n in (4, 8))
    order = np.log2(abs(coarse - reference) / abs(fine - reference))
    found["thick cylinder of two tied parts, quads, MPa"] = (reference, fine, float(order))
    for family, other in (("quads", "triangles"), ("triangles", "quads")):
        steps = np.diff([_cook(n, family) for n in (4, 8, 16)])
        order = float(np.log2(steps[0] / steps[1]))
        found[f"Cook's membrane, {family}, mm"] = (_cook(16, other), _cook(16, family), order)
    rise, expected = _euler()
    found["slender cantilever, w / Euler's"] = (1.0, rise / expected, None)
    for load, (w, u) in ELASTICA.items():
        ours = _elastica()[load]
        found[f"elastica, P L²/EI = {load:g}, w/L"] = (w, ours[0], None)
        found[f"elastica, P L²/EI = {load:g}, u/L"] = (u, ours[1], None)
    return found


def test_the_table_in_the_docs_is_what_these_compute() -> None:
    page = Path(__file__).resolve().parents[2] / "docs" / "theory" / "finite-elements.md"
    lines = page.read_text(encoding="utf-8").split("| problem | reference | ours |", 1)[1]
    rows = [line.strip("| ").split(" | ") for line in lines.split("\n\n")[0].splitlines()[2:]]
    written = {row[0]: row[1:] for row in rows}
    figures = _figures()
    assert written.keys() == figures.keys()
    for problem, (reference, ours, order) in figures.items():
        cells = [cell.strip() for cell in [*written[problem], ""][:4]]
        # half a unit of the last digit written, and another for other processors' round-off
        assert float(cells[0]) == pytest.approx(reference, rel=1e-5), problem
        assert float(cells[1]) == pytest.approx(ours, rel=1e-5), problem
        error = 100 * abs(ours / reference - 1)
        assert float(cells[2].removesuffix(" %")) == pytest.approx(error, abs=1e-3), problem
        assert (cells[3] == "") == (order is None)
        if order is not None:
            assert float(cells[3]) == pytest.approx(order, abs=0.1), problem
