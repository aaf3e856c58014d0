"""What a lens calibration rests on, drawn: residuals over the picture, view by view, coverage."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rig.report.errors import ReportError
from rig.vision.lens import LensFit


def draw_lens_fit(fit: LensFit, path: Path) -> None:
    """Write a PNG; raises ReportError where that is impossible."""
    from matplotlib.figure import Figure

    pixels, residuals = np.concatenate(fit.pixels), np.concatenate(fit.residuals)
    figure = Figure(figsize=(11, 3.6), layout="constrained")
    places, scatter, views = figure.subplots(1, 3, width_ratios=(2, 1.2, 1.2))
    arrows = places.quiver(*pixels.T, *residuals.T, angles="xy", width=2e-3, color="tab:blue")
    places.quiverkey(arrows, 0.9, 1.04, 0.1, "0.1 px")
    places.set(
        xlim=(0, fit.size[0]),
        ylim=(fit.size[1], 0),
        aspect="equal",
        xlabel="px",
        ylabel="px",
        title="corners: residuals",
    )
    scatter.plot(*residuals.T, ".", markersize=2)
    scatter.set(aspect="equal", xlabel="px", title=f"RMS {fit.rms_px:.3f} px")
    rms = [np.sqrt((left**2).sum(axis=1).mean()) for left in fit.residuals]
    views.bar(np.arange(1, len(rms) + 1), rms)
    views.set(xlabel="view", ylabel="RMS, px", title="view by view")
    try:
        figure.savefig(path, dpi=130)
    except (OSError, ValueError) as error:
        raise ReportError(f"{path}: the figure cannot be written: {error}.") from None
