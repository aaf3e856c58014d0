"""CalculiX on the same tetrahedra, material and loads: angles side by side, seconds of processor.

Run `python -m tests.bench calculix`; needs `ccx` (Debian: calculix-ccx) and netgen; five minutes of
processor or so, nearly all of them CalculiX's. Its C3D10 has displacements alone and four points of
integration, so ours is given the same; what the mixed default mesh says stands below. Target: the
angles within 0.05 %.
"""

from __future__ import annotations

import importlib.util
import os
import re
import resource
import shutil
import subprocess
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydantic import TypeAdapter

from rig.mechanics.deck.write import write_deck
from rig.mechanics.fe import Point, follow
from rig.mechanics.mesh.bellow_axisymmetric import AxisymmetricResolution
from rig.mechanics.mesh.bellow_joint import JointResolution
from rig.mechanics.mesh.bellow_tetrahedra import mesh_bending_bellow_tetrahedra
from rig.mechanics.simulate.axisymmetric import axisymmetric_model
from rig.mechanics.simulate.bending import BendingModel, bending_model, bending_model_on
from rig.mechanics.simulate.joint import JointModel, joint_model
from rig.spec.actuator import (
    BellowAxisymmetricGeometry,
    BellowBendingGeometry,
    BellowJointGeometry,
)
from rig.spec.hyperelastic import HyperelasticSpec
from rig.spec.material import MaterialSpec
from rig.spec.workspace import Workspace, library_root

TARGET = 5e-4
LIMIT_S = 3600.0
INCREMENTS = 4
SOURCE = "a benchmark's"
ENERGIES = {
    "neo-Hookean": None,
    "Mooney-Rivlin, 2": {"energy": "mooney-rivlin", "c10": "60 kPa", "c01": "15 kPa"},
    "Mooney-Rivlin, 5": {
        "energy": "mooney-rivlin",
        **{"c10": "60 kPa", "c01": "15 kPa", "c11": "4 kPa", "c20": "6 kPa", "c02": "2 kPa"},
    },
    "Yeoh": {"energy": "yeoh", "c10": "75 kPa", "c20": "-8 kPa", "c30": "3 kPa"},
    "Ogden, 2": {
        "energy": "ogden",
        "convention": "abaqus",
        "terms": [{"mu": "100 kPa", "alpha": 3.0}, {"mu": "50 kPa", "alpha": -2.0}],
    },
    "Arruda-Boyce": {
        "energy": "arruda-boyce",
        **{"modulus": "140 kPa", "locking_stretch": 2.0},
        "volume": {"function": "logarithmic", "bulk_modulus": "7.5 MPa", "source": SOURCE},
    },
}


@dataclass(frozen=True)
class Outcome:
    """Angles in deg: by weight alone, then at equal steps of pressure."""

    angles: tuple[float, ...]
    seconds: float
    """Of processor."""


def main() -> None:
    """Print the tables."""
    why = missing()
    if why:
        print(f"skipped: {why}")
        return
    setup = Workspace.find().setup("bellow-bending")
    material, full = setup.material, setup.actuator.geometry
    short = full.model_copy(
        update={"bellow_number": 1, "effective_length": full.effective_length / full.bellow_number}
    )
    head = "{:<24}{:>10}{:>8}{:>12}{:>12}{:>12}{:>9}{:>9}{:>8}"
    print(
        head.format(
            *("case", "tetrahedra", "kPa", "ours deg", "ccx deg", "difference"),
            *("ours s", "ccx s", "ratio"),
        )
    )
    for name, geometry, size, pressure in (
        ("one convolution", short, 2.5e-3, 2e3),
        ("default actuator", full, 3e-3, 1e3),
    ):
        body = mesh_bending_bellow_tetrahedra(geometry, size)
        ours, model = solved(
            lambda b=body: bending_model_on(b, material, mixed=False, order=2), pressure
        )
        theirs = calculix(model, pressure)
        for step, (a, b) in enumerate(zip(ours.angles, theirs.angles, strict=True)):
            row = [name, body.mesh.nelements, f"{pressure * step / INCREMENTS / 1e3:.2f}"]
            row += [f"{a:.4f}", f"{b:.4f}", _difference(a, b)]
            row += ["", "", ""]
            if step == INCREMENTS:
                row[6:] = [f"{ours.seconds:.1f}", f"{theirs.seconds:.1f}"]
                row.append(f"{theirs.seconds / ours.seconds:.1f}")
            print(head.format(*row))
        mixed, model = solved(lambda g=geometry: bending_model(g, material), pressure)
        count = len(model.soft.elements)
        print(f"  {count} mixed hexahedra: {mixed.angles[-1]:.4f} deg in {mixed.seconds:.1f} s")
    _energies(short, material)
    _of_revolution()


