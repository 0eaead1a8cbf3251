"""Descriptions: mechanisms, states, systems and their parameters by name.

Nothing here computes a motion.
"""
