"""Independent references in high precision.

Nothing here imports the library: the formulas are derived afresh and evaluated with mpmath,
so that an error would have to be made twice to go unseen.

    precision   the mpmath context all modules share, and exact conversion of doubles
    oscillator  closed form of one forced linear oscillator, with bounds on its derivatives
    striding    the first root of a function, certified by such bounds
    damper      the impact damper: flight, first contact, impact, chatter, sticking, release
    symmetric   its symmetric 1-1-1 orbits, their multipliers and bifurcations
    mechanism   any M, C, K with harmonic forces and contacts
    misprints   the paper's equations as printed and as they hold, with residuals
    normal_form_slips  the same for the appendix
    multilinear derivatives of maps by differences at high precision, and their normal forms
    grid        rigid and soft stops, friction, belts, phase switches: matrix exponentials on a fine grid
    periodic    periodic orbits of any mechanism, by segments
    periodic_damper, periodic_one_sided, periodic_torus, periodic_cases
                the orbits that tests/reference/periodic.toml lists
"""

from __future__ import annotations
