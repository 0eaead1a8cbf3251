"""Curves of bifurcations in two parameters, and the special points on them."""
