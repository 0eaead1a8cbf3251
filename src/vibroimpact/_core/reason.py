"""Reasons with a number, for arrays and files, and with a sentence."""

from __future__ import annotations

from vibroimpact._core.codes import NamedCode


class Reason(NamedCode):
    """Base of such enumerations: a member is its number and its sentence."""

    sentence: str

    def __new__(cls, number: int, sentence: str = "") -> Reason:
        reason = int.__new__(cls, number)
        reason._value_ = number
        reason.sentence = sentence
        return reason
