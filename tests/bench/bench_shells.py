"""Slit shells of Agarwal et al.: bending, lengthening, stress of the shell against its slits."""

from __future__ import annotations

import time

import numpy as np

from rig.mechanics.fe import Model, Point, Solution, follow
from rig.mechanics.fe.extremes import volume_percentile
from rig.mechanics.fe.fields import all_point_fields
from rig.mechanics.mesh.slit_shell import ShellResolution
from rig.mechanics.simulate.bending import FREE_OPTIONS
from rig.mechanics.simulate.shells import shell_bending_model, shell_linear_model
from rig.spec.material import MaterialSpec
from rig.spec.shells import ShellReinforcedBendingGeometry, ShellReinforcedLinearGeometry
from rig.spec.workspace import Workspace

BENDING_KPA = np.arange(0.0, 32.6, 2.5)
LINEAR_KPA = np.linspace(0.0, 50.0, 13)
LINEAR = ((13, 0.3), (21, 0.3), (7, 0.3), (13, 0.0))
"""Slits and friction."""


def main() -> None:
    """Print both tables."""
    material = Workspace.find().material("ecoflex-00-30")
    bending(material)
    linear(material)


def bending(material: MaterialSpec) -> None:
    """The default actuator that bends."""
    start = time.process_time()
    geometry = ShellReinforcedBendingGeometry(family="shell-reinforced-bending")
    actuator = shell_bending_model(geometry, material, resolution=ShellResolution())
    result = follow(actuator.model, [Point(1e3 * p) for p in BENDING_KPA], options=FREE_OPTIONS)
    print("kPa     deg      mL   shell MPa (largest, 99.5 %)   deepest um")
    for s in result.solutions:
        felt = actuator.model.interfaces[0].grip(s.state.x, s.state.memories[0])
        largest, most = stress(actuator.model, s)
        print(
            f"{s.pressure / 1e3:5.2f} {np.degrees(actuator.angle(s.state)):7.2f} "
            f"{1e6 * actuator.volume(s):7.4f} {largest:9.1f} {most:9.2f} "
            f"{-1e6 * np.nanmin(felt.gap):12.1f}"
        )
    print(f"{result.failure or 'finished'}; {time.process_time() - start:.0f} s of processor\n")


def linear(material: MaterialSpec) -> None:
    """Actuators that lengthen, with more and fewer slits, with and without friction."""
    print("slits  friction  kPa      mm   shell MPa (largest, 99.5 %)  MPa/mm")
    for slits, friction in LINEAR:
        start = time.process_time()
        geometry = ShellReinforcedLinearGeometry(
            family="shell-reinforced-linear", slit_number=slits, friction=friction
        )
        actuator = shell_linear_model(geometry, material, resolution=ShellResolution())
        result = follow(actuator.model, [Point(1e3 * p) for p in LINEAR_KPA])
        for s in result.solutions[4::4]:
            largest, most = stress(actuator.model, s)
            stroke = 1e3 * actuator.measures(s)["displacement"]
            print(
                f"{slits:5d} {friction:8.1f} {s.pressure / 1e3:6.2f} {stroke:7.3f} "
                f"{largest:9.1f} {most:9.2f} {most / stroke:12.2f}"
            )
        print(f"{result.failure or 'finished'}; {time.process_time() - start:.0f} s of processor")


def stress(model: Model, solution: Solution) -> tuple[float, float]:
    """Von Mises stress in the shell in MPa: the largest at a quadrature point, and what 99.5 % of
    its volume stays below."""
    fields = all_point_fields(model, solution.state)[1]
    values, volumes = fields.von_mises.reshape(-1), fields.weights.reshape(-1)
    return values.max() / 1e6, volume_percentile(values, volumes, 0.995) / 1e6
