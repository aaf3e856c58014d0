"""CalculiX on the joint bellow's meridian, drawn until it flows: forces side by side.

Run `python -m tests.bench plasticity`; needs `ccx` (Debian: calculix-ccx). CalculiX has the
multiplicative J2 flow of Simo with another elastic law (neo-Hookean): a low yield stress keeps
elastic strains so small that the two are the same law. Its CAX8R have eight nodes and reduced
integration, ours nine and pressures of their own. Target: forces
within 0.5 % on the finer mesh.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from rig.mechanics.deck.elements import elements_of
from rig.mechanics.fe import Point, follow
from rig.mechanics.mesh.bellow_joint import JointResolution
from rig.mechanics.simulate.joint import JointModel, joint_model
from rig.spec.actuator import BellowJointGeometry
from rig.spec.material import MaterialSpec, PlasticitySpec
from rig.spec.workspace import Workspace, library_root

TARGET = 5e-3
BELLOWS, MOVED, STEPS = 2, 1.5e-3, 6
FLOW = PlasticitySpec(yield_stress="1 MPa", hardening_modulus="5 MPa", source="a benchmark's")
MEGAPASCAL, MM = 1e6, 1e3
SECTORS = 180
"""CalculiX turns axisymmetric elements into a wedge of two degrees, and tells its forces."""


def main() -> None:
    """Print the table."""
    program = shutil.which("ccx")
    if program is None:
        print("skipped: ccx is not installed (Debian: calculix-ccx)")
        return
    eva = Workspace(library_root(), is_library=True).material("eva-18")
    material = eva.model_copy(update={"plasticity": FLOW})
    geometry = BellowJointGeometry(family="bellow-joint", bellow_number=BELLOWS)
    head = "{:<12}{:>9}{:>10}{:>10}{:>8}{:>11}"
    print(head.format("elements", "moved mm", "ours N", "ccx N", "off %", "plastic %"))
    coarse, fine = JointResolution(wall=2, fifth=2), JointResolution(wall=4, fifth=4)
    for resolution in (coarse, fine):
        actuator = joint_model(geometry, material, resolution=resolution, moved=1.0)
        way = MOVED * np.arange(1, STEPS + 1) / STEPS
        result = follow(actuator.model, [Point(0.0, motion=u) for u in way])
        assert result.failure is None, result.failure
        d = actuator.model.discretisation
        top = d.dim * d.nodes_on("top") + 1
        theirs = calculix(program, actuator, material)
        for u, solution, other in zip(way, result.solutions, theirs, strict=True):
            ours = float(solution.residual[top].sum())
            history = solution.state.points[0].history
            assert history is not None
            off = 100 * (ours / other - 1)
            missed = resolution is fine and abs(off) > 100 * TARGET
            print(
                f"{len(d.connectivity):<12}{MM * u:>9.3f}{ours:>10.4f}{other:>10.4f}{off:>8.2f}"
                f"{100 * history[9].max():>11.2f}{'  missed' if missed else ''}"
            )


def calculix(program: str, actuator: JointModel, material: MaterialSpec) -> list[float]:
    """Force on the moved disc in N at every step."""
    with tempfile.TemporaryDirectory() as folder:
        deck = Path(folder) / "joint.inp"
        deck.write_text("\n".join(lines(actuator, material)) + "\n", encoding="ascii")
        subprocess.run(
            [program, "-i", "joint"],
            cwd=folder,
            check=True,
            capture_output=True,
            timeout=600,
            env={**os.environ, "OMP_NUM_THREADS": "1"},
        )
        text = (Path(folder) / "joint.dat").read_text(encoding="ascii")
    found = re.findall(r"total force.*TOP and time.*\n\n\s+(\S+)\s+(\S+)", text)
    return [SECTORS * float(along) for _, along in found]


def lines(actuator: JointModel, material: MaterialSpec) -> list[str]:
    """The meridian as CAX8R, axial direction y, in N and mm."""
    d = actuator.model.discretisation
    flow = material.plasticity
    assert flow is not None
    elements = elements_of(d).nodes
    used = np.unique(elements)
    hardened = (flow.yield_stress + flow.hardening_modulus) / MEGAPASCAL
    deck = ["*NODE, NSET=ALL"]
    deck += [f"{n + 1}, {MM * d.nodes[n, 0]:.12g}, {MM * d.nodes[n, 1]:.12g}" for n in used]
    deck.append("*ELEMENT, TYPE=CAX8R, ELSET=SOFT")
    deck += [f"{k + 1}, " + ", ".join(str(n + 1) for n in row) for k, row in enumerate(elements)]
    for name in ("clamped", "top", "axis"):
        deck.append(f"*NSET, NSET={name.upper()}")
        deck += [f"{n + 1}," for n in np.intersect1d(d.nodes_on(name), used)]
    return [
        *deck,
        "*MATERIAL, NAME=EVA",
        "*ELASTIC",
        f"{material.young_modulus.value / MEGAPASCAL:.12g}, {material.poisson_ratio.value:.12g}",
        "*PLASTIC",
        f"{flow.yield_stress / MEGAPASCAL:.12g}, 0.",
        f"{hardened:.12g}, 1.",
        "*SOLID SECTION, ELSET=SOFT, MATERIAL=EVA",
        "*BOUNDARY",
        "CLAMPED, 1, 2",
        "AXIS, 1, 1",
        "*STEP, NLGEOM=YES, INC=1000",
        "*STATIC, DIRECT",
        f"{1 / STEPS / 4:.12g}, 1.",
        "*BOUNDARY",
        f"TOP, 2, 2, {MM * MOVED:.12g}",
        "*NODE PRINT, NSET=TOP, TOTALS=ONLY, FREQUENCY=4",
        "RF",
        "*END STEP",
    ]
