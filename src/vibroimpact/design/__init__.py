"""What an engineer asks of a machine: how it answers over a band, and in which measure."""
