"""Student's interval for those who take a standard uncertainty for that of a normal error."""

from __future__ import annotations

from scipy.special import stdtrit

NORMAL_95 = 1.959964


def widening(dof: float) -> float:
    """How much wider Student's 95 % interval is than the normal one, at degrees of freedom."""
    return float(stdtrit(dof, 0.975)) / NORMAL_95
