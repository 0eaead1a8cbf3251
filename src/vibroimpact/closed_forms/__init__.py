"""Symmetric 1-1-1 orbits of the impact damper and their bifurcations in closed form.

They share no code with the analyses of other packages, and so serve as an independent check.
"""
