"""What makes a measured pressure, force or angle uncertain, source by source.

The measurement models, with x = 0 to 1 over the span of a calibration:

    pressure = (1 + gain) s + bow 4 x (1 - x) + zero + readings        s as indicated
    force    = (1 + sensitivity) s + bow 4 x (1 - x) + creep s + zero + tare + readings

Errors on the right have the standard uncertainties of the calibration; sensitivity coefficients
are the derivatives (JCGM 100:2008, 5.1.3). Units are those of the lab: kPa, g, deg.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from rig.spec.calibration import LoadCellCalibration, TransducerCalibration
from rig.validate.uncertainty import Component

READINGS = "readings"
"""Scatter of single readings within one point; repeats of the point hold it, too."""


def readings(sd: float, count: int, unit: str) -> Component:
    """Type A part of a mean of `count` readings with the standard deviation `sd`.

    A single reading tells nothing of its scatter: zero, with one degree of freedom.
    """
    dof = max(1, count - 1)
    return Component(READINGS, sd / math.sqrt(max(1, count)), dof, unit=unit, kind="A")


def averaged(lines: Sequence[Component]) -> Component:
    """One error common to several results, as it acts on their mean."""
    u = math.sqrt(math.fsum(line.u**2 for line in lines) / len(lines))
    sensitivity = math.fsum(line.sensitivity for line in lines) / len(lines)
    return replace(lines[0], u=u, sensitivity=sensitivity, dof=min(line.dof for line in lines))


def pressure_components(
    transducer: TransducerCalibration, pressure_kpa: float
) -> tuple[Component, ...]:
    """What the calibration leaves uncertain of a gauge pressure, all of type B."""
    return (
        Component("pressure gain", transducer.gain_u, sensitivity=pressure_kpa, unit="1"),
        Component(
            "pressure linearity",
            transducer.linearity_u / 1e3,
            sensitivity=transducer.bow_share(pressure_kpa * 1e3),
            unit="kPa",
        ),
        Component("pressure zero", transducer.zero_u / 1e3, unit="kPa"),
    )


def force_components(cell: LoadCellCalibration, force_g: float) -> tuple[Component, ...]:
    """What the calibration leaves uncertain of a force in grams-force, all of type B."""
    return (
        Component("load-cell sensitivity", cell.counts_per_gram_u, sensitivity=force_g, unit="1"),
        Component(
            "load-cell linearity",
            cell.linearity_u * 1e3,
            sensitivity=cell.bow_share(force_g / 1e3),
            unit="g",
        ),
        Component(
            "load-cell creep",
            cell.creep_u,
            sensitivity=force_g,
            unit="1",
            distribution="rectangular",
        ),
        Component("load-cell zero", cell.zero_u * 1e3, unit="g"),
    )


def tare_component(sd_g: float, count: int, words: int) -> Component:
    """Noise of a tare over `words` readings that scatter as the `count` of the point, `sd_g`."""
    return Component("tare", sd_g / math.sqrt(words), max(1, count - 1), unit="g", kind="A")
