"""Put the verdicts of a reproduction into docs/reproduction.md.

make reproduce && python tools/verdicts_page.py reproduction/verdicts.json
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

PAGE = Path(__file__).resolve().parents[1] / "docs" / "reproduction.md"
BEGIN, END = "<!-- verdicts: filled from verdicts.json -->", "<!-- end of verdicts -->"
SHOWN = [  # one claim of each kind for each parameter set
    *("a-critical-omega", "b-critical-omega", "c-critical-omega"),
    *("a-lambda-12", "b-fourth-power", "c-second-power"),
    *("a-stable-interval", "a-caption-2a", "a-caption-2e", "a-caption-2l"),
    *(
        "b-caption-4a",
        "b-caption-4d",
        "b-caption-4f",
        "c-caption-5a",
        "c-caption-5b",
        "c-caption-5f",
    ),
    *("b-strong-case", "c-near-resonance", "s6-periodic", "s6-route"),
]


def row(verdict: dict[str, Any]) -> str:
    """One line of the table."""
    where = verdict["id"].split("-")[-1] if "caption" in verdict["id"] else verdict["section"]
    cells = [
        f"{verdict['set'] or 'all'}, {where}",
        verdict["quote"],
        verdict["computed"],
        verdict["verdict"],
    ]
    return "| " + " | ".join(str(cell).replace("|", r"\|") for cell in cells) + " |"


def section(data: dict[str, Any]) -> str:
    """What stands between the marks."""
    by_id = {verdict["id"]: verdict for verdict in data["verdicts"]}
    counts = ", ".join(f"{n} {what}" for what, n in data["count"].items())
    lines = [
        f"{len(by_id)} claims: {counts}. {len(data['misprints'])} misprinted equations are listed "
        "with their corrected form.",
        "",
        "| set, place | printed | computed | verdict |",
        "|---|---|---|---|",
        *(row(by_id[name]) for name in SHOWN),
    ]
    return "\n".join(lines)


def main(path: str) -> None:
    """Rewrite the marked part of the page."""
    text = PAGE.read_text(encoding="utf-8")
    head, rest = text.split(BEGIN)
    tail = rest.split(END)[1]
    data = json.loads(Path(path).read_text(encoding="utf-8"))
    PAGE.write_text(f"{head}{BEGIN}\n{section(data)}\n{END}{tail}", encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1])
