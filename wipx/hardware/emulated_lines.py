"""The lines of the emulator: TCP ports and pseudo-terminals, and the two protocols that carry CAN frames over them."""

import os
import socket
import time
from collections.abc import Callable, Sequence
from typing import Protocol

CHUNK = 4096
Frame = Callable[[int, bytes, float], tuple[int, bytes] | None]  # id, data and time [s] of a frame; the reply to it


class Line:
    """One end of a line: a TCP port that takes one caller at a time, or a pseudo-terminal.

    Args:
        pseudo_terminal: Whether it is one.
        greeting: Sent to every caller.
    """

    def __init__(self, *, pseudo_terminal: bool, greeting: bytes = b"") -> None:
        self._greeting = greeting
        self._listening: socket.socket | None = None
        self._caller: socket.socket | None = None
        self._terminal: tuple[int, int] | None = None
        if pseudo_terminal:
            self._terminal = _open_pseudo_terminal()
            self.name = os.ttyname(self._terminal[1])
        else:
            self._listening = socket.create_server(("127.0.0.1", 0))
            self.name = f"socket://127.0.0.1:{self._listening.getsockname()[1]}"

    @property
    def waits_for(self) -> list[int]:
        """File numbers that become readable when something comes."""
        ends = (self._listening, self._caller)
        return [self._terminal[0]] if self._terminal else [end.fileno() for end in ends if end is not None]

    def read(self, ready: Sequence[int]) -> bytes:
        """What has come; a new caller takes the place of the old one."""
        if self._listening is not None and self._listening.fileno() in ready:
            self._caller = self._listening.accept()[0]
            self._caller.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._caller.setblocking(False)
            self.write(self._greeting)
            return b""
        if self._terminal and self._terminal[0] in ready:
            return os.read(self._terminal[0], CHUNK)
        if self._caller is not None and self._caller.fileno() in ready:
            try:
                data = self._caller.recv(CHUNK)
            except OSError:
                data = b""
            if not data:
                self._caller.close()
                self._caller = None
            return data
        return b""

    def write(self, data: bytes) -> None:
        """Send; without a reader the data are lost, as on a serial line."""
        try:
            if self._terminal:
                os.write(self._terminal[0], data)
            elif self._caller is not None:
                self._caller.send(data)
        except OSError:
            return


def _open_pseudo_terminal() -> tuple[int, int]:
    import pty  # not on every platform
    import tty

    master, slave = pty.openpty()  # the slave stays open, so that the master survives a caller that leaves
    tty.setraw(master)
    tty.setraw(slave)
    os.set_blocking(master, False)
    return master, slave


class CanProtocol(Protocol):
    """What carries CAN frames over a line."""

    greeting: bytes

    def receive(self, data: bytes, now: float) -> bytes:
        """The answer to what a line brings at a time [s]."""
        ...


class SerialCan:
    """The slcan protocol (Lawicel) of a CAN adapter, over the frames of one motor."""

    greeting = b""

    def __init__(self, frame: Frame) -> None:
        self._frame = frame
        self._pending = b""

    def receive(self, data: bytes, now: float) -> bytes:
        """The adapter's answers, and the frames that come from the bus."""
        *lines, self._pending = (self._pending + data).split(b"\r")
        return b"".join(self._answer(line, now) for line in lines)

    def _answer(self, line: bytes, now: float) -> bytes:
        if line[:1] != b"t":
            return {b"V": b"V1013\r", b"N": b"NA123\r", b"F": b"F00\r"}.get(line[:1], b"\r")
        try:
            frame_id, length = int(line[1:4], 16), int(line[4:5])
            data = bytes.fromhex(line[5 : 5 + 2 * length].decode())
        except ValueError:
            return b"\a"
        reply = self._frame(frame_id, data, now)
        return b"z\r" + (b"" if reply is None else f"t{reply[0]:03X}{len(reply[1])}{reply[1].hex()}\r".encode())


class SocketCan:
    """The raw mode of socketcand, over the frames of one motor; https://github.com/linux-can/socketcand."""

    greeting = b"< hi >"

    def __init__(self, frame: Frame) -> None:
        self._frame = frame
        self._pending = b""

    def receive(self, data: bytes, now: float) -> bytes:
        """The answers, and the frames that come from the bus."""
        *commands, self._pending = (self._pending + data).split(b">")
        return b"".join(self._answer(command.decode("ascii", "replace").split()[1:], now) for command in commands)

    def _answer(self, words: list[str], now: float) -> bytes:
        if words[:1] in (["open"], ["rawmode"]):
            return b"< ok >"
        try:
            if words[0] != "send":
                raise ValueError
            frame_id, length = int(words[1], 16), int(words[2], 16)
            reply = self._frame(frame_id, bytes(int(word, 16) for word in words[3 : 3 + length]), now)
        except (ValueError, IndexError):
            return b"< error unknown command >"
        if reply is None:
            return b""
        return f"< frame {reply[0]:03X} {time.time():.6f} {reply[1].hex().upper()} >".encode()
