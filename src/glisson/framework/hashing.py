"""Content hashes: whether something is the same as before."""

import hashlib
from functools import cache, lru_cache
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

_BLOCK = 1 << 20
_NAME = "blake2b-128"


def content_hash(path: Path) -> str:
    """Hash of a file's bytes, or of a folder's file names and bytes (hidden files left out)."""
    if path.is_file():
        return f"{_NAME}:{_file_digest(path).hex()}"
    digest = hashlib.blake2b(digest_size=16)
    for entry in sorted(path.rglob("*")):
        inside = entry.relative_to(path)
        if entry.is_file() and not any(part.startswith(".") for part in inside.parts):
            digest.update(inside.as_posix().encode() + b"\0" + _file_digest(entry))
    return f"{_NAME}:{digest.hexdigest()}"


@cache
def source_hash(*packages: str) -> str:
    """Hash of the source and data files of packages or modules by their import names ("glisson.core", …)."""
    digest = hashlib.blake2b(digest_size=16)
    for name in packages:
        file = import_module(name).__file__
        if file is None:
            continue
        module = Path(file)
        root = module.parent if module.name == "__init__.py" else module
        for entry in sorted(root.rglob("*")) if root.is_dir() else [root]:
            if entry.is_file() and "__pycache__" not in entry.parts:
                digest.update(entry.relative_to(root.parent).as_posix().encode() + b"\0" + _file_digest(entry))
    return f"{_NAME}:{digest.hexdigest()}"


def package_version(name: str) -> str | None:
    """Version of an installed distribution, None where it is absent."""
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def _file_digest(path: Path) -> bytes:
    status = path.stat()
    return _digest(path, status.st_ino, status.st_size, status.st_mtime_ns)


@lru_cache(maxsize=4096)
def _digest(path: Path, inode: int, size: int, modified_ns: int) -> bytes:
    # A scan is asked for several times in one run; it is read again only when it is another file.
    digest = hashlib.blake2b(digest_size=16)
    with path.open("rb") as stream:
        while block := stream.read(_BLOCK):
            digest.update(block)
    return digest.digest()
