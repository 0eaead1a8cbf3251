"""Single motions: events, sections, Lyapunov exponents, and derivatives of their impact maps."""
