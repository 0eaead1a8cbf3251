"""Sweeps: many systems and many starts, observed during the run without storing motions."""
