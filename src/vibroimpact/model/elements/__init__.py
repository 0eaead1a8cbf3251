"""Elements, one file each: what acts on a mechanism beside its springs, dashpots and forces (theory.md, "Elements").

``element.py`` says what an element must give, ``table.py`` which there are; :mod:`vibroimpact.compile.elements` has
the rows of each.
"""
