"""A bellow drawn on a circular arc: a side profile for tests of the camera alone."""

from __future__ import annotations

import numpy as np

from rig.mechanics.response import SideProfile
from rig.spec.actuator import BellowBendingGeometry


def bent_profile(geometry: BellowBendingGeometry, angle: float) -> SideProfile:
    """The soft part bends as a circular arc about its axis; rigid parts stay rectangles."""
    length, t = geometry.effective_length, geometry.wall_thickness
    rm = geometry.average_radius
    ri = geometry.radius_ratio * rm
    ro = 2 * rm - ri
    s = np.linspace(-t, length + t, 400)
    crest = (
        ri
        + t
        + (ro - ri)
        * 0.5
        * (1 - np.cos(2 * np.pi * np.clip(s, 0, length) * geometry.bellow_number / length))
    )
    curvature = angle / (length + 2 * t)

    def bend(x, z):
        turn = curvature * (x + t)
        if abs(curvature) < 1e-9:
            return np.column_stack((x, z))
        return np.column_stack(
            (
                -t + np.sin(turn) / curvature + z * np.sin(turn),
                -(1 - np.cos(turn)) / curvature + z * np.cos(turn),
            )
        )

    low, high = -ro - 2 * t, ri + t
    floor = np.full_like(s, -ro)
    tip = np.array([length + t, length + t, length + 2 * t, length + 2 * t])
    heights = np.array([low, high, high, low])
    end = bend(np.array([length + t]), np.array([0.0]))[0]
    turn = curvature * (length + 2 * t)
    along = np.array([np.cos(turn), -np.sin(turn)])
    across = np.array([np.sin(turn), np.cos(turn)])
    cap = end + np.outer(tip - (length + t), along) + np.outer(heights, across)
    tf = geometry.frame_connector_thickness
    connector = np.array([(-t - tf, -13.5e-3), (-t, -13.5e-3), (-t, 8.5e-3), (-t - tf, 8.5e-3)])
    return SideProfile(
        connector=connector,
        bellow=np.concatenate((bend(s, crest), bend(s[::-1], floor))),
        bottom_layer=np.concatenate((bend(s, floor), bend(s[::-1], np.full_like(s, low)))),
        end_cap=cap,
    )
