"""What every result has: fields with dims and units, a dataset, a table, a picture, a file."""
