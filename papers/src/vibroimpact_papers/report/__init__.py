"""Self-contained HTML pages and whole output folders, without mechanics."""

from __future__ import annotations

from vibroimpact_papers.report.folder import whole_folder
from vibroimpact_papers.report.page import Figure, Page, Section, Table, Text, Verdict, Word

__all__ = ["Figure", "Page", "Section", "Table", "Text", "Verdict", "Word", "whole_folder"]
