"""The picture shows everything, where it really is, at the angle it really has."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import cv2
import numpy as np
import pytest
from scenes import CAMERA, GEOMETRY, RULER, camera
from scipy.ndimage import map_coordinates

from rig.mechanics.profile import side_profile
from rig.plant import scene
from rig.plant.camera import _BAR, _BAR_COLOUR
from rig.plant.errors import SceneError
from rig.plant.layout import mark_centres, ruler_outline
from rig.plant.scene import Scene, Surface, densified

ANGLES_DEG = [-10.0, 0.0, 31.0, 64.0, 90.0, 127.0, 150.0]
EDGE_TOLERANCE = 0.02  # pixels


@pytest.fixture(scope="module")
def quiet():
    """A camera with lens, tilt, blur and light gradient, but without noise."""
    return camera(noise=0.0)


def light(picture):
    """Linear light of 8-bit grey levels, 0..1."""
    return (picture / 255.0) ** 2


def on_the_plane(seen, pixels):
    """Bench coordinates of pixels, by OpenCV's undistortion and a ray through the plane."""
    (focal_x, focal_y), (x, y) = seen.projection.focal, seen.projection.centre
    matrix = np.array([[focal_x, 0, x], [0, focal_y, y], [0, 0, 1]])
    distortion = np.array(seen.projection.distortion)
    rays = cv2.undistortPoints(pixels.reshape(-1, 1, 2), matrix, distortion)[:, 0]
    rotation = np.array(seen.projection.rotation)
    plane_to_rays = np.column_stack(
        (rotation[:, 0], rotation[:, 1], [0.0, 0.0, seen.projection.distance])
    )
    bench = np.linalg.solve(plane_to_rays, np.column_stack((rays, np.ones(len(rays)))).T)
    return (bench[:2] / bench[2]).T


def edge_errors(picture, start, stop, inside, channel, samples=60):
    """Distance of the rendered edge from start..stop (pixels) along its normal, per sample.

    `inside` points from the edge into the bright part. The edge is where light summed across it
    says that the bright part begins; sampled by linear interpolation of linear light.
    """
    plane = light(picture[..., channel])
    reach, step = 5.0, 0.05
    across = np.arange(-reach, reach + step / 2, step)
    share = np.linspace(0, 1, samples)[:, None]
    centres = start + share * (stop - start)
    normal = inside / np.hypot(*inside)
    places = centres[:, None, :] + across[None, :, None] * normal
    values = map_coordinates(plane, [places[..., 1], places[..., 0]], order=1)
    end = int(1.5 / step)
    dark, bright = values[:, :end].mean(axis=1), values[:, -end:].mean(axis=1)
    share_lit = (values - dark[:, None]) / (bright - dark)[:, None]
    lit = np.trapezoid(share_lit, dx=step, axis=1)
    return reach - lit


def straight_edges(seen, angle):
    """Ends (pixels), inward direction and name of outer edges before the dark background."""
    shape = side_profile(GEOMETRY, angle)
    place, project = seen.layout.place, seen.projection.project
    cap, connector = project(place(shape.end_cap)), project(place(shape.connector))
    ruler = project(ruler_outline(seen.layout.ruler_corner, RULER))
    far = sorted(range(4), key=lambda i: np.hypot(*(shape.end_cap[i] - (-0.02, 0))))[-2:]
    yield cap[far[0]], cap[far[1]], cap.mean(axis=0) - cap[far].mean(axis=0), 0, "cap, far face"
    left = np.argsort(connector[:, 0])
    for name, side in (("connector, left", left[:2]), ("connector, right", left[2:])):
        inward = connector.mean(axis=0) - connector[side].mean(axis=0)
        yield connector[side[0]], connector[side[1]], inward, 0, name
    yield ruler[0], ruler[1], ruler[3] - ruler[0], 1, "ruler, left"
    yield ruler[5], ruler[0], ruler[4] - ruler[5], 1, "ruler, bottom"


