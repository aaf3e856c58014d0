"""What every recorded piece of work shares: the bench ends vented and the log ends closed.

Used by characterisations and by experiments on the control loop.
"""

from __future__ import annotations

import platform
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from importlib import metadata
from pathlib import Path

import rig
from rig.errors import RigError
from rig.experiment.errors import AbortedError
from rig.experiment.prepare import make_safe
from rig.experiment.recorder import LinkRecorder
from rig.link.client import Identity, Message, RigLink, Tap
from rig.link.slcan import RawFrame
from rig.record.documents import StopDocument
from rig.record.errors import RecordError
from rig.record.writer import RunWriter

RECORDED_LIBRARIES = ("numpy", "scipy", "opencv-python-headless", "cantools", "mcap")


@dataclass(frozen=True)
class RunOutcome:
    """How a run ended; `error` is what stopped it, if anything did."""

    stop: StopDocument
    error: RigError | None


def versions(identity: Identity) -> dict[str, str]:
    """Of everything that a recorded number depends on."""
    known = {
        "rig": rig.__version__,
        "firmware": identity.firmware_git,
        "protocol": f"{identity.protocol_version} (schema {identity.schema_crc:04x})",
        "python": platform.python_version(),
    }
    return known | {name: metadata.version(name) for name in RECORDED_LIBRARIES}


@contextmanager
def explaining_disk_errors(folder: Path) -> Iterator[None]:
    """What the disk refuses becomes a RecordError; the bench is safe by then."""
    try:
        yield
    except OSError as error:
        raise RecordError(
            f"{folder}: the log cannot be written: {error}. The bench was vented; every complete "
            f"point is kept. Free space on the disk, then `rig resume {folder}`."
        ) from error


def carry_out(
    link: RigLink,
    record: RunWriter,
    work: Callable[[LinkRecorder], None],
    *,
    success: str,
    cautions: Sequence[str] = (),
    stage: Callable[[str], None],
    watch: Tap | None = None,
) -> RunOutcome:
    """Do `work` with everything that comes over the link on record, and shown to `watch`.

    However it ends, the bench is vented and the log gets its stop document; `success` is what that
    says if nothing went wrong.
    """
    recorder = LinkRecorder(record)
    crash: BaseException | None = None
    leaving = False

    def tap(frames: Sequence[RawFrame], messages: Sequence[Message]) -> None:
        try:
            recorder(frames, messages)
            if watch is not None and crash is None:
                watch(frames, messages)
        except (OSError, RecordError):
            # the log may be what broke (a full disk): venting must not depend on it
            if not leaving:
                raise

    link.set_tap(tap)
    for caution in cautions:
        record.event(link.now_s, "caution", {"what": caution}, "warning")
    error: RigError | None = None
    try:
        work(recorder)
        stop = StopDocument(exit_status="success", reason=success)
    except (AbortedError, KeyboardInterrupt) as stopped:
        error = stopped if isinstance(stopped, AbortedError) else AbortedError("interrupted")
        stop = StopDocument(exit_status="aborted", reason=str(error))
    except RigError as failure:
        error = failure
        stop = StopDocument(exit_status="failed", reason=str(failure))
    except BaseException as unforeseen:  # the bench must be safe before anything else is told
        crash = unforeseen
        stop = StopDocument(exit_status="failed", reason=f"{type(crash).__name__}: {crash}")
    leaving = True
    try:
        stage("making the bench safe")
        ending = make_safe(link)
        recorder.flush()
        record.event(link.now_s, "made safe", {"result": ending})
        lost = {"frames_lost": link.frames_lost}
        record.event(link.now_s, "link statistics", asdict(link.statistics) | lost)
        record.stop(stop, link.now_s)
    finally:
        if crash is not None:
            raise crash
    return RunOutcome(stop, error)
