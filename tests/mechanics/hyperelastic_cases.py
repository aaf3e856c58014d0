"""Materials and deformations that the tests of hyperelasticity share."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st

from rig.mechanics.hyperelastic import (
    Array,
    ArrudaBoyce,
    Energy,
    Hyperelastic,
    LinearElastic,
    LogarithmicVolume,
    MooneyRivlin,
    NeoHookean,
    Ogden,
    OgdenTerm,
    QuadraticVolume,
    SaintVenantKirchhoff,
    Yeoh,
)

ISOCHORIC: dict[str, Energy] = {
    "neo-Hookean": NeoHookean(150e3),
    "Mooney-Rivlin, 2 terms": MooneyRivlin(60e3, 15e3),
    "Mooney-Rivlin, 3 terms": MooneyRivlin(60e3, 15e3, 4e3),
    "Mooney-Rivlin, 5 terms": MooneyRivlin(60e3, 15e3, 4e3, -2e3, 3e3),
    "Yeoh": Yeoh(70e3, -3e3, 400.0),
    "Arruda-Boyce": ArrudaBoyce(140e3, 2.5),
    "Ogden, 1 term": Ogden((OgdenTerm(150e3, 3.4),)),
    "Ogden, 2 terms": Ogden((OgdenTerm(120e3, 1.3), OgdenTerm(30e3, -2.6))),
    "Ogden, 3 terms": Ogden((OgdenTerm(99e3, 1.3), OgdenTerm(3e3, 5.0), OgdenTerm(12e3, -2.0))),
}
OBJECTIVE: dict[str, Energy] = {
    **ISOCHORIC,
    "Saint Venant-Kirchhoff": SaintVenantKirchhoff(450e3, 0.4),
    "neo-Hookean with volume": Hyperelastic(NeoHookean(150e3), QuadraticVolume(7.5e6)),
    "Ogden with volume": Hyperelastic(
        Ogden((OgdenTerm(120e3, 1.3), OgdenTerm(30e3, -2.6))), LogarithmicVolume(7.5e6)
    ),
}
ALL: dict[str, Energy] = {**OBJECTIVE, "linear": LinearElastic(450e3, 0.4)}


def random_deformations(count: int, spread: float = 0.25) -> Array:
    """F of shape (3, 3, count) around the identity, none inverted or nearly so; seeded."""
    rng = np.random.default_rng(20)
    f = np.eye(3)[..., None] + rng.normal(scale=spread, size=(3, 3, 4 * count))
    f = f[..., np.linalg.det(np.moveaxis(f, -1, 0)) > 0.2]
    return f[..., :count]


def rotation(x: float, y: float, z: float, w: float) -> Array:
    """The rotation of a quaternion that need not be normalised, (3, 3)."""
    x, y, z, w = np.array((x, y, z, w)) / np.sqrt(x * x + y * y + z * z + w * w)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


_components = st.floats(-1, 1)
rotations = st.builds(rotation, _components, _components, _components, st.floats(0.1, 1))
_stretches = st.floats(0.4, 2.5)


@st.composite
def deformations(draw: st.DrawFn) -> Array:
    """F of shape (3, 3) with stretches from 0.4 to 2.5, some of them equal, in any directions."""
    stretches = draw(st.tuples(_stretches, _stretches, _stretches))
    equal = draw(st.sampled_from(("none", "two", "nearly two", "three")))
    if equal == "two":
        stretches = (stretches[0], stretches[0], stretches[2])
    elif equal == "nearly two":
        stretches = (stretches[0], stretches[0] * (1 + 1e-9), stretches[2])
    elif equal == "three":
        stretches = (stretches[0],) * 3
    return draw(rotations) @ np.diag(stretches) @ draw(rotations)
