"""`task=dashboard`: MLflow in a browser, with columns, charts and links prepared."""

import signal
import webbrowser
from dataclasses import dataclass
from pathlib import Path

from wipx.core.errors import InputError
from wipx.tasks.shared.job import Job


@dataclass(frozen=True)
class Dashboard:
    """Show the local database of runs.

    Attributes:
        folder: Holds mlflow.db.
        port: Of the server, on this machine only.
        browser: Whether a browser is opened.
    """

    folder: str = "runs"
    port: int = 5000
    browser: bool = True

    def __post_init__(self) -> None:
        if not 1024 <= self.port <= 65535:
            raise InputError(f"task.port is {self.port}, expected 1024 to 65535")

    def run(self, job: Job) -> None:
        """Prepare the views, start MLflow's server, open the latest runs; until Ctrl-C."""
        from wipx.tracking.dashboard import prepare, served

        addresses = prepare(Path(self.folder))
        with served(Path(self.folder), self.port) as server:
            for name, address in addresses.items():
                print(f"{name}: {server}/#{address}")
            print("Ctrl-C ends it", flush=True)
            if self.browser and addresses:
                webbrowser.open(f"{server}/#{next(iter(addresses.values()))}")
            signal.signal(signal.SIGTERM, signal.default_int_handler)  # ends MLflow's server too
            try:
                signal.pause()
            except KeyboardInterrupt:
                print("ended")
