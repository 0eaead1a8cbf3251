"""Tables as .xlsx files of one sheet: ECMA-376, "SpreadsheetML", written without a library.

Numbers have all their digits; NaN is an empty cell, an infinity a word. The same table gives the same bytes.
"""

from __future__ import annotations

import math
import re
from io import BytesIO
from xml.sax.saxutils import escape
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

import numpy as np

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.lazy import pd

MOST_ROWS, MOST_COLUMNS = 2**20, 2**14  # of a sheet
CONTROLS = re.compile(
    r"[\x00-\x08\x0b\x0c\x0e-\x1f\ufffe\uffff]"
)  # characters that XML cannot hold
HEAD = '<?xml version="1.0" encoding="UTF-8" standalone="yes"?>'
MAIN = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
PACKAGE = "http://schemas.openxmlformats.org/package/2006"
OFFICE = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
TYPE = "application/vnd.openxmlformats-officedocument.spreadsheetml"
PARTS = {
    "[Content_Types].xml": f'<Types xmlns="{PACKAGE}/content-types">'
    '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    f'<Override PartName="/xl/workbook.xml" ContentType="{TYPE}.sheet.main+xml"/>'
    f'<Override PartName="/xl/worksheets/sheet1.xml" ContentType="{TYPE}.worksheet+xml"/></Types>',
    "_rels/.rels": f'<Relationships xmlns="{PACKAGE}/relationships">'
    f'<Relationship Id="rId1" Type="{OFFICE}/officeDocument" Target="xl/workbook.xml"/></Relationships>',
    "xl/workbook.xml": f'<workbook xmlns="{MAIN}" xmlns:r="{OFFICE}">'
    '<sheets><sheet name="result" sheetId="1" r:id="rId1"/></sheets></workbook>',
    "xl/_rels/workbook.xml.rels": f'<Relationships xmlns="{PACKAGE}/relationships">'
    f'<Relationship Id="rId1" Type="{OFFICE}/worksheet" Target="worksheets/sheet1.xml"/></Relationships>',
}


def xlsx_of(table: pd.DataFrame) -> bytes:
    """Content of a file of a table: the names of its columns, then its rows.

    Raises
    ------
    InvalidParameterError
        More rows or columns than a sheet has.
    """
    if len(table) >= MOST_ROWS or table.shape[1] > MOST_COLUMNS:
        raise InvalidParameterError(
            f"a table of {len(table)} rows and {table.shape[1]} columns: a sheet has room for {MOST_ROWS - 1} and "
            f"{MOST_COLUMNS}. Write .csv or .nc."
        )
    rows = [
        [str(name) for name in table.columns],
        *zip(*(table[c].tolist() for c in table), strict=True),
    ]
    lines = "".join(f"<row>{''.join(map(_cell, row))}</row>" for row in rows)
    sheet = f'<worksheet xmlns="{MAIN}"><sheetData>{lines}</sheetData></worksheet>'
    content = BytesIO()
    with ZipFile(content, "w") as archive:
        for name, text in (PARTS | {"xl/worksheets/sheet1.xml": sheet}).items():
            archive.writestr(
                ZipInfo(name), f"{HEAD}{text}".encode(), ZIP_DEFLATED
            )  # without a date
    return content.getvalue()


def _cell(value: object) -> str:
    """A cell with a number, a truth or a text."""
    plain = value.item() if isinstance(value, np.generic) else value
    if isinstance(plain, bool):
        return f'<c t="b"><v>{int(plain)}</v></c>'
    if isinstance(plain, int | float) and math.isfinite(plain):
        return f"<c><v>{plain!r}</v></c>"
    if plain is None or (isinstance(plain, float) and math.isnan(plain)):
        return "<c/>"
    text = escape(CONTROLS.sub("", str(plain)))
    return f'<c t="inlineStr"><is><t xml:space="preserve">{text}</t></is></c>'
