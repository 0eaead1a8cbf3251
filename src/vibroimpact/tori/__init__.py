"""Invariant circles of impact maps: search, normal stability, admissibility, continuation."""
