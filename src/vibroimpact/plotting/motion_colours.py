"""Colours of motions: the same for a symbol n-p-q in every picture of any machine."""

from __future__ import annotations

from collections.abc import Sequence
from zlib import crc32

from vibroimpact.plotting import style

CHAOTIC, NOT_PERIODIC, WITHOUT_IMPACTS = "#1A1A1A", "#6F6F6F", "#FFFFFF"
SHADED = tuple(
    style.mixed(colour, style.BLACK, share)
    for colour, share in (
        (style.SKY, 0.5), (style.YELLOW, 0.35), (style.GREEN, 0.5), (style.BLUE, 0.5), (style.ORANGE, 0.5),
        (style.PURPLE, 0.5),
    )
)  # fmt: skip
LIGHT = tuple(
    style.mixed(colour, "#FFFFFF", share)
    for colour, share in (
        (style.YELLOW, 0.4), (style.VERMILION, 0.6), (style.ORANGE, 0.4), (style.SKY, 0.4)
    )
)  # fmt: skip
PALETTE = (
    style.BLUE, style.ORANGE, style.SKY, style.VERMILION, style.PURPLE, style.GREEN, *SHADED, style.YELLOW, *LIGHT,
)  # fmt: skip
"""Colours that readers without red or green tell apart, those that are too light for lines last."""
FOR_LINES = PALETTE[:12]
COMMON = (
    "1-1-1", "2-2-2", "1-1-0", "1-2-1", "1-1-2", "3-3-3", "1-0-1", "4-4-4", "1-2-2", "2-1-0", "2-0-1", "2-1-1",
    "2-2-0", "2-0-2", "3-1-0", "3-0-1", "2-3-3",
)  # fmt: skip
"""Symbols in the order of the palette."""
OWN = dict(zip(COMMON, PALETTE, strict=True)) | {
    "chaotic": CHAOTIC, "quasiperiodic": NOT_PERIODIC, "not periodic": NOT_PERIODIC,
    "without impacts": WITHOUT_IMPACTS, "no impacts": WITHOUT_IMPACTS,
}  # fmt: skip
MORE = tuple(colour for colour in style.series(31) if colour not in PALETTE)


def colours_of(words: Sequence[str]) -> list[str]:
    """Colours of the motions of a picture, by symbol or kind; different ones as long as there are some.

    Common motions have the same colour in every picture, rarer ones too, unless another of the picture has it. A word
    that occurs again, as that of a second attractor, takes one that is free.
    """
    found: dict[int, str] = {}
    for i, word in enumerate(words):
        if word in OWN and OWN[word] not in found.values():
            found[i] = OWN[word]
    for i in sorted(set(range(len(words))) - set(found), key=lambda i: (words[i], i)):
        first = crc32(words[i].encode()) % len(FOR_LINES)
        turned = (*FOR_LINES[first:], *FOR_LINES[:first], *PALETTE, *MORE)
        free = (colour for colour in turned if colour not in found.values())
        found[i] = next(free, FOR_LINES[first])
    return [found[i] for i in range(len(words))]
