"""The best machine: objectives, searches, fronts, maps."""
