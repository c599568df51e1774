"""What a trial on a CAN bus leaves beside its recording: the raw frames, and how well the loop kept time."""

import json
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import can

from wipx.core.loop_quality import LoopQuality, quality_data
from wipx.core.whole_file import write_whole
from wipx.hardware.can_motor import Bus


class LoggedBus:
    """A bus whose frames are written to a file while a trial lasts.

    Every line is handed to the operating system at once, so that a killed process leaves a log that ends where it was
    killed. Times are those of the computer's clock, of received frames those of the adapter where it has a clock.

    Args:
        bus: Opened.
    """

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self._writer: can.ASCWriter | None = None

    @contextmanager
    def logging_to(self, path: Path) -> Iterator[None]:
        """Log to a file (Vector ASCII, .asc) while the block lasts."""
        self._writer = can.ASCWriter(path.open("w", encoding="utf-8", buffering=1))
        try:
            yield
        finally:
            writer, self._writer = self._writer, None
            if writer is not None:
                with suppress(OSError):  # the trial counts, whatever becomes of its log
                    writer.stop()

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """See `Bus`; a frame that could not be sent is not logged."""
        sent = time.time()  # before it leaves: the adapter may stamp the reply before this process goes on
        self._bus.send(msg, timeout)
        self._log(msg, sent, is_rx=False)

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """See `Bus`."""
        msg = self._bus.recv(timeout)
        if msg is not None:
            self._log(msg, msg.timestamp or time.time(), is_rx=True)
        return msg

    def shutdown(self) -> None:
        """See `Bus`."""
        self._bus.shutdown()

    def _log(self, msg: can.Message, at: float, *, is_rx: bool) -> None:
        if self._writer is None:
            return
        frame = can.Message(
            timestamp=at,
            arbitration_id=msg.arbitration_id,
            is_extended_id=msg.is_extended_id,
            is_error_frame=msg.is_error_frame,
            is_rx=is_rx,
            data=msg.data,
        )
        try:
            self._writer.on_message_received(frame)
        except OSError as error:  # a full disk must not stop a robot that balances
            self._writer = None
            print(f"the CAN log ends early ({error.strerror}); the trial goes on", file=sys.stderr)


class TrialLogs:
    """The files of all trials of a run: NAME.asc, NAME_loop.json and NAME_loop.png for the recording NAME.csv.

    Args:
        folder: That takes them; None for no files.
    """

    def __init__(self, folder: Path | None) -> None:
        self._folder = folder

    @contextmanager
    def trial(self, bus: LoggedBus, name: str) -> Iterator[None]:
        """Log the bus while a trial lasts."""
        if self._folder is None:
            yield
            return
        with bus.logging_to(self._folder / f"{Path(name).stem}.asc"):
            yield

    def leave(self, name: str, quality: LoopQuality, end: str) -> None:
        """Write how well the loop kept time.

        Args:
            name: Of the trial.
            quality: Of its loop.
            end: How it ended, in words.
        """
        if self._folder is None:
            return
        from wipx.report.loop_quality_figure import draw_loop_quality

        stem = Path(name).stem
        content = json.dumps({"trial": stem, "end": end, **quality_data(quality)}, indent=2)
        write_whole(self._folder / f"{stem}_loop.json", content)
        draw_loop_quality(quality, f"{stem}: {end}", self._folder / f"{stem}_loop.png")
