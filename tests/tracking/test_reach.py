"""What keeps runs from being logged is told in one line, before any work is done."""

import sqlite3
import threading
from collections.abc import Iterator
from contextlib import closing
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

import pytest

from wipx.core.errors import InputError
from wipx.tracking import reach
from wipx.tracking.reach import check_reachable


def database(path: Path, version: str) -> str:
    with closing(sqlite3.connect(path)) as made:
        made.execute("create table alembic_version (version_num text)")
        made.execute("insert into alembic_version values (?)", (version,))
        made.commit()
    return f"sqlite:///{path}"


@pytest.fixture(autouse=True)
def little_patience(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(reach, "PATIENCE", 0.2)


@pytest.fixture
def server() -> Iterator[str]:
    with HTTPServer(("127.0.0.1", 0), BaseHTTPRequestHandler) as http:  # answers every request with an error
        threading.Thread(target=http.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{http.server_port}"
        http.shutdown()


def test_a_database_that_does_not_exist_yet_and_one_of_the_installed_version_are_taken(tmp_path: Path):
    check_reachable(f"sqlite:///{tmp_path / 'runs' / 'mlflow.db'}")
    check_reachable(database(tmp_path / "mlflow.db", "451aebb31d03"))


def test_a_database_of_a_newer_version_is_refused(tmp_path: Path):
    with pytest.raises(InputError, match=r"newer MLflow \(database version ffff00001111\); upgrade mlflow"):
        check_reachable(database(tmp_path / "mlflow.db", "ffff00001111"))


def test_a_locked_database_is_refused(tmp_path: Path):
    uri = database(tmp_path / "mlflow.db", "451aebb31d03")
    with closing(sqlite3.connect(tmp_path / "mlflow.db")) as other:
        other.execute("begin exclusive")
        with pytest.raises(InputError, match="another program keeps the database locked"):
            check_reachable(uri)


def test_a_file_that_is_no_database_is_refused(tmp_path: Path):
    (tmp_path / "mlflow.db").write_text("x" * 2000)
    with pytest.raises(InputError, match="file is not a database"):
        check_reachable(f"sqlite:///{tmp_path / 'mlflow.db'}")


def test_a_server_that_answers_is_taken(server: str):
    check_reachable(server)


@pytest.mark.parametrize("uri", ["http://127.0.0.1:9", "http://no.such.host.invalid"])
def test_a_server_that_is_down_is_refused(uri: str):
    with pytest.raises(InputError, match=r"tracking\.uri http.*: no answer .*start the server"):
        check_reachable(uri)
