"""A run that is cut short stays readable, and can be taken up again."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import textwrap
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from recorded_runs import ROWS_PER_POINT, START, point, write_point, write_run

from rig.record.documents import ResumeDocument, StopDocument
from rig.record.errors import RecordError
from rig.record.mcap_format import scan
from rig.record.reader import RunReader
from rig.record.writer import RunWriter

MANY_FOLDERS = (HealthCheck.function_scoped_fixture,)
"""`damaged` empties its folder for each example, so sharing it is safe."""


class WholeLog:
    """A finished log; wrapped so that failures do not print it."""

    def __init__(self, content: bytes) -> None:
        self.content = content
        self.length = len(content)

    def __getitem__(self, piece: slice) -> bytes:
        return self.content[piece]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> WholeLog:
    folder = write_run(tmp_path_factory.mktemp("whole") / "run")
    return WholeLog((folder / "run.mcap").read_bytes())


@pytest.fixture
def damaged(tmp_path: Path) -> Callable[[bytes], Path]:
    def make(content: bytes) -> Path:
        folder = tmp_path / "damaged"
        folder.mkdir(exist_ok=True)
        for old in folder.iterdir():
            old.unlink()
        (folder / "run.mcap").write_bytes(content)
        return folder

    return make


def open_or_none(folder: Path) -> RunReader | None:
    """The reader of a damaged run, or None where it says that nothing is readable."""
    try:
        return RunReader(folder)
    except RecordError:
        return None


def first_readable(whole: WholeLog) -> int:
    """Length from which a truncated log holds the set-up of the run."""
    start = scan(memoryview(whole.content)).metadata[0].index
    return start.offset + start.length


def read_everything(folder: Path) -> int:
    """Read all there is; checks that it is a prefix and returns the number of points."""
    reader = RunReader(folder)
    points = reader.points()
    assert points == tuple(point(number) for number in range(len(points)))
    assert len(reader.telemetry("PRESSURE")["time_s"]) >= len(points) * ROWS_PER_POINT
    assert len(reader.can_frames().ids) >= len(points) * ROWS_PER_POINT
    assert len(list(reader.images())) >= 2 * len(points)
    assert len(reader.deformation_readings()) >= 2 * len(points)
    assert len(reader.events()) >= len(points)
    assert sum(reader.counts().values()) > 0 or not points
    return len(points)


@settings(max_examples=150, suppress_health_check=MANY_FOLDERS)
@given(share=st.floats(0, 1))
def test_any_truncation_leaves_a_readable_prefix_or_a_clear_error(
    whole: WholeLog, damaged: Callable[[bytes], Path], share: float
) -> None:
    length = int(share * whole.length)
    folder = damaged(whole[:length])
    reader = open_or_none(folder)
    if reader is None:
        assert length < first_readable(whole)
        return
    read_everything(folder)
    assert length >= first_readable(whole)
    assert reader.complete == (length == whole.length)
    assert (reader.problem is None) == reader.complete


def test_every_record_boundary_is_a_good_place_to_stop(
    whole: WholeLog, damaged: Callable[[bytes], Path]
) -> None:
    lengths = range(first_readable(whole), whole.length, 397)
    counts = [read_everything(damaged(whole[:length])) for length in lengths]
    assert counts == sorted(counts)
    assert set(counts) == {0, 1, 2, 3, 4}


@settings(max_examples=150, suppress_health_check=MANY_FOLDERS)
@given(data=st.data())
def test_any_flipped_byte_is_noticed_or_harmless(
    whole: WholeLog, damaged: Callable[[bytes], Path], data: st.DataObject
) -> None:
    where = data.draw(st.integers(0, whole.length - 1))
    content = bytearray(whole.content)
    content[where] ^= data.draw(st.integers(1, 255))
    folder = damaged(bytes(content))
    reader = open_or_none(folder)
    if reader is None:
        return
    if reader.complete:
        assert read_everything(folder) == 4
        assert reader.start() == START
        return
    assert reader.problem
    for read in (reader.points, reader.deformation_readings, reader.events, reader.can_frames):
        with suppress(RecordError):
            read()
    with suppress(RecordError):
        list(reader.images())
    with suppress(RecordError):
        reader.telemetry("PRESSURE")


@settings(max_examples=60, suppress_health_check=MANY_FOLDERS)
@given(share=st.floats(0, 1))
def test_any_truncated_run_can_be_resumed_and_finished(
    whole: WholeLog, damaged: Callable[[bytes], Path], share: float
) -> None:
    folder = damaged(whole[: int(share * whole.length)])
    reader = open_or_none(folder)
    if reader is None:
        with pytest.raises(RecordError):
            RunWriter.resume(folder)
        return
    kept = len(reader.points())
    finish(folder, kept)
    check_finished(folder, kept)


def finish(folder: Path, kept: int, keep_points: int | None = None) -> None:
    with RunWriter.resume(folder, keep_points) as writer:
        note = ResumeDocument(resumed_s=kept * 4.0, points_kept=kept, seed=4)
        writer.resume_note(note, kept * 4.0)
        for number in range(kept, 5):
            write_point(writer, number)
        writer.stop(StopDocument(exit_status="success", reason=""), 20.0)


def check_finished(folder: Path, kept: int) -> None:
    reader = RunReader(folder)
    assert reader.complete
    assert reader.points() == tuple(point(number) for number in range(5))
    assert [note.points_kept for note in reader.resumes()] == [kept]
    assert len(reader.telemetry("PRESSURE")["time_s"]) == 5 * ROWS_PER_POINT
    assert len(list(reader.images())) == 10
    with (folder / "run.mcap").open("rb") as stream:
        foreign = make_reader(stream, validate_crcs=True)
        summary = foreign.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        stated = {
            summary.channels[number].topic: count
            for number, count in summary.statistics.channel_message_counts.items()
        }
        read = dict.fromkeys(stated, 0)
        for _, channel, _ in foreign.iter_messages():
            read[channel.topic] += 1
        assert read == stated == reader.counts()
        assert summary.statistics.chunk_count == len(summary.chunk_indexes)


def test_resuming_a_closed_run_goes_on_after_its_last_point(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", points=3)
    finish(folder, 3)
    check_finished(folder, 3)


def test_resuming_can_keep_fewer_points(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", points=3)
    finish(folder, 1, keep_points=1)
    check_finished(folder, 1)


def test_resuming_can_keep_nothing_but_the_set_up(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", points=3)
    finish(folder, 0, keep_points=0)
    check_finished(folder, 0)


def test_asking_to_keep_more_points_than_there_are_is_refused(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", points=3)
    before = (folder / "run.mcap").read_bytes()
    with pytest.raises(RecordError, match="the log has 3 complete"):
        RunWriter.resume(folder, keep_points=4)
    assert (folder / "run.mcap").read_bytes() == before


def test_what_resuming_drops_stays_beside_the_log(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", points=3)
    before = (folder / "run.mcap").read_bytes()
    RunWriter.resume(folder).close()
    assert (folder / "run.interrupted-1.mcap").read_bytes() == before
    RunWriter.resume(folder, keep_points=1).close()
    assert (folder / "run.interrupted-2.mcap").is_file()
    assert len(RunReader(folder / "run.interrupted-2.mcap").points()) == 3


def test_a_folder_without_a_run_cannot_be_resumed(tmp_path: Path) -> None:
    with pytest.raises(RecordError, match="no run to resume"):
        RunWriter.resume(tmp_path)


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no SIGKILL on this system")
def test_a_killed_process_leaves_every_completed_point(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    script = textwrap.dedent(
        """
        import sys
        from pathlib import Path
        from recorded_runs import ATTACHMENTS, START, UNITS, write_point
        from rig.record.writer import RunWriter

        writer = RunWriter.create(Path(sys.argv[1]), START, ATTACHMENTS, UNITS)
        for number in range(10_000):
            write_point(writer, number)
            print(number, flush=True)
        """
    )
    root = Path(__file__).resolve().parents[2]
    path = os.pathsep.join([str(root), str(Path(__file__).parent)])
    with subprocess.Popen(
        [sys.executable, "-c", script, str(folder)],
        stdout=subprocess.PIPE,
        env=os.environ | {"PYTHONPATH": path},
    ) as process:
        assert process.stdout is not None
        last = -1
        for _ in range(25):
            last = int(process.stdout.readline())
        process.kill()
        last = max([last, *map(int, process.stdout.read().split())])
    assert process.returncode == -signal.SIGKILL
    reader = RunReader(folder)
    assert not reader.complete
    assert len(reader.points()) >= last + 1
    read_everything(folder)
    with RunWriter.resume(folder) as writer:
        write_point(writer, len(reader.points()))
    assert len(RunReader(folder).points()) == len(reader.points()) + 1
