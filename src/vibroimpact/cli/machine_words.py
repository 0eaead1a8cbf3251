"""The machine of the command line, whose parameters become options."""

from __future__ import annotations

from collections.abc import Sequence

from vibroimpact.machines.registry import DEFAULT, MACHINES


def machine_in_words(words: Sequence[str]) -> str:
    """Name of the machine, from the case, NAME or NAME/CASE, or else from the file of --config."""
    before = ["", *words]
    for last, word in zip(before, words, strict=False):
        name = word.partition("/")[0]
        if name in MACHINES and not last.startswith("--"):
            return name
    for last, word in zip(before, words, strict=False):
        file = word if last == "--config" else word.removeprefix("--config=")
        if last == "--config" or file != word:
            from vibroimpact.machines.toml_file import machine_in  # loads numpy

            return machine_in(file) or DEFAULT
    return DEFAULT
