"""Hyperelastic materials: one protocol, closed-form stresses and tangents, responses, stability."""

from rig.mechanics.hyperelastic.material import Hyperelastic, neo_hookean_from
from rig.mechanics.hyperelastic.polynomial import NeoHookean
from rig.mechanics.hyperelastic.protocol import Array, Energy, Volumetric
from rig.mechanics.hyperelastic.volumetric import LogarithmicVolume, QuadraticVolume, abaqus_volume

__all__ = [
    "Array",
    "Energy",
    "Hyperelastic",
    "LogarithmicVolume",
    "NeoHookean",
    "QuadraticVolume",
    "Volumetric",
    "abaqus_volume",
    "neo_hookean_from",
]
