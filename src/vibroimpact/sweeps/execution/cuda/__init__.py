"""Members on a CUDA device: the headers of the kernel, compiled when they are first needed.

program.py    which source, compiled for which device, and where compiled kernels are kept
layout.py     arrays, options and tables in the form that the kernels read and write
batch.py      systems of one structure, whose members run on a machine
card.py       the machine: a card, its memory and launches
"""
