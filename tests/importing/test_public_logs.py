"""Public CAN files that others made: each frame is counted, or said to be lost.

The files are the test data of python-can (LGPL-3) and cantools (MIT). `docs/howto/import.md` says how to fetch
them, and what came out.
"""

import os
import re
from pathlib import Path

import numpy as np
import pytest

from wipx.core.errors import InputError
from wipx.importing.formats.can_files import SUFFIXES

can = pytest.importorskip("can")
cantools = pytest.importorskip("cantools")
CAN = "wipx.importing.formats.can_log.CanLog"


def public(*suffixes: str) -> list[Path]:
    """Files of the folder that the environment variable WIPX_PUBLIC_LOGS names; skips without."""
    folder = os.environ.get("WIPX_PUBLIC_LOGS")
    if not folder:
        pytest.skip("WIPX_PUBLIC_LOGS does not name a folder with the sources of python-can and cantools")
    return sorted(path for path in Path(folder).rglob("*") if path.suffix.lower() in suffixes)


@pytest.mark.slow
def test_every_frame_of_public_logs_is_counted(imported):
    paths = public(*SUFFIXES)
    assert paths
    for path in paths:
        theirs = sum(1 for _ in can.LogReader(path))
        try:
            preview = imported(path, "contents").preview
            counted = sum(stream.rows for stream in preview.streams)
            told = preview.losses
        except InputError as error:
            counted, told = 0, (str(error),)
        told_frames = sum(int(n) for n in re.findall(r"(\d+) (?:error|remote) frames", " ".join(told)))
        print(f"{path.name}: {theirs} frames, {counted} in streams, {told_frames} without data")
        assert counted + told_frames == theirs, path


@pytest.mark.slow
def test_public_dbc_files_decode_their_own_frames(imported, tmp_path: Path, fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    decoded, refused = 0, []
    for path in public(".dbc"):
        try:
            messages = [m for m in cantools.database.load_file(path, strict=False).messages if m.length <= 64]
        except cantools.Error:
            messages = []
        log = tmp_path / f"{path.stem}.asc"
        with can.Logger(log) as logger:
            for k in range(20 * max(len(messages), 1)):
                message = messages[k % len(messages)] if messages else None
                frame = (message.frame_id, message.is_extended_frame, message.length) if message else (1, False, 8)
                data = rng.integers(0, 256, frame[2], dtype=np.uint8).tobytes()
                logger(can.Message(0.001 * k, *frame[:2], is_fd=len(data) > 8, data=data))
        try:
            preview = imported(log, "contents", format={"_target_": CAN, "dbc": str(path)}).preview
        except InputError as error:
            refused.append(f"{path.name}: {str(error).replace(str(path), '')}")
            continue
        decoded += 1
        names = {stream.name.removesuffix(" (not decoded)") for stream in preview.streams}
        assert names >= {message.name for message in messages}, path
        assert sum(stream.rows for stream in preview.streams) == 20 * max(len(messages), 1), path
    print(f"{decoded} DBC files read, {len(refused)} refused:", *refused, sep="\n")
    assert decoded > len(refused)
