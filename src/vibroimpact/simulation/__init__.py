"""One motion: its events, sections, Lyapunov exponents, and derivatives of its impact maps."""
