"""Bytes from the wire, damaged in any way: the parsers go on, and lose no message that is whole."""

import binascii
import struct

import numpy as np
import pytest

from wipx.hardware.mit_protocol import MitProtocol, Ranges
from wipx.hardware.vn100 import HEADER, BinaryParser, Parser, TextParser, text_message

MESSAGES = 200


def binary(k: int) -> bytes:
    body = HEADER[1:] + struct.pack("<Q9f", k, *([0.5] * 9))
    return b"\xfa" + body + struct.pack(">H", binascii.crc_hqx(body, 0))


def text(k: int) -> bytes:
    return text_message(f"VNYMR,{k:+07.2f}" + ",+000.00" * 11)


@pytest.mark.parametrize(("parser", "message"), [(BinaryParser, binary), (TextParser, text)])
def test_every_whole_message_between_garbage_is_found(fresh_seed: int, parser: type[Parser], message):
    rng = np.random.default_rng(fresh_seed)
    stream, whole = b"", 0
    for k in range(MESSAGES):
        stream += rng.bytes(int(rng.integers(0, 40))).replace(b"$", b"") + b"\n"
        sent = bytearray(message(k))
        if rng.random() < 0.3:
            sent[int(rng.integers(1, len(sent) - 6))] ^= 1 << int(rng.integers(7))
        else:
            whole += 1
        stream += bytes(sent)
    reader, found = parser(), 0
    while stream:
        length = int(rng.integers(1, 90))
        found += len(reader.feed(stream[:length]))
        stream = stream[length:]
    assert found == whole


@pytest.mark.parametrize("parser", [BinaryParser, TextParser])
def test_random_bytes_are_no_messages(fresh_seed: int, parser: type[Parser]):
    rng = np.random.default_rng(fresh_seed)
    reader = parser()
    assert sum(len(reader.feed(rng.bytes(500))) for _ in range(200)) == 0


def test_any_frame_is_a_reply_within_its_ranges_or_none(fresh_seed: int):
    rng, ends = np.random.default_rng(fresh_seed), Ranges()
    protocol = MitProtocol(ends, 1, 0)
    for _ in range(2000):
        data = rng.bytes(int(rng.integers(0, 9)))
        reply = protocol.reply(data)
        assert (reply is None) == (len(data) < 6)
        if reply is not None:
            assert abs(reply.position) <= ends.position + 1e-9
            assert abs(reply.velocity) <= ends.velocity + 1e-9
            assert abs(reply.torque) <= ends.torque + 1e-9
