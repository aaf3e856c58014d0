"""Slit shells of Agarwal et al.: bending, lengthening, stress of the shell, meshes, CalculiX.

Run `python -m tests.bench shells`, or `python -m tests.bench.bench_shells` and name some of the
tables: bending, linear, refinement, calculix.
"""

from __future__ import annotations

import re
import shutil
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rig.mechanics.deck.write import write_deck
from rig.mechanics.fe import Model, Point, Solution, follow
from rig.mechanics.fe.extremes import volume_percentile
from rig.mechanics.fe.fields import all_point_fields
from rig.mechanics.mesh.slit_shell import ShellResolution
from rig.mechanics.simulate.bending import FREE_OPTIONS, BendingModel
from rig.mechanics.simulate.linear import LinearModel
from rig.mechanics.simulate.shells import shell_bending_model, shell_linear_model
from rig.spec.material import MaterialSpec
from rig.spec.shells import ShellReinforcedBendingGeometry, ShellReinforcedLinearGeometry
from rig.spec.workspace import Workspace
from tests.bench.bench_calculix import run

BENDING_KPA = np.arange(0.0, 32.6, 2.5)
LINEAR_KPA = np.linspace(0.0, 50.0, 13)
LINEAR = ((13, 0.3), (21, 0.3), (7, 0.3), (13, 0.0))
"""Slits and friction."""
MESHES = {
    "as specimens": ShellResolution(ring=1, slit=1, around=6, wall=1),
    "as predictions": ShellResolution(),
    "12 around": ShellResolution(around=12),
    "3 along rings and slits": ShellResolution(ring=3, slit=3),
    "3 through the wall": ShellResolution(wall=3),
}
REFINED_KPA = {"bends": 10.0, "lengthens": 50 / 3}
STEPS = 4
SHORT = {"family": "shell-reinforced-linear", "slit_number": 1, "total_length": 8}
SHORT_KPA = 2.0


def main(wanted: Sequence[str] = ()) -> None:
    """Print the tables."""
    material = Workspace.find().material("ecoflex-00-30")
    tables = {
        "bending": bending,
        "linear": linear,
        "refinement": refinement,
        "calculix": calculix,
    }
    for name in wanted or tables:
        tables[name](material)


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


def refinement(material: MaterialSpec) -> None:
    """The default actuators on other meshes."""
    print("\nmesh                     elements       kPa  deg or mm   shell MPa (largest, 99.5 %)")
    for name, resolution in MESHES.items():
        for what, kpa in REFINED_KPA.items():
            start = time.process_time()
            actuator = _default(what, material, resolution)
            points = [Point(1e3 * p) for p in np.linspace(0.0, kpa, STEPS + 1)]
            options = FREE_OPTIONS if what == "bends" else None
            result = follow(actuator.model, points, options=options)
            if result.failure:
                print(f"{name}, {what}: {result.failure}")
                continue
            last = result.solutions[-1]
            measured = actuator.measures(last)
            moved = (
                np.degrees(measured["angle"]) if what == "bends" else 1e3 * measured["displacement"]
            )
            largest, most = stress(actuator.model, last)
            print(
                f"{name:<25}{len(actuator.model.discretisation.connectivity):8d}  {kpa:8.2f}  "
                f"{moved:9.3f}  {largest:9.1f} {most:9.2f}, "
                f"{time.process_time() - start:.0f} s of processor"
            )


def _default(
    what: str, material: MaterialSpec, resolution: ShellResolution
) -> BendingModel | LinearModel:
    if what == "bends":
        bends = ShellReinforcedBendingGeometry(family="shell-reinforced-bending")
        return shell_bending_model(bends, material, resolution=resolution)
    lengthens = ShellReinforcedLinearGeometry(family="shell-reinforced-linear")
    return shell_linear_model(lengthens, material, resolution=resolution)


def calculix(material: MaterialSpec) -> None:
    """Exported decks of a short actuator with one slit: elongation since rest.

    Ours presses core and shell together by 1 kPa at rest, theirs does not.
    """
    if shutil.which("ccx") is None:
        print("\nskipped: CalculiX is not installed (`apt-get install calculix-ccx`)")
        return
    print("\nfriction   kPa   ours um    ccx um   difference")
    pressures = np.linspace(0.0, SHORT_KPA, STEPS + 1)
    for friction in (0.0, 0.3):
        geometry = ShellReinforcedLinearGeometry.model_validate({**SHORT, "friction": friction})
        actuator = shell_linear_model(geometry, material, resolution=MESHES["as specimens"])
        result = follow(actuator.model, [Point(1e3 * p) for p in pressures])
        ours = [1e6 * actuator.measures(s)["displacement"] for s in result.solutions]
        with tempfile.TemporaryDirectory() as folder:
            deck = Path(folder) / "shell.inp"
            write_deck(deck, actuator, pressure=1e3 * SHORT_KPA, increments=STEPS)
            run("shell", folder)
            printed = deck.with_suffix(".dat").read_text(encoding="ascii")
        rows = re.findall(r"set CAP_REFERENCE and time +\S+\n\n +\d+ +(\S+)", printed)
        for kpa, grown, row in zip(pressures[1:], ours[1:], rows, strict=True):
            a, b = grown - ours[0], 1e3 * float(row)
            print(f"{friction:8.1f} {kpa:5.2f} {a:9.3f} {b:9.3f} {100 * (b / a - 1):+10.2f} %")


def stress(model: Model, solution: Solution) -> tuple[float, float]:
    """Von Mises stress in the shell in MPa: the largest at a quadrature point, and what 99.5 % of
    its volume stays below."""
    fields = all_point_fields(model, solution.state)[1]
    values, volumes = fields.von_mises.reshape(-1), fields.weights.reshape(-1)
    return values.max() / 1e6, volume_percentile(values, volumes, 0.995) / 1e6


if __name__ == "__main__":
    main(sys.argv[1:])
