"""Curves and fits on one page, by matplotlib."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rig.fitting.errors import FittingError
from rig.fitting.fit import EnergyFit
from rig.fitting.specimen import Specimen
from rig.mechanics.errors import MechanicsError
from rig.mechanics.hyperelastic import Mode


def plot_fits(
    path: Path, title: str, specimens: Sequence[Specimen], fits: Sequence[EnergyFit]
) -> None:
    """One panel a mode: specimens as dots, energies as lines; the suffix chooses the format.

    Raises FittingError where it cannot be written.
    """
    from matplotlib.figure import Figure

    modes = [mode for mode in Mode if any(s.mode is mode for s in specimens)]
    figure = Figure(figsize=(6.4 * len(modes), 4.8), layout="constrained")
    figure.suptitle(title)
    for axes, mode in zip(figure.subplots(1, len(modes), squeeze=False)[0], modes, strict=True):
        own = [s for s in specimens if s.mode is mode]
        for specimen in own:
            axes.plot(
                100 * (specimen.stretch - 1), specimen.stress / 1e3, ".", ms=4, label=specimen.name
            )
        low = min(float(s.stretch[0]) for s in own)
        stretch = np.linspace(low, max(s.longest for s in own), 200)
        for found, line in zip(fits, _LINES * len(fits), strict=False):
            try:
                stress = found.family.stress(found.values, mode, stretch)
            except MechanicsError:
                continue  # not every energy has a response in a mode it was not fitted to
            axes.plot(100 * (stretch - 1), stress / 1e3, line, lw=1.3, label=found.family.name)
        axes.set(title=str(mode), xlabel="engineering strain (%)", ylabel="nominal stress (kPa)")
        axes.grid(alpha=0.3)
        axes.legend(fontsize=8)
    try:
        figure.savefig(path)
    except (OSError, ValueError) as error:
        raise FittingError(
            f"the plot cannot be written to {path}: {error}. Name a file in an existing folder "
            f"that ends in .svg, .png or .pdf."
        ) from None


_LINES = ("-", "--", "-.", ":")
