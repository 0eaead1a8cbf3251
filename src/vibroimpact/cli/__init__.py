"""Command line: a file for each command with EXAMPLE, add_options and run.

``common``, ``ensemble``, ``members``, ``machines`` and ``output`` serve several of them.
"""
