"""Sealing what a diagnosis must not know, and noticing when anything was changed afterwards.

A commit-and-reveal protocol: the digest of salt and content is published before the first diagnosis, so that the
content cannot be chosen to fit the answers; the salt keeps it from being guessed from the digest; the content is
encrypted (Fernet: AES-128-CBC with HMAC-SHA256) with a key of the case's own, which is revealed after the answers.
"""

import hashlib
import json
import secrets
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cryptography.fernet import Fernet, InvalidToken

from wipx.core.errors import InputError

SALT_LENGTH = 32  # bytes


@dataclass(frozen=True)
class Commitment:
    """What is published of a case.

    Attributes:
        case: Its name.
        sealed: SHA-256 of salt and content, hexadecimal.
        recordings: SHA-256 of the visible files, see `digest`.
    """

    case: str
    sealed: str
    recordings: str


@dataclass(frozen=True)
class Sealed:
    """A case after sealing.

    Attributes:
        token: The encrypted content.
        key: Opens it; never on disk beside a diagnosis that runs.
        commitment: What is published.
    """

    token: bytes
    key: str
    commitment: Commitment


def seal(case: str, visible: Mapping[str, str], content: Mapping[str, object]) -> Sealed:
    """Encrypt the content with a fresh key and commit to it.

    Args:
        case: Name of the case.
        visible: Texts of the files that the diagnosis reads, by name.
        content: What it must not read; what JSON can hold.
    """
    plain = secrets.token_bytes(SALT_LENGTH) + json.dumps({"case": case, **content}).encode("utf-8")
    key = Fernet.generate_key()
    commitment = Commitment(
        case, hashlib.sha256(plain).hexdigest(), digest({name: text.encode("utf-8") for name, text in visible.items()})
    )
    return Sealed(Fernet(key).encrypt(zlib.compress(plain)), key.decode("ascii"), commitment)


def unseal(path: Path, key: str, commitment: Commitment) -> dict[str, Any]:
    """The content of a sealed file, checked against its commitment.

    Raises:
        InputError: the file is missing, it or its key was changed, or it is not what was committed to.
    """
    try:
        plain = zlib.decompress(Fernet(key.encode("ascii")).decrypt(path.read_bytes()))
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); restore it") from error
    except (InvalidToken, ValueError, zlib.error) as error:
        raise InputError(
            f"{path}: does not open with the key of {commitment.case}: the seal or the key was changed; restore both"
        ) from error
    if hashlib.sha256(plain).hexdigest() != commitment.sealed:
        raise InputError(f"{path}: not what commitments.json commits to for {commitment.case}; restore both files")
    return json.loads(plain[SALT_LENGTH:])


def digest(files: Mapping[str, bytes]) -> str:
    """SHA-256 of names and contents, hexadecimal; the order of the files does not matter."""
    whole = hashlib.sha256()
    for name in sorted(files):
        for part in (name.encode("utf-8"), files[name]):
            whole.update(len(part).to_bytes(8, "big"))  # so that no two sets of files run together alike
            whole.update(part)
    return whole.hexdigest()


def digest_of_folder(folder: Path) -> str:
    """`digest` of all files below a folder, by their relative paths."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return digest({path.relative_to(folder).as_posix(): path.read_bytes() for path in files})
