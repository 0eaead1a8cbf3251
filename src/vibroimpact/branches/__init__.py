"""Branches of periodic orbits in a parameter: followed, with every bifurcation on them."""
