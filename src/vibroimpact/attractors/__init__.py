"""Attractors of motions: classified by stated tests, compared, followed along a parameter."""
