"""Auysakul et al., Tables 2 and 5, under dead and follower pressure side by side.

Run `python -m tests.bench axisymmetric`. Target: 60 s for the 13 designs of Table 2 on two cores.
"""

from __future__ import annotations

import time

import numpy as np

from rig.mechanics.mesh.bellow_axisymmetric import AxisymmetricResolution
from rig.spec.actuator import BellowAxisymmetricGeometry
from tests.mechanics.auysakul import FOLDER, PRESSURES, displacements, table_2, table_5

TARGET_S = 60.0
LEVEL = 2


def main() -> None:
    """Print both tables and what refinement does."""
    if not FOLDER.exists():
        print(f"the published tables are not here: {FOLDER}")
        return
    print_table_2()
    print_table_5()
    print_refinement()


def print_table_2() -> None:
    """Displacement in mm at 50 kPa of all designs, with error and time."""
    designs = table_2()
    published = np.array([d.displacement for d in designs])
    ours, seconds = {}, {}
    for follower in (False, True):
        start = time.perf_counter()
        ours[follower] = np.array(
            [displacements(d.geometry, follower=follower, level=LEVEL)[-1] for d in designs]
        )
        seconds[follower] = time.perf_counter() - start
    print(f"{'Table 2, mm at 50 kPa':<24}{'paper':>9}{'dead':>9}{'follower':>10}")
    for design, paper, dead, follower in zip(
        designs, published, ours[False], ours[True], strict=True
    ):
        print(f"{design.name:<24}{paper:9.2f}{dead:9.3f}{follower:10.3f}")
    errors = {key: np.sqrt(np.mean((values - published) ** 2)) for key, values in ours.items()}
    print(f"{'RMSE':<33}{errors[False]:9.3f}{errors[True]:10.3f}")
    print(f"{f'seconds (target {TARGET_S:.0f})':<33}{seconds[False]:9.1f}{seconds[True]:10.1f}")


def print_table_5() -> None:
    """Displacement in mm of the optimised design over pressure, beside the measured one."""
    measured, simulated = table_5()
    geometry = BellowAxisymmetricGeometry(family="bellow-axisymmetric")
    dead, follower = (
        displacements(geometry, follower=kind, pressures=PRESSURES, level=LEVEL)
        for kind in (False, True)
    )
    print(f"\n{'Table 5, kPa':<15}{'measured':>10}{'paper FE':>10}{'dead':>9}{'follower':>10}")
    for row in zip(PRESSURES / 1e3, measured, simulated, dead, follower, strict=True):
        print("{:<15.0f}{:10.2f}{:10.2f}{:9.3f}{:10.3f}".format(*row))
    rmse = [np.sqrt(np.mean((v - measured) ** 2)) for v in (simulated, dead, follower)]
    print("{:<25}{:10.2f}{:9.3f}{:10.3f}".format("RMSE to measured", *rmse))


def print_refinement() -> None:
    """Displacement in mm at 50 kPa of the optimised design on finer and finer meshes."""
    geometry = BellowAxisymmetricGeometry(family="bellow-axisymmetric")
    print(f"\n{'mesh, through wall x half arc':<33}{'dead':>9}{'follower':>10}")
    for level in range(4):
        n = AxisymmetricResolution.level(level)
        dead, follower = (
            displacements(geometry, follower=kind, level=level)[-1] for kind in (False, True)
        )
        print(f"{f'{n.wall} x {n.half_arc}':<33}{dead:9.3f}{follower:10.3f}")


if __name__ == "__main__":
    main()
