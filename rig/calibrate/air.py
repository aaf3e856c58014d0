"""The buoyancy of air, by the conventional values that masses and balances are stated with."""

from __future__ import annotations

AIR_KG_M3 = 1.2
MASSES_KG_M3 = 8000.0
BUOYANCY = AIR_KG_M3 / MASSES_KG_M3
"""Share of its weight that air takes from a mass of conventional density (OIML D 28)."""
