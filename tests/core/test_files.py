"""Files are written whole or not at all, over what they replace and nothing else."""

from __future__ import annotations

import os
import signal
import stat
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from vibroimpact._core import files
from vibroimpact._core.checks import path_of
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.files import (
    check_target,
    draft_folder,
    only_writer,
    read_bytes,
    write_files,
)

LIMITED = """
import resource, sys
from pathlib import Path
from vibroimpact._core.files import write_files
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
try:
    write_files({Path(sys.argv[1]): b"new", Path(sys.argv[2]): bytes(5000)})
except ValueError as error:
    print(error)
"""


def in_child(program: str, *arguments: object) -> subprocess.CompletedProcess[str]:
    """Run a program in a process of its own."""
    words = [sys.executable, "-c", program, *map(str, arguments)]
    return subprocess.run(words, capture_output=True, text=True, check=False, timeout=60)


def names(folder: Path) -> list[str]:
    return sorted(os.listdir(folder))


# ---- whole or not at all ---------------------------------------------------------------------------


def test_a_full_disk_leaves_all_old_files_and_says_what_is_needed(tmp_path: Path) -> None:
    first, second = tmp_path / "first", tmp_path / "second"
    second.write_bytes(b"old")
    ended = in_child(LIMITED, first, second)
    assert ended.returncode == 0, ended.stderr
    assert f"path = {second}: cannot be written (File too large: 5000 bytes are" in ended.stdout
    assert "1000 are free" in ended.stdout
    assert names(tmp_path) == ["second"]
    assert second.read_bytes() == b"old"


