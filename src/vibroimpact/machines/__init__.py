"""Machines by name, how they are read and written (TOML, JSON), and published parameter sets.

A machine is one file: a frozen dataclass with a ``mechanism``.
"""