def _energies(geometry: BellowBendingGeometry, material: MaterialSpec) -> None:
    print("\nenergies, one convolution at 1 kPa")
    body = mesh_bending_bellow_tetrahedra(geometry, 4e-3)
    for name, section in ENERGIES.items():
        spec = material
        if section is not None:
            energy = TypeAdapter(HyperelasticSpec).validate_python({**section, "source": SOURCE})
            spec = material.model_copy(update={"hyperelastic": energy})
        ours, model = solved(lambda s=spec: bending_model_on(body, s, mixed=False, order=2), 1e3)
        theirs = calculix(model, 1e3)
        a, b = ours.angles[-1], theirs.angles[-1]
        print(f"{name:<24}{a:>12.4f}{b:>12.4f}{_difference(a, b):>12}")


def _of_revolution() -> None:
    """Exported meridians: CalculiX has eight nodes an element and no pressures of their own."""
    print("\nbodies of revolution, rise of the top in mm")
    library = Workspace(library_root(), is_library=True)
    folded = BellowJointGeometry(family="bellow-joint", bellow_number=2)
    cusped = BellowAxisymmetricGeometry(family="bellow-axisymmetric")
    eva, silicone = library.material("eva-18"), library.material("dragon-skin-30")
    cases = [
        ("joint, elastic-plastic, 54 kPa", 54e3, joint_model(folded, eva, resolution=n))
        for n in (JointResolution(), JointResolution(wall=4, fifth=6))
    ]
    cases += [
        (
            f"axisymmetric, 2 kPa, level {level}",
            2e3,
            axisymmetric_model(cusped, silicone, resolution=AxisymmetricResolution.level(level)),
        )
        for level in (1, 2, 3)
    ]
    for name, pressure, model in cases:
        result = follow(model.model, [Point(pressure / 2), Point(pressure)])
        ours = 1e3 * model.measures(result.solutions[-1])["displacement"]
        d = model.model.discretisation
        node = model.top if isinstance(model, JointModel) else model.top_centre
        with tempfile.TemporaryDirectory() as folder:
            write_deck(Path(folder) / "body.inp", model, pressure=pressure, increments=2)
            run("body", folder)
            printed = (Path(folder) / "body.dat").read_text(encoding="ascii")
        theirs = float(re.findall(rf"^ +{node + 1} +\S+ +(\S+)", printed, re.MULTILINE)[-1])
        print(
            f"{name:<34}{len(d.connectivity):>8}{ours:>12.4f}{theirs:>12.4f}"
            f"{100 * (theirs / ours - 1):>+9.2f} %"
        )


def missing() -> str | None:
    """What is not installed."""
    if shutil.which("ccx") is None:
        return "CalculiX is not installed (`apt-get install calculix-ccx`)"
    if importlib.util.find_spec("netgen") is None:
        return "netgen is not installed (`pip install 'rig[cad]'`)"
    return None


def solved(build, pressure: float) -> tuple[Outcome, BendingModel]:
    """Ours, from the mesh on."""
    start = time.process_time()
    model = build()
    result = follow(model.model, [Point(pressure * i / INCREMENTS) for i in range(INCREMENTS + 1)])
    seconds = time.process_time() - start
    if result.failure is not None:
        raise RuntimeError(result.failure)
    angles = (np.degrees(model.angle(s.state)) for s in result.solutions)
    return Outcome(tuple(map(float, angles)), seconds), model


def calculix(model: BendingModel, pressure: float) -> Outcome:
    """CalculiX, on one thread, from reading its deck on."""
    with tempfile.TemporaryDirectory() as folder:
        write_deck(Path(folder) / "bellow.inp", model, pressure=pressure, increments=INCREMENTS)
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        ended = run("bellow", folder)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        printed = (Path(folder) / "bellow.dat").read_text(encoding="ascii")
    turns = {
        float(time): float(row.split()[2])
        for time, row in re.findall(r"set CAP_ROTATION and time +(\S+)\n\n(.*)\n", printed)
    }
    wanted = [1 + i / INCREMENTS for i in range(INCREMENTS + 1)]
    found = [next((a for t, a in turns.items() if abs(t - at) < 1e-6), None) for at in wanted]
    if None in found:
        raise RuntimeError(f"CalculiX did not get there:\n{ended.stdout[-2000:]}")
    seconds = (after.ru_utime + after.ru_stime) - (before.ru_utime + before.ru_stime)
    return Outcome(tuple(float(np.degrees(a)) for a in found), seconds)


def run(name: str, folder: str) -> subprocess.CompletedProcess[str]:
    """CalculiX on the deck `name` in a folder, on one thread."""
    return subprocess.run(
        ["ccx", name],
        cwd=folder,
        env={**os.environ, "OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        timeout=LIMIT_S,
        check=False,
    )


def _difference(ours: float, theirs: float) -> str:
    relative = theirs / ours - 1
    return f"{100 * relative:+.4f} %" + ("" if abs(relative) <= TARGET else " !")


if __name__ == "__main__":
    main()
