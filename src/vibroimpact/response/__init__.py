"""Steady answers over a band of frequencies, beside linear machines and tuned dampers."""
