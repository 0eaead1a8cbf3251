"""What an engineer asks of a machine: how it answers over a band, in which measure, and the best machine."""
