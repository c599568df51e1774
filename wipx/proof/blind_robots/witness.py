"""Runs `python -m wipx` while noting every file that it opens, and refuses those that would give the answer away.

    python -m wipx.proof.blind_robots.witness SETTINGS ARGUMENT...

An audit hook (PEP 578) cannot be removed once it is there. It sees what Python opens; what compiled libraries open
by themselves it does not, which is why what is guarded is encrypted besides. Other processes, which the hook would
not see, and connections are refused altogether.
"""

import json
import os
import re
import runpy
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

OPENING = "open"
MOVING = ("os.rename", "os.link", "os.symlink")  # a guarded file under another name
OUT_OF_SIGHT = (
    "subprocess.Popen",
    "os.system",
    "os.exec",
    "os.posix_spawn",
    "os.spawn",
    "os.fork",
    "os.forkpty",
    "os.startfile",
    "socket.connect",
)
PROCESS = re.compile(r"/proc/(\d+)(/|$)")
READ, REFUSED = "opened", "refused"


@dataclass(frozen=True)
class Settings:
    """What a watched program may open.

    Attributes:
        guarded: Folders of which nothing may be opened.
        allowed: Folders inside them of which everything may.
        log: File that takes one line for each file that is opened or refused.
    """

    guarded: tuple[str, ...]
    allowed: tuple[str, ...]
    log: str

    def permits(self, path: str) -> bool:
        """Whether a file may be opened; links are followed first."""
        other = PROCESS.match(path)
        if other and int(other[1]) != os.getpid():  # its memory and environment
            return False
        return any(_below(path, folder) for folder in self.allowed) or not any(
            _below(path, folder) for folder in self.guarded
        )


def _below(path: str, folder: str) -> bool:
    return path == folder or path.startswith(folder.rstrip(os.sep) + os.sep)


def hook(settings: Settings, note: Callable[[str, str], None]) -> Callable[[str, tuple], None]:
    """The audit hook.

    Args:
        settings: What is refused.
        note: Takes `READ` or `REFUSED`, and what was asked for.
    """

    def watch(event: str, arguments: tuple) -> None:
        if event in OUT_OF_SIGHT:
            note(REFUSED, f"{event} {arguments[0] if arguments else ''}")
            raise PermissionError(f"{event}: a diagnosis of hidden physics works alone, without other processes")
        if event == OPENING or event in MOVING:
            asked = arguments[0]
            if not isinstance(asked, str | bytes | os.PathLike):
                return  # a file that is open already
            path = os.path.realpath(os.fsdecode(asked))
            permitted = settings.permits(path)
            if event == OPENING or not permitted:
                note(READ if permitted else REFUSED, path)
            if not permitted:
                raise PermissionError(f"{path}: sealed while physics is hidden")

    return watch


def main() -> None:
    """Install the hook and run the program with the remaining arguments."""
    given = json.loads(sys.argv.pop(1))
    settings = Settings(
        tuple(map(os.path.realpath, given["guarded"])), tuple(map(os.path.realpath, given["allowed"])), given["log"]
    )
    log = os.open(settings.log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_APPEND, 0o644)
    noted: set[tuple[str, str]] = set()

    def note(what: str, path: str) -> None:
        if (what, path) not in noted:
            noted.add((what, path))
            os.write(log, f"{what} {path}\n".encode())  # at once: a line that is written cannot be taken back

    sys.addaudithook(hook(settings, note))
    sys.argv[0] = str(Path(sys.executable))
    runpy.run_module("wipx", run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    main()
