"""A calibration from greeting the board to a vented bench, whatever happens in between."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Protocol

from rig.experiment.calibration.references import Stage
from rig.experiment.prepare import make_safe, take_over, write_parameters
from rig.link.bus import FrameBus
from rig.link.client import RigLink

Procedure = Callable[[RigLink], None]


class Linked(Protocol):
    """A bench, as far as its board is concerned."""

    @property
    def bus(self) -> FrameBus:
        """The link to the board."""
        ...


def calibrate_on(
    bench: Linked,
    parameters: Mapping[str, float],
    procedure: Procedure,
    stage: Stage,
    interrupted: Callable[[], None] | None = None,
) -> None:
    """Do `procedure` on a bench whose board has `parameters`; the bench is vented in any case.

    `stage` is told how the venting went. `interrupted` is asked while waiting and may raise to
    stop; what the procedure told of its points until then stays told.
    """
    link = RigLink(bench.bus, interrupted=interrupted)
    link.open()
    take_over(link)
    write_parameters(link, dict(parameters))
    try:
        procedure(link)
    finally:
        stage(make_safe(link))
