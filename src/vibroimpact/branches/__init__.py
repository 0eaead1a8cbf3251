"""Branches of periodic orbits in a parameter, with every bifurcation on them."""
