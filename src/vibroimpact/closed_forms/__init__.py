"""Symmetric 1-1-1 orbits of the impact damper and their bifurcations in closed form.

Orbits and bifurcations are formulas of their own, and so serve as an independent check of the
analyses of other rooms. Admissibility is judged by simulation.
"""
