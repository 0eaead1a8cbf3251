"""Quantities, and their units in SI."""

from __future__ import annotations

UNITS = {  # of quantities, in SI
    "length": "m",
    "velocity": "m/s",
    "acceleration": "m/s²",
    "time": "s",
    "frequency": "rad/s",
    "rate": "1/s",
    "force": "N",
    "impulse": "N s",
    "energy": "J",
    "power": "W",
    "mass": "kg",
    "unbalance": "kg m",
    "stiffness": "N/m",
    "damping": "N s/m",
}
