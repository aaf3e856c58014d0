"""What energies cost per 1000 quadrature points on one core, in microseconds.

Run `python -m tests.bench hyperelastic`.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from rig.mechanics.hyperelastic import (
    Array,
    ArrudaBoyce,
    Energy,
    Hyperelastic,
    LinearElastic,
    MooneyRivlin,
    NeoHookean,
    Ogden,
    OgdenTerm,
    QuadraticVolume,
    SaintVenantKirchhoff,
    Yeoh,
)

POINTS = 16_000
REPEATS = 15
NEO_HOOKEAN = NeoHookean(150e3)
ENERGIES: dict[str, Energy] = {
    "neo-Hookean": NEO_HOOKEAN,
    "neo-Hookean with volume": Hyperelastic(NEO_HOOKEAN, QuadraticVolume(7.5e6)),
    "Mooney-Rivlin, 2 terms": MooneyRivlin(60e3, 15e3),
    "Mooney-Rivlin, 5 terms": MooneyRivlin(60e3, 15e3, 4e3, -2e3, 3e3),
    "Yeoh": Yeoh(70e3, -3e3, 400.0),
    "Arruda-Boyce": ArrudaBoyce(140e3, 2.5),
    "Ogden, 1 term": Ogden((OgdenTerm(150e3, 3.4),)),
    "Ogden, 3 terms": Ogden((OgdenTerm(99e3, 1.3), OgdenTerm(3e3, 5.0), OgdenTerm(12e3, -2.0))),
    "Saint Venant-Kirchhoff": SaintVenantKirchhoff(450e3, 0.4),
    "linear": LinearElastic(450e3, 0.4),
}


def main() -> None:
    """Print the best time of energy, stress and tangent of every energy."""
    rng = np.random.default_rng(1)
    f = np.eye(3)[..., None] + rng.normal(scale=0.1, size=(3, 3, POINTS))
    print(f"{'us per 1000 points':<26}{'energy':>10}{'stress':>10}{'tangent':>10}")
    for name, energy in ENERGIES.items():
        works = (energy.energy, energy.first_piola, energy.tangent)
        times = "".join(f"{microseconds(work, f):>10.0f}" for work in works)
        print(f"{name:<26}{times}")


def microseconds(work: Callable[[Array], Array], f: Array) -> float:
    """Best wall time of `work`, per 1000 points."""
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        work(f)
        times.append(time.perf_counter() - start)
    return min(times) * 1e6 / (POINTS / 1000)


if __name__ == "__main__":
    main()
