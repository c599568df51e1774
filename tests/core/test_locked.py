"""One process at a time holds a lock; one that was killed holds nobody up."""

import subprocess
import sys
import time
from pathlib import Path

from wipx.core.locked import locked

COUNT_UP = """
import sys, time
from pathlib import Path
from wipx.core.locked import locked
number = Path(sys.argv[1])
for _ in range(5):
    with locked(number.with_name(".lock")):
        value = int(number.read_text())
        time.sleep(0.01)
        number.write_text(str(value + 1))
"""
HOLD = """
import sys, time
from pathlib import Path
from wipx.core.locked import locked
with locked(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(60.0)
"""


def test_processes_that_count_together_lose_no_count(tmp_path: Path):
    number = tmp_path / "number"
    number.write_text("0")
    together = [subprocess.Popen([sys.executable, "-c", COUNT_UP, str(number)]) for _ in range(2)]
    assert [process.wait(60.0) for process in together] == [0, 0]
    assert number.read_text() == "10"


def test_a_holder_that_was_killed_is_missed_at_once(tmp_path: Path):
    holder = subprocess.Popen([sys.executable, "-c", HOLD, str(tmp_path / ".lock")], stdout=subprocess.PIPE, text=True)
    assert holder.stdout is not None
    assert holder.stdout.readline() == "held\n"
    holder.kill()
    holder.wait()
    begun = time.monotonic()
    with locked(tmp_path / ".lock"):
        assert time.monotonic() - begun < 30.0
    assert not (tmp_path / ".lock").exists()
