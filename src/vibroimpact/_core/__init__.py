"""Helpers without mechanics, for every subpackage.

Checks of values, exceptions, numbers that compute with derivatives (jets) or for many systems at
once (columns), linear algebra in a fixed order of operations, exponentials of a matrix, zeros by
Chebyshev expansion, files written whole or not at all, progress.
"""
