"""Spreadsheets hold the table of a result: each number with all its digits, words as they are."""

from __future__ import annotations

import io
import math
import zipfile
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest

import vibroimpact as vi
from vibroimpact.results import spreadsheet
from vibroimpact.results.spreadsheet import xlsx_of

NAMES = {"main": "http://schemas.openxmlformats.org/spreadsheetml/2006/main"}


def read(content: bytes) -> list[list[object]]:
    """Cells of the sheet, read as ECMA-376 (18.3.1.4) says what they hold."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        assert archive.testzip() is None
        parts = {
            name: ElementTree.fromstring(archive.read(name))  # noqa: S314 - our own
            for name in archive.namelist()
        }
    rows: list[list[object]] = []
    for row in parts["xl/worksheets/sheet1.xml"].iterfind("main:sheetData/main:row", NAMES):
        rows.append([])
        for cell in row:
            value = cell.findtext("main:v", None, NAMES)
            text = cell.findtext("main:is/main:t", None, NAMES)
            kind = cell.get("t", "n")
            held: dict[str, object] = {
                "inlineStr": text,
                "b": value == "1",
                "n": float(value) if kind == "n" and value else None,
            }
            rows[-1].append(held[kind])
    return rows


def test_a_sheet_holds_the_table_to_the_last_bit() -> None:
    numbers = np.array([0.1 + 0.2, 1e-308, -5e300, math.nan, math.inf])
    table = pd.DataFrame({
        "x [m]": numbers, "n": np.arange(5), "ok": [True, False, True, False, True],
        "word": ["1-1-1", "<b> & \"q\"", " two\nlines ", "\x07bell", None],
    })  # fmt: skip
    head, *rows = read(xlsx_of(table))
    assert head == ["x [m]", "n", "ok", "word"]
    assert [row[0] for row in rows] == [*numbers[:3].tolist(), None, "inf"]
    assert [row[1] for row in rows] == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert [row[2] for row in rows] == [True, False, True, False, True]
    assert [row[3] for row in rows] == ["1-1-1", '<b> & "q"', " two\nlines ", "bell", None]
    assert xlsx_of(table) == xlsx_of(table)


def test_more_rows_than_a_sheet_has_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(spreadsheet, "MOST_ROWS", 3)
    xlsx_of(pd.DataFrame({"a": [1, 2]}))
    with pytest.raises(vi.InvalidParameterError, match=r"room for 2 .*Write \.csv or \.nc"):
        xlsx_of(pd.DataFrame({"a": [1, 2, 3]}))