@pytest.mark.parametrize("angle_deg", [0.0, 38.0, 90.0, 150.0])
@pytest.mark.parametrize("seed", [1, 2])
def test_rendered_edges_lie_where_the_lens_puts_them(seed, angle_deg, monkeypatch):
    """In linear light the bias of every straight edge is below a fiftieth of a pixel.

    Lens and perspective bend long edges: points between their ends are projected, too. The
    background is plain, since its threads would shift single edges by a few hundredths.
    """
    monkeypatch.setattr(
        scene, "_cloth", lambda width, height, rng: np.ones((height, width), np.float32)
    )
    seen = camera(seed, noise=0.0)
    angle = np.deg2rad(angle_deg)
    picture = seen.render(angle, 0.0)
    for start, stop, inside, channel, name in straight_edges(seen, angle):
        ends = on_the_plane(seen, np.array([start, stop]))
        pieces = ends[0] + np.linspace(0.08, 0.92, 9)[:, None] * (ends[1] - ends[0])
        pixels = seen.projection.project(pieces)
        errors = np.concatenate(
            [
                edge_errors(picture, a, b, normal_towards(b - a, inside), channel)
                for a, b in pairwise(pixels)
            ]
        )
        assert abs(errors.mean()) < EDGE_TOLERANCE, (name, errors.mean())


def normal_towards(edge, inside):
    normal = np.array([-edge[1], edge[0]])
    return normal * np.sign(normal @ inside)


@pytest.mark.parametrize("angle_deg", ANGLES_DEG)
def test_the_end_cap_is_turned_by_the_bending_angle(quiet, angle_deg):
    """Measured from moments of a picture that shows nothing but the cap, mapped to the plane."""
    angle = np.deg2rad(angle_deg)
    shape = side_profile(GEOMETRY, angle)
    only_cap = replace(shape, bellow=shape.connector, bottom_layer=shape.connector)
    nothing = replace(only_cap, end_cap=shape.connector)
    blue = light(quiet._scene.picture(only_cap)[..., 0])
    blue -= light(quiet._scene.picture(nothing)[..., 0])
    rows, columns = np.nonzero(blue > 0.002)
    weight = blue[rows, columns]
    points = on_the_plane(quiet, np.column_stack((columns, rows)).astype(float))
    points -= np.average(points, axis=0, weights=weight)
    spread = (weight[:, None] * points).T @ points
    long_axis = np.linalg.eigh(spread)[1][:, 1]
    # Unbent, the cap's long axis is horizontal; bending turns it clockwise (curling left and up).
    turned = np.degrees(np.arctan2(long_axis[1], long_axis[0]))
    error = (turned - angle_deg + 90) % 180 - 90
    assert abs(error) < 0.03


def test_the_marks_are_where_the_ruler_has_them(quiet):
    picture = light(quiet.render(0.0, 0.0)[..., 1])
    layout = quiet.layout
    centres = quiet.projection.project(mark_centres(layout.ruler_corner, RULER, layout.ruler_lean))
    assert len(centres) == 2 * RULER.marks + 1
    for x, y in centres:
        column, row = round(x), round(y)
        window = picture[row - 16 : row + 17, column - 16 : column + 17]
        dark = np.clip(window[0].mean() - window, 0, None)
        dark[dark < 0.03] = 0
        offsets = np.arange(-16, 17)
        seen_x = column + (dark.sum(axis=0) @ offsets) / dark.sum()
        seen_y = row + (dark.sum(axis=1) @ offsets) / dark.sum()
        assert np.hypot(seen_x - x, seen_y - y) < EDGE_TOLERANCE


def test_a_crooked_ruler_has_its_upright_marks_towards_the_other_leg():
    crooked = camera(3, ruler_squareness=np.radians(1.0)).layout
    assert crooked.ruler_lean == pytest.approx(50 * camera(3).layout.ruler_lean)
    marks = mark_centres(crooked.ruler_corner, RULER, crooked.ruler_lean)
    up, right = marks[RULER.marks] - marks[0], marks[-1] - marks[0]
    between = np.arccos(up @ right / np.linalg.norm(up) / np.linalg.norm(right))
    assert between == pytest.approx(np.pi / 2 - crooked.ruler_lean, abs=1e-6)


@pytest.mark.parametrize("seed", range(6))
def test_the_whole_actuator_is_seen_from_minus_10_to_150_degrees_beside_the_ruler(seed):
    seen = camera(seed, noise=0.0)
    still = seen._scene._still
    ruler = seen.projection.project(ruler_outline(seen.layout.ruler_corner, RULER))
    for angle_deg in np.arange(-10.0, 151.0, 20.0):
        picture = seen.render(np.deg2rad(angle_deg), 0.0)
        rows, columns = np.nonzero((picture != still).any(axis=2))
        assert columns.min() > 10
        assert rows.max() < CAMERA.height - 10
        assert columns.max() < ruler[:, 0].min() - 5


def test_the_tip_swings_left_and_up(quiet):
    caps = [
        quiet.layout.place(side_profile(GEOMETRY, np.deg2rad(a)).end_cap).mean(axis=0)
        for a in (0.0, 45.0, 90.0)
    ]
    assert caps[0][0] > caps[1][0] > caps[2][0]
    assert caps[0][1] > caps[1][1] > caps[2][1]


