"""Files: written whole or not at all, read within limits. Every file of the package goes through here.

Method      Contents are whole in memory before anything is written. They go to a new file in the folder of the target,
            of a random name that nothing has, are forced to the disk, and the new file is renamed to the target. (1)
            The new file is locked while it is written. One that can be locked was left by a process that is gone,
            and is removed by the next writer of the same target.                                              (2)
Assumes     a file system on which a rename within a folder is atomic
Fails       InvalidParameterError with path and reason, and on a full disk with the sizes; the target is as it was
"""

from __future__ import annotations

import errno
import fcntl
import hashlib
import os
import resource
import secrets
import shutil
import stat
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from vibroimpact._core.checks import path_of
from vibroimpact._core.errors import InvalidParameterError

NO_ROOM = (errno.ENOSPC, errno.EFBIG, errno.EDQUOT)
CHUNK_BYTES = 2**24
WRITE_BITS = stat.S_IWUSR | stat.S_IWGRP | stat.S_IWOTH


# ---- writing ---------------------------------------------------------------------------------------


def check_target(path: Path, suffixes: tuple[str, ...], name: str = "out") -> None:
    """Refuse a file that could not be written, before anything is computed for it.

    Parameters
    ----------
    path
        The file to be written; an earlier one of that name will be replaced.
    suffixes
        Allowed suffixes.
    name
        Name of the argument or option.

    Raises
    ------
    InvalidParameterError
        A name that no file can have, another suffix, a folder of that name, a file that is read-only, a folder
        around it that is missing or unwritable.
    """
    path_of(name, path)
    if path.suffix.lower() not in suffixes:
        raise InvalidParameterError(
            f"{name} = {path}: must end in {', '.join(suffixes)}. The suffix decides the format."
        )
    _check_writable(name, path)


def _check_writable(name: str, path: Path) -> None:
    """Refuse a folder, a read-only file, and a folder around it in which nothing can be made."""
    if path.is_dir():
        raise InvalidParameterError(f"{name} = {path}: is a folder. Name a file.")
    if path.exists():
        if not path.stat().st_mode & WRITE_BITS or not os.access(path, os.W_OK):
            raise unwritable(name, path, "it is read-only")
        if not path.is_file():
            return  # a device or a pipe, which is written to where it is
    folder = Path(os.path.realpath(path)).parent
    if not folder.is_dir():
        raise InvalidParameterError(
            f"{name} = {path}: {folder if path.is_symlink() else path.parent} must be a folder. Make it first, or "
            "name another."
        )
    if not os.access(folder, os.W_OK | os.X_OK):
        raise unwritable(name, path, "no permission")


def unwritable(name: str, path: Path, reason: str) -> InvalidParameterError:
    """Error for a file that cannot be written, with the reason."""
    return InvalidParameterError(
        f"{name} = {path}: cannot be written ({reason}). Name a file in a folder that you may "
        "write."
    )


def write_files(contents: Mapping[Path, bytes], name: str = "path") -> None:
    """Write files, all of them or none, and each whole or not at all (1).

    A file that is replaced keeps its permissions. A symbolic link is followed, and stays. A device or a pipe is
    written to.

    Raises
    ------
    InvalidParameterError
        A file that cannot be written; on a full disk the message has the sizes.
    """
    with ExitStack() as drafts:
        ready = [
            drafts.enter_context(_draft(name, path, content)) for path, content in contents.items()
        ]
        for path, put in zip(contents, ready, strict=True):
            with _reasons(name, path, len(contents[path])):
                put()


@contextmanager
def _draft(name: str, path: Path, content: bytes) -> Iterator[Callable[[], None]]:
    """Write a content beside its target, and yield a function that puts it there."""
    _check_writable(name, path)
    if path.exists() and not path.is_file():
        yield lambda: _into(path, content)
        return
    target = Path(os.path.realpath(path))
    with _reasons(name, path, len(content)):
        handle, draft = _new_file(target)
    try:
        with _reasons(name, path, len(content)):
            _write_all(handle, content)
            os.fsync(handle)

        def put() -> None:
            draft.replace(target)
            _to_disk(target.parent)

        yield put
    finally:
        draft.unlink(missing_ok=True)
        os.close(handle)


def _new_file(target: Path) -> tuple[int, Path]:
    """Make a new file beside a target, with its permissions and locked, and return its handle and its name (2)."""
    _remove_left_over(target)
    kept = target.stat() if target.exists() else None
    while True:
        draft = target.with_name(_prefix(target) + secrets.token_hex(8))
        flags = os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC
        handle = os.open(draft, flags, 0o600 if kept else 0o666)
        _lock(handle, fcntl.LOCK_EX)
        if os.fstat(handle).st_nlink:  # else another writer took it for left over
            break
        os.close(handle)
    if kept:
        with suppress(PermissionError):
            os.fchown(handle, kept.st_uid, kept.st_gid)
        os.fchmod(handle, stat.S_IMODE(kept.st_mode))
    return handle, draft


