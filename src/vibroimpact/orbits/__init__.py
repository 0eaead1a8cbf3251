"""Periodic orbits with any sequence of impacts: search, admissibility, maps, multipliers."""
