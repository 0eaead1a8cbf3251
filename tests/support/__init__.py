"""What several test modules share: systems to test, and ways to ask the kernel one question."""

from __future__ import annotations

UNIT = 2.0**-53  # unit roundoff of a double
