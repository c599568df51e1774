"""The program in this process leaves the streams of other tests open."""

import logging
from pathlib import Path
from typing import TextIO

import pytest
from tasks.conftest import program_in


class ClosingHandler(logging.StreamHandler[TextIO]):
    """A handler like absl's, which closes its stream when it is closed itself."""

    def close(self) -> None:
        self.stream.close()
        super().close()


def test_log_handlers_of_other_tests_stay_open(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    with (tmp_path / "log.txt").open("w") as stream:
        handler = ClosingHandler(stream)
        assert program_in(tmp_path, capsys, monkeypatch)("task=identify", "tracking=none").status == 2
        assert not stream.closed
        monkeypatch.undo()
        handler.close()
