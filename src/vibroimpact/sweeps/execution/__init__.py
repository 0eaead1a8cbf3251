"""How a sweep is computed: tiles, the systems of a tile, threads, clusters, stores."""