def test_colours_tell_the_parts_apart(quiet):
    angle = np.deg2rad(60)
    picture = quiet.render(angle, 0.0).astype(int)
    shape = side_profile(GEOMETRY, angle)
    place, project = quiet.layout.place, quiet.projection.project

    def colour(point):
        x, y = np.rint(project(point[None])[0]).astype(int)
        return picture[y, x]

    for rigid in (shape.connector, shape.end_cap):
        blue, green, red = colour(place(rigid).mean(axis=0))
        assert blue > 2.2 * green > 4 * red
    soft = 0.5 * (place(shape.end_cap).mean(axis=0) + place(shape.connector).mean(axis=0))
    corner = np.array(quiet.layout.ruler_corner)
    white = colour(corner + np.array((0.005, 0.0)))
    assert white.min() > 190
    assert np.ptp(white) < 15
    assert colour(corner).max() < 60
    assert colour(soft).max() < 90  # inside the curl there is only the background
    middle = place(shape.bellow).mean(axis=0)
    blue, _, red = colour(middle)
    assert red > 140
    assert red > blue + 25


def test_what_adjoins_leaves_no_gap(quiet):
    """Between the connector and the soft end wall no background shines through."""
    shape = side_profile(GEOMETRY, 0.0)
    joint = quiet.projection.project(quiet.layout.place(shape.connector))
    row = round(float(np.sort(joint[:, 1])[-1]))
    column = round(float(joint[:, 0].mean()))
    across = quiet.render(0.0, 0.0)[row - 6 : row + 7, column].astype(int)
    darkest = across.max(axis=1).min()
    assert darkest > 150


def test_the_grey_bar_hides_the_cap_and_nothing_else_moves(quiet):
    profile = side_profile(GEOMETRY, 0.8)
    bar = quiet.layout.place(profile.end_cap).mean(axis=0) + _BAR
    free = quiet._scene.picture(profile)
    hidden = quiet._scene.picture(profile, [Surface(bar, _BAR_COLOUR)])
    cap = quiet.projection.project(quiet.layout.place(profile.end_cap))
    columns, rows = np.rint(densified(cap, 4.0)).astype(int).T
    colours = hidden[rows, columns].astype(int)
    assert np.ptp(colours, axis=1).max() < 12
    changed = np.argwhere(np.abs(free.astype(int) - hidden).max(axis=2) > 1)
    assert np.abs(changed[:, ::-1] - cap.mean(axis=0)).max() < 150


def test_light_falls_off_across_the_picture_as_asked():
    """The white ruler stays; only its brightness changes, by less than the gradient."""
    even, uneven = (camera(3, noise=0.0, light_gradient=g).render(0, 0) for g in (0.0, 0.4))
    seen = camera(3, noise=0.0)
    corner = np.array(seen.layout.ruler_corner)
    places = seen.projection.project(corner + np.array([(0.005, 0.0), (0.065, 0.0), (0.0, -0.065)]))
    columns, rows = np.rint(places).astype(int).T
    ratio = light(uneven[rows, columns, 1]) / light(even[rows, columns, 1])
    assert ratio.min() > 0.75
    assert ratio.max() < 1.25
    assert np.ptp(ratio) > 0.05


def test_an_actuator_that_swings_out_of_the_picture_is_cut_off(quiet):
    profile = side_profile(GEOMETRY, 1.0)
    for shift in ((0.0, -0.1), (0.06, 0.0), (0.3, 0.3)):
        moved = replace(
            profile,
            bellow=profile.bellow + shift,
            bottom_layer=profile.bottom_layer + shift,
            end_cap=profile.end_cap + shift,
        )
        assert quiet._scene.picture(moved).shape == (CAMERA.height, CAMERA.width, 3)


def test_a_camera_too_close_is_refused_with_what_to_do():
    with pytest.raises(SceneError, match=r"does not see all of .*Increase 'virtual.optics.dist"):
        camera(distance=0.2)


def test_a_ruler_too_long_is_refused_with_what_to_do():
    with pytest.raises(SceneError, match=r"ruler"):
        camera(ruler=RULER.model_copy(update={"marks": 11}))


def test_still_parts_are_drawn_once(quiet):
    assert isinstance(quiet._scene, Scene)
    first = quiet._scene._still.copy()
    quiet.render(1.2, 0.0)
    np.testing.assert_array_equal(first, quiet._scene._still)
