"""Execution of sweeps: tiles, the systems of a tile, threads, clusters, stores."""
