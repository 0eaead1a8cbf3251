"""Analyses made of sweeps: planes, basins, multistability, bifurcation diagrams."""
