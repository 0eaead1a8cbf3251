"""Command line: a file for each command with EXAMPLE, add_options and run."""
