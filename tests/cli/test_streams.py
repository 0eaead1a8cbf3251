"""What the command line prints into pipes, full disks and closed streams: a sentence or silence, never a traceback."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from vibroimpact.cli.main import FAILED, MISUSE, PIPE_CLOSED, main

SIMULATE = ["simulate", "impact-damper/A", "--omega", "1.2", "--impacts", "3"]
VERSION = ["--version"]


@pytest.mark.parametrize(
    ("words", "redirected", "status", "said"),
    [
        (VERSION, ">/dev/full", FAILED, "vibroimpact: cannot write (No space left on device).\n"),
        (VERSION, ">&-", FAILED, "vibroimpact: standard output is closed. Nothing was computed.\n"),
        (SIMULATE, " --out $'x\\xff.nc' 2>&- >/dev/null", 0, ""),
        (VERSION, "| true; exit ${PIPESTATUS[0]}", PIPE_CLOSED, ""),
    ],
)
def test_a_stream_that_takes_nothing_ends_the_command_in_a_sentence_or_silence(
    words: list[str], redirected: str, status: int, said: str, tmp_path: Path
) -> None:
    ended = subprocess.run(
        ["bash", "-c", f"{sys.executable} -m vibroimpact {' '.join(words)} {redirected}"],
        cwd=tmp_path, capture_output=True, text=True, check=False,
        env=os.environ | {"MPLBACKEND": "bogus", "PYTHONIOENCODING": "ascii"},
    )  # fmt: skip
    assert (ended.returncode, ended.stderr) == (status, said)


def test_one_file_given_twice_is_refused_first(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main([*SIMULATE, "--out", "a.nc", "--out", f"{tmp_path}/a.nc"]) == MISUSE
    assert "a.nc: is given twice" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_name_of_250_bytes_is_written(tmp_path: Path) -> None:
    path = tmp_path / ("x" * 247 + ".nc")
    assert main([*SIMULATE, "--out", str(path)]) == 0
    assert path.is_file()
