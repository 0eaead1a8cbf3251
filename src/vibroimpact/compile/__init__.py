"""From a description to what the kernel runs: modes, guards and jumps.

The same formulas serve floats, jets (derivatives by parameters) and columns (many systems).
"""
