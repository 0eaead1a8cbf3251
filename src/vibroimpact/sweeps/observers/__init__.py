"""Observers: what is computed of a motion while it runs, without storing it."""