def test_a_link_in_the_way_is_never_written_through(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    victim, target = tmp_path / "victim", tmp_path / "out.nc"
    victim.write_bytes(b"mine")
    draws = iter(["guessed", "free"])
    monkeypatch.setattr(files.secrets, "token_hex", lambda _: next(draws))
    (tmp_path / f"{files._prefix(target)}guessed").symlink_to(victim)
    with pytest.raises(InvalidParameterError, match="File exists"):
        write_files({target: b"new"})
    write_files({target: b"new"})
    assert victim.read_bytes() == b"mine"
    assert target.read_bytes() == b"new"


def test_threads_that_write_one_file_leave_the_content_of_one(tmp_path: Path) -> None:
    target, contents = tmp_path / "out", [bytes([i]) * 100_000 for i in range(18)]
    with ThreadPoolExecutor(6) as pool:
        list(pool.map(lambda content: write_files({target: content}), contents))
    assert target.read_bytes() in contents
    assert names(tmp_path) == ["out"]


WRITER = """
import sys
from pathlib import Path
from vibroimpact._core.files import write_files
print(flush=True)
while True:
    for content in (b"a", b"b"):
        write_files({Path(sys.argv[1]): content * 300_000})
"""


def test_a_killed_writer_leaves_old_or_new_content_and_the_next_one_tidies_up(
    tmp_path: Path,
) -> None:
    target = tmp_path / "out"
    for wait in (0.0, 0.003, 0.011):
        words = [sys.executable, "-c", WRITER, str(target)]
        with subprocess.Popen(words, stdout=subprocess.PIPE) as writer:
            assert writer.stdout is not None
            writer.stdout.readline()
            threading.Event().wait(0.02 + wait)
            writer.send_signal(signal.SIGKILL)
        if target.exists():
            assert target.read_bytes() in (b"a" * 300_000, b"b" * 300_000)
    (tmp_path / f"{files._prefix(target)}of-the-dead").write_bytes(b"half")
    write_files({target: b"c"})
    assert names(tmp_path) == ["out"]


def test_what_another_process_writes_now_is_left_alone(tmp_path: Path) -> None:
    target = tmp_path / "out"
    with draft_folder(target) as draft:
        write_files({target: b"new"})
        assert names(tmp_path) == sorted([draft.name, "out"])
    assert names(tmp_path) == ["out"]


HOLDER = """
import sys
from pathlib import Path
from vibroimpact._core.files import only_writer
with only_writer("store", Path(sys.argv[1])):
    print(flush=True)
    sys.stdin.read()
"""


@pytest.mark.parametrize("is_folder", [False, True])
def test_a_store_has_one_writer_and_its_lock_falls_with_the_process(
    is_folder: bool, tmp_path: Path
) -> None:
    store = tmp_path / "store"
    if is_folder:
        store.mkdir()
    words = [sys.executable, "-c", HOLDER, str(store)]
    with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as holder:
        assert holder.stdout is not None
        holder.stdout.readline()
        with (
            pytest.raises(InvalidParameterError, match="another process is writing to"),
            only_writer("store", store),
        ):
            pass
        holder.send_signal(signal.SIGKILL)
    with only_writer("store", store):
        if not is_folder:
            write_files({store: b"new"})  # what it has locked is not taken for left over
        with (
            pytest.raises(InvalidParameterError, match="another process"),
            only_writer("store", store),
        ):
            pass
    with only_writer("store", store):
        pass
    assert names(tmp_path) == ["store"]


# ---- the target ------------------------------------------------------------------------------------


def test_permissions_of_a_replaced_file_are_kept(tmp_path: Path) -> None:
    target, new = tmp_path / "secret", tmp_path / "new"
    target.write_bytes(b"old")
    target.chmod(0o600)
    write_files({target: b"new", new: b"new"})
    assert stat.S_IMODE(target.stat().st_mode) == 0o600
    mask = os.umask(0)
    os.umask(mask)
    assert stat.S_IMODE(new.stat().st_mode) == 0o666 & ~mask


def test_a_read_only_file_is_refused_before_and_at_writing(tmp_path: Path) -> None:
    target = tmp_path / "out.nc"
    target.write_bytes(b"old")
    target.chmod(0o444)
    with pytest.raises(InvalidParameterError, match="it is read-only"):
        check_target(target, (".nc",))
    with pytest.raises(InvalidParameterError, match="it is read-only"):
        write_files({target: b"new"})


def test_a_symbolic_link_is_followed_and_stays(tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    link, target = tmp_path / "link", tmp_path / "there" / "out"
    link.symlink_to(target)  # dangling first
    for content in (b"first", b"second"):
        write_files({link: content})
        assert link.is_symlink()
        assert target.read_bytes() == content
    assert names(tmp_path / "there") == ["out"]


def test_a_pipe_and_a_device_are_written_to_and_stay(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(InvalidParameterError, match="a pipe that nobody reads"):
        write_files({pipe: b"new"})
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    write_files({pipe: b"new"})
    assert os.read(reader, 10) == b"new"
    os.close(reader)
    assert pipe.is_fifo()
    (tmp_path / "full").symlink_to("/dev/full")
    with pytest.raises(InvalidParameterError, match="No space left on device"):
        write_files({tmp_path / "full": b"new"})


def test_a_name_as_long_as_a_file_system_has_can_be_written(tmp_path: Path) -> None:
    target = tmp_path / ("x" * 252 + ".nc")
    write_files({target: b"new"})
    assert names(tmp_path) == [target.name]


def test_a_tilde_is_a_home_in_every_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    assert path_of("path", "~/out.nc") == tmp_path / "out.nc"
    with pytest.raises(InvalidParameterError, match="~nobody-here is no user's home"):
        path_of("path", "~nobody-here/out.nc")


# ---- reading ---------------------------------------------------------------------------------------


def test_only_files_of_a_stated_size_are_read(tmp_path: Path) -> None:
    path = tmp_path / "in"
    path.write_bytes(b"12345")
    assert read_bytes("path", path, 5) == b"12345"
    with pytest.raises(InvalidParameterError, match="has 5 bytes; at most 4 are read"):
        read_bytes("path", path, 4)
    with pytest.raises(InvalidParameterError, match="Is a directory"):
        read_bytes("path", tmp_path, 4)
    os.mkfifo(tmp_path / "pipe")
    for endless in (tmp_path / "pipe", Path("/dev/zero")):
        with pytest.raises(InvalidParameterError, match="is a device or a pipe"):
            read_bytes("path", endless, 4)
