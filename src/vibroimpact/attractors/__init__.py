"""What motions settle on: classified by stated tests, compared, followed along a parameter."""
