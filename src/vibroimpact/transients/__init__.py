"""Motions that pass: free decay, sine sweeps, recorded forces, response spectra."""
