"""Command line: a file for each command with EXAMPLE, add_options and run.

``common``, ``ensemble``, ``machines``, ``output`` and ``saved`` serve several of them.
"""
