"""What a scene is made of, as one short text: equal scenes have equal fingerprints, on every machine."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from tyndall.prims import Prim

_DIGEST_BYTES = 16


def fingerprint(prims: Mapping[str, Prim]) -> str:
    """Return the fingerprint of `prims` by path; of files they name, the content counts and not the place."""
    digest = hashlib.blake2b(digest_size=_DIGEST_BYTES)
    for path in sorted(prims):
        _add(digest, path, names_files=False)
        _add(digest, prims[path], names_files=True)
    return digest.hexdigest()


def _add(digest: hashlib.blake2b, value: object, *, names_files: bool) -> None:
    """Add `value` behind its type and length, so that no two values give the same bytes."""
    if isinstance(value, np.ndarray):
        _add_bytes(digest, f"array {value.dtype.str} {value.shape}", value.tobytes())
    elif isinstance(value, str):
        content = _file_digest(value) if names_files else None
        _add_bytes(digest, "text" if content is None else "file", content or value.encode())
    elif is_dataclass(value):
        _add_bytes(digest, "prim", type(value).__name__.encode())
        for field in fields(value):
            _add(digest, getattr(value, field.name), names_files=names_files)
    elif isinstance(value, Mapping):
        _add_bytes(digest, "mapping", str(len(value)).encode())
        for key in sorted(value):
            _add(digest, key, names_files=False)
            _add(digest, value[key], names_files=names_files)
    elif isinstance(value, Sequence):
        _add_bytes(digest, "sequence", str(len(value)).encode())
        for item in value:
            _add(digest, item, names_files=names_files)
    else:
        _add_bytes(digest, type(value).__name__, repr(value).encode())


def _add_bytes(digest: hashlib.blake2b, kind: str, content: bytes) -> None:
    digest.update(f"{kind} {len(content)}:".encode())
    digest.update(content)


def _file_digest(text: str) -> bytes | None:
    """Return what is in the file called `text`; ``None`` if there is none that can be read."""
    try:
        if not text.startswith("/") and not Path(text).is_file():
            return None
        with Path(text).open("rb") as file:
            return hashlib.file_digest(file, lambda: hashlib.blake2b(digest_size=_DIGEST_BYTES)).digest()
    except (OSError, ValueError):
        return None
