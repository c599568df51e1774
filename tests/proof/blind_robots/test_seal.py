"""Seals open with their key alone, and any change of them is noticed."""

from dataclasses import replace
from pathlib import Path

import pytest
from cryptography.fernet import Fernet

from wipx.core.errors import InputError
from wipx.proof.blind_robots.seal import Sealed, digest, digest_of_folder, seal, unseal

VISIBLE = {"robot.yaml": "plant: wip\n", "r1.csv": "t,x\n0,1\n"}
SECRET = {"truth": {"effects": ["pitch/viscous"]}, "seed": 2**100}


@pytest.fixture
def sealed(tmp_path: Path) -> tuple[Sealed, Path]:
    one = seal("case0001", VISIBLE, SECRET)
    path = tmp_path / "case0001.seal"
    path.write_bytes(one.token)
    return one, path


def test_a_seal_gives_back_what_was_sealed(sealed: tuple[Sealed, Path]):
    one, path = sealed
    assert unseal(path, one.key, one.commitment) == {"case": "case0001", **SECRET}


def test_equal_contents_have_unequal_commitments():
    first, second = seal("case0001", VISIBLE, SECRET), seal("case0001", VISIBLE, SECRET)
    assert first.commitment.sealed != second.commitment.sealed
    assert first.commitment.recordings == second.commitment.recordings


def test_nothing_of_the_content_stands_in_the_seal(sealed: tuple[Sealed, Path]):
    assert b"viscous" not in sealed[0].token


def test_a_changed_seal_is_noticed(sealed: tuple[Sealed, Path]):
    one, path = sealed
    path.write_bytes(one.token[:-4] + b"AAA=")
    with pytest.raises(InputError, match=r"case0001\.seal: does not open"):
        unseal(path, one.key, one.commitment)


@pytest.mark.parametrize("key", [Fernet.generate_key().decode(), "no key", ""], ids=("another", "none", "empty"))
def test_another_key_is_noticed(sealed: tuple[Sealed, Path], key: str):
    one, path = sealed
    with pytest.raises(InputError, match="the seal or the key was changed"):
        unseal(path, key, one.commitment)


def test_another_seal_with_its_own_key_is_noticed(sealed: tuple[Sealed, Path]):
    one, path = sealed
    other = seal("case0001", VISIBLE, {"truth": {"effects": []}})
    path.write_bytes(other.token)
    with pytest.raises(InputError, match=r"not what commitments\.json commits to"):
        unseal(path, other.key, replace(other.commitment, sealed=one.commitment.sealed))


def test_a_digest_tells_names_and_contents_apart(tmp_path: Path):
    assert digest({"a": b"bc", "d": b""}) == digest({"d": b"", "a": b"bc"})
    assert digest({"a": b"bc"}) != digest({"ab": b"c"})
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "a").write_bytes(b"bc")
    assert digest_of_folder(tmp_path) == digest({"sub/a": b"bc"})
