"""The commands of the command line, one file each: NAME, HELP, EXAMPLE, add_options, run."""

from __future__ import annotations
