"""Analyses based on sweeps: planes, basins, multistability, bifurcation diagrams."""