def _prefix(target: Path) -> str:
    """Beginning of names of files that become a target: as long for any target."""
    return f".vibroimpact-{hashlib.sha256(os.fsencode(target.name)).hexdigest()[:16]}-"


def _remove_left_over(target: Path) -> None:
    """Remove what processes that are gone have left of earlier writes to a target (2)."""
    for one in target.parent.glob(f"{_prefix(target)}*"):
        with suppress(OSError):
            handle = os.open(one, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                shutil.rmtree(one) if one.is_dir() else one.unlink()
            finally:
                os.close(handle)


def _lock(handle: int, how: int) -> None:
    with suppress(OSError):  # a file system without locks: nothing is removed there
        fcntl.flock(handle, how)


def _into(path: Path, content: bytes) -> None:
    """Write to a device or a pipe; a pipe that nobody reads is refused."""
    handle = os.open(path, os.O_WRONLY | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC)
    try:
        os.set_blocking(handle, True)
        _write_all(handle, content)
    finally:
        os.close(handle)


def _write_all(handle: int, content: bytes) -> None:
    left = memoryview(content)
    while left:
        left = left[os.write(handle, left) :]


@contextmanager
def _reasons(name: str, path: Path, wanted: int) -> Iterator[None]:
    """Make an error of the system one of ours."""
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        if error.errno in NO_ROOM:
            reason = f"{reason}: {wanted} bytes are needed, {_free(path)} are free"
        elif error.errno == errno.ENXIO:
            reason = "it is a pipe that nobody reads"
        raise unwritable(name, path, reason) from error


def _free(path: Path) -> int:
    """Bytes that a new file may have."""
    most = resource.getrlimit(resource.RLIMIT_FSIZE)[0]
    free = shutil.disk_usage(Path(os.path.realpath(path)).parent).free
    return free if most == resource.RLIM_INFINITY else min(free, most)


def _to_disk(place: Path) -> None:
    """Force a file, or the names in a folder, to the disk."""
    with suppress(OSError):  # some file systems have nothing to force of a folder
        handle = os.open(place, os.O_RDONLY | os.O_CLOEXEC)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


@contextmanager
def draft_folder(target: Path) -> Iterator[Path]:
    """Make a new folder beside a target, which is renamed to it inside, or removed at the end (2)."""
    _remove_left_over(target)
    draft = target.with_name(_prefix(target) + secrets.token_hex(8))
    draft.mkdir()
    handle = os.open(draft, os.O_RDONLY | os.O_CLOEXEC)
    try:
        _lock(handle, fcntl.LOCK_EX)
        yield draft
    finally:
        os.close(handle)
        shutil.rmtree(draft, ignore_errors=True)


@contextmanager
def only_writer(name: str, path: Path) -> Iterator[None]:
    """Be the only process that writes to a store, a file or a folder, until the end, however that comes.

    What is locked is the folder itself, or a file beside a file, which may be replaced meanwhile. The lock falls with
    the process; a file that it leaves is removed by the next writer (2).

    Raises
    ------
    InvalidParameterError
        Another process, or another call, is writing to it.
    """
    lock = path if path.is_dir() else _lock_beside(Path(os.path.realpath(path)))
    flags = os.O_RDONLY if path.is_dir() else os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW
    with _reasons(name, path, 0):
        handle = os.open(lock, flags | os.O_CLOEXEC, 0o600)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            is_lost = not os.fstat(handle).st_nlink  # the one before has just ended, and removed it
        except BlockingIOError:
            is_lost = True
        except OSError:  # a file system without locks
            is_lost = False
        if is_lost:
            raise InvalidParameterError(
                f"{name} = {str(path)!r}: another process is writing to it. Wait for it, or end it."
            )
        try:
            yield
        finally:
            if lock != path:
                lock.unlink(missing_ok=True)
    finally:
        os.close(handle)


def _lock_beside(target: Path) -> Path:
    return target.with_name(f"{_prefix(target)}lock")


# ---- reading ---------------------------------------------------------------------------------------


def read_bytes(name: str, path: Path, most: int, advice: str = "") -> bytes:
    """Content of a file, unless it has more bytes than ``most``.

    Raises
    ------
    InvalidParameterError
        No file, or one that may not be read; a folder, a device, a pipe; a file that is too large.
    """
    more = advice and f" {advice}"
    try:
        handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC)
        try:
            about = os.fstat(handle)
            if stat.S_ISDIR(about.st_mode):
                raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
            if not stat.S_ISREG(about.st_mode):
                raise InvalidParameterError(
                    f"{name} = {path}: is a device or a pipe, which has no size. Copy its content to a file first."
                )
            content = bytearray()
            while about.st_size <= most and (part := os.read(handle, CHUNK_BYTES)):
                content += part
                if len(content) > most:
                    break
        finally:
            os.close(handle)
    except OSError as error:
        raise InvalidParameterError(
            f"{name} = {path}: cannot be read ({error.strerror}).{more}"
        ) from error
    size = max(about.st_size, len(content))
    if size > most:
        raise InvalidParameterError(
            f"{name} = {path}: has {size} bytes; at most {most} are read.{more}"
        )
    return bytes(content)
