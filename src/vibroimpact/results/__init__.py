"""Results: fields with dims and units, and from them a dataset, a table, a picture, a file."""
