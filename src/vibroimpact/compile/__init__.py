"""Compilation of a mechanism to the modes, guards and jumps that the kernel runs.

The same formulas serve floats, jets (derivatives by parameters) and columns (many systems).
"""
