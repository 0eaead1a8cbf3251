"""Sweeps: many systems, many starts, observed in the loop without storing orbits."""
