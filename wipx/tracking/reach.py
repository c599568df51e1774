"""Whether the place where runs are logged can be used, found out without importing mlflow."""

import importlib.util
import os
import sqlite3
import urllib.error
import urllib.request
from contextlib import closing
from pathlib import Path

from wipx.core.errors import InputError

SQLITE = "sqlite:///"
PATIENCE = 5.0  # [s] for a server to answer, or for a database to be free
REMEDY = "or log afterwards with tracking.later=true and task=log_runs"


def check_reachable(uri: str) -> None:
    """Refuse a tracking store that cannot take runs.

    Args:
        uri: sqlite:///FILE or http(s)://SERVER; others are left to mlflow.

    Raises:
        InputError: the server does not answer; the database is locked, damaged, of a newer version or cannot be
            written.
    """
    if uri.startswith(SQLITE):
        _check_database(Path(uri.removeprefix(SQLITE)))
    elif uri.startswith(("http://", "https://")):
        _check_server(uri)


def _check_server(uri: str) -> None:
    try:
        with urllib.request.urlopen(f"{uri.rstrip('/')}/health", timeout=PATIENCE):
            return
    except urllib.error.HTTPError:
        return  # something answers; what it refuses, mlflow explains
    except (OSError, ValueError) as error:
        reason = getattr(error, "reason", error)
        raise InputError(
            f"tracking.uri {uri}: no answer ({reason}); start the server, correct the address, {REMEDY}"
        ) from error


def _check_database(path: Path) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise _unwritable(path.parent, error.strerror or str(error)) from error
    if not os.access(path.parent, os.W_OK):
        raise _unwritable(path.parent, "no permission to write")
    if not path.is_file():
        return
    try:
        with closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=rw", uri=True, timeout=PATIENCE)) as database:
            database.execute("begin immediate")
            table = database.execute("select name from sqlite_master where name = 'alembic_version'").fetchone()
            version = table and database.execute("select version_num from alembic_version").fetchone()
            database.rollback()
    except sqlite3.OperationalError as error:
        if "locked" in str(error):
            raise InputError(
                f"{path}: another program keeps the database locked; wait for it or end it, {REMEDY}"
            ) from error
        raise _unwritable(path, str(error)) from error
    except sqlite3.DatabaseError as error:
        raise InputError(f"{path}: {error}; give another tracking.folder=FOLDER or tracking.uri=...") from error
    if version and version[0] not in _known_versions():
        raise InputError(
            f"{path}: written by a newer MLflow (database version {version[0]}); upgrade mlflow, give another "
            f"tracking.folder=FOLDER, {REMEDY}"
        )


def _unwritable(path: Path, reason: str) -> InputError:
    return InputError(
        f"{path}: runs cannot be logged here ({reason}); choose another with tracking.folder=FOLDER, or tracking=none"
    )


def _known_versions() -> set[str]:
    """Versions of the database that the installed MLflow knows: its migrations, one file each."""
    spec = importlib.util.find_spec("mlflow")
    places = spec.submodule_search_locations if spec is not None and spec.submodule_search_locations else []
    files = [file for place in places for file in Path(place).glob("store/db_migrations/versions/*.py")]
    return {file.name.partition("_")[0] for file in files}
