"""Opens the bench that a spec describes: simulated ones with faults if wanted, or the lab's."""

from __future__ import annotations

from pathlib import Path

from rig.board.errors import BoardError
from rig.board.virtual import VirtualBench
from rig.spec.bench import BenchSpec, VirtualBoard
from rig.spec.faults import FaultScript
from rig.spec.workspace import Setup


def is_simulated(bench: BenchSpec) -> bool:
    """Whether time on this bench is virtual, and nothing can be harmed."""
    return isinstance(bench.board, VirtualBoard)


def require_simulated(bench: BenchSpec) -> None:
    """Raise BoardError unless faults can be injected into this bench."""
    if not is_simulated(bench):
        raise BoardError(
            f"the bench '{bench.name}' has a real board ({bench.board.kind}): faults are injected "
            "into simulated benches only. Nothing was moved. Choose the bench 'virtual'."
        )


def open_simulated(
    setup: Setup,
    seed: int,
    truth: Path,
    faults: FaultScript | None = None,
    *,
    segment: int = 0,
    start_s: float = 0.0,
) -> VirtualBench:
    """The simulated bench of a set-up; see VirtualBench."""
    return VirtualBench(setup, seed, truth, segment=segment, start_s=start_s, faults=faults)
