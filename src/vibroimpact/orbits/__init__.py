"""Periodic orbits with any sequence of impacts: found, judged, differentiated."""
