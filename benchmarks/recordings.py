"""Reading a long log, every cell checked, beside pandas, which does not say where a cell is at fault."""

import tempfile
from pathlib import Path

import numpy as np
import pandas as pd
from timing import interleaved, print_table

from wipx.recordings.tables import open_table

ROWS, COLUMNS = 30_000, 12  # 46 s at 650 Hz
ROUNDS = 7
BAR = 1.0  # [s]


def measure_recordings() -> dict[str, float]:
    """Processor time of reading one log from CSV and Parquet, printed and returned by what reads it [s]."""
    columns = {f"c{i}": values for i, values in enumerate(np.random.default_rng(1).normal(size=(COLUMNS, ROWS)))}
    with tempfile.TemporaryDirectory() as folder:
        text, binary = Path(folder, "r.csv"), Path(folder, "r.parquet")
        pd.DataFrame(columns).to_csv(text, index=False, float_format="%.7f")
        pd.DataFrame(columns).to_parquet(binary)
        timings = interleaved(
            {
                "wipx, CSV": lambda: read(text),
                "pandas, CSV": lambda: pd.read_csv(text),
                "wipx, Parquet": lambda: read(binary),
                "pandas, Parquet": lambda: pd.read_parquet(binary),
            },
            ROUNDS,
        )
    print_table(
        f"Reading a log of {ROWS} rows and {COLUMNS} columns; bar {BAR:g} s",
        ("reader", "processor s"),
        [(name, f"{timing.median:.3f}") for name, timing in timings.items()],
    )
    return {name: timing.median for name, timing in timings.items()}


def read(path: Path) -> None:
    """All columns of a table as numbers."""
    table = open_table(path)
    for name in table.names:
        table.column(name)


if __name__ == "__main__":
    measure_recordings()
