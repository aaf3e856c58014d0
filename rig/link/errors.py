"""What can go wrong between host and board."""

from __future__ import annotations

from rig.errors import RigError
from rig.link.faults import VALUE_UNITS


class LinkError(RigError):
    """The conversation with the board failed."""


class PortError(LinkError):
    """The port could not be opened, or it vanished."""


class LinkLostError(LinkError):
    """Nothing came from the board for too long."""


class IdentityError(LinkError):
    """The board speaks another version of the schema, or is no rig board."""


class UnexpectedStateError(LinkError):
    """The board left the state it was told to be in, or restarted."""


class CommandRefusedError(LinkError):
    """The board refused a command or a parameter, and said why."""


class BoardFaultError(LinkError):
    """The board latched a fault and went to its safe state."""

    def __init__(self, code: str, value: float | None, time_s: float, hint: str) -> None:
        self.code = code
        self.value = value
        self.time_s = time_s
        self.hint = hint
        unit = VALUE_UNITS.get(code)
        shown = "" if value is None or unit is None else f" ({value:.4g} {unit})"
        super().__init__(
            f"the board reports the fault '{code}'{shown} at {time_s:.1f} s of bench time and has "
            f"stopped the plunger and vented. {hint}"
        )
