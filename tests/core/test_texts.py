"""Texts that are made to do harm, or that editors make, end in a sentence at once."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact._core.errors import printable
from vibroimpact._core.texts import MOST_TOML_BYTES, json_of
from vibroimpact.machines.json_text import system_of
from vibroimpact.machines.toml_file import MECHANISM, TABLES, read_case

OSCILLATOR = """
[impact-oscillator]
omega = 0.8
zeta = 0.05
restitution = 0.7
clearance = 0.5
force = 1.0
"""
HOSTILE = {
    "depth": ("x = " + "[" * 100_000, "nested too deeply"),
    "tables": ("x = " + "{a=" * 100_000, "nested too deeply"),
    "digits": ("x = " + "9" * 5_000, "is not valid TOML"),
    "a long key": (".".join("a" * 100_000) + " = 1", "a key of too many parts"),
    "a long name of a table": ("[" + ".".join(["'a'"] * 100_000) + "]", "a key of too many parts"),
    "size": ("#" * (MOST_TOML_BYTES + 1), f"at most {MOST_TOML_BYTES} are read"),
    "a list for a kind": ("[mechanism]\nelements = [{kind = ['rigid_stop']}]", "kind = "),
    "control characters": ('[hybrid]\n"\\u001b[31mred" = 1', r"\\x1b\[31mred"),
    "no text": ("\udcff", "is not UTF-8 text"),
}


@pytest.mark.parametrize(("text", "said"), HOSTILE.values(), ids=HOSTILE)
def test_a_hostile_description_of_a_machine_ends_in_a_sentence(
    text: str, said: str, tmp_path: Path
) -> None:
    path = tmp_path / "case.toml"
    path.write_text(text, encoding="utf-8", errors="surrogateescape")
    with pytest.raises(vi.InvalidParameterError, match=said) as told:
        read_case(path)
    assert printable(str(told.value)) == str(told.value)


@pytest.mark.parametrize("table", [*TABLES, "start"])
@pytest.mark.parametrize("key", ["self", "cls", "args", "given", "make"])
def test_no_key_of_a_table_is_taken_for_something_else(
    table: str, key: str, tmp_path: Path
) -> None:
    path = tmp_path / "case.toml"
    whole = OSCILLATOR if table == "start" else ""
    path.write_text(f"{whole}[{table}]\n{key} = 1\n", encoding="utf-8")
    with pytest.raises(vi.InvalidParameterError, match=f"{key}: is no argument|{key}.*{MECHANISM}"):
        read_case(path)


def test_a_mark_of_the_byte_order_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / "case.toml"
    path.write_text(OSCILLATOR, encoding="utf-8-sig")
    assert read_case(path).system.omega == 0.8  # type: ignore[union-attr]


def test_pipes_and_devices_are_refused_where_a_text_is_wanted(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", Path("/dev/zero")):
        for read in (read_case, vi.ForceRecord.from_csv):
            with pytest.raises(vi.InvalidParameterError, match="is a device or a pipe"):
                read(path)


JSON = ("[" * 100_000, "1" * 5_000, '{"a": ', None, b"{}")


@pytest.mark.parametrize("text", JSON)
def test_json_that_the_package_does_not_write_ends_in_a_sentence(text: object) -> None:
    for read in (system_of, lambda text: json_of("call", text)):
        with pytest.raises(vi.InvalidParameterError):
            read(text)


@pytest.mark.parametrize("text", ["{}", "[]", "1", '{"type": []}', '{"type": "Mechanism"}'])
def test_json_of_no_system_ends_in_a_sentence(text: str) -> None:
    with pytest.raises(vi.InvalidParameterError, match="system: "):
        system_of(text)


def test_a_dataset_does_not_say_where_a_sweep_of_it_is_kept(tmp_path: Path) -> None:
    system = vi.ImpactOscillator(
        omega=0.8, zeta=0.05, restitution=0.7, clearance=0.5, force=1.0
    )  # fmt: skip
    found = vi.sweep(
        system, over={"omega": np.array([0.8, 0.9])}, start=vi.State((0.0,), (0.0,)),
        settle_periods=1, periods=1, progress=False,
    )  # fmt: skip
    store = tmp_path / "kept.zarr"
    found.attrs["call"] = f'{{"store": "{store}"}}'
    with pytest.raises(vi.InvalidParameterError, match="store: is never written down"):
        vi.rerun_sweep(found, progress=False)
    assert not store.exists()


def test_what_a_terminal_would_obey_is_shown_as_an_escape() -> None:
    assert str(vi.InvalidParameterError("a\x1b[2J\udcffb\n")) == "a\\x1b[2J\\udcffb\n"
