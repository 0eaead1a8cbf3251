"""What is meant by a word that is not known: the nearest name, or that of the same thing here."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from types import MappingProxyType
from typing import Any

NONE: Mapping[str, tuple[str, ...]] = MappingProxyType({})

# Words that users try, and names here. Of several names those that exist where the word was tried are told.
OF_THE_PACKAGE = {
    "arnold_tongue": ("tongue",),
    "basin": ("basins",),
    "bifurcation_diagram": ("bifurcation_sweep", "branch_diagram"),
    "bode": ("frequency_response",),
    "continuation_of": ("continue_orbit",),
    "continue_branch": ("continue_orbit",),
    "continue_periodic_orbit": ("continue_orbit",),
    "differentiate": ("map_derivative",),
    "eigenvalues": ("find_orbit(...).multipliers",),
    "find_attractors": ("basins", "multistability"),
    "find_periodic_orbit": ("find_orbit",),
    "find_periodic_orbits": ("find_orbits",),
    "find_torus": ("find_circle",),
    "floquet": ("find_orbit(...).multipliers",),
    "floquet_multipliers": ("find_orbit(...).multipliers",),
    "follow": ("continue_orbit",),
    "frf": ("frequency_response",),
    "impact": ("RigidStop",),
    "integrate": ("simulate",),
    "invariant_circle": ("find_circle",),
    "lyapunov": ("lyapunov_exponent", "lyapunov_spectrum"),
    "map": ("plane", "impact_map", "stroboscopic_map"),
    "monodromy": ("full_map(...).jacobian", "find_orbit(...).multipliers"),
    "multipliers": ("find_orbit(...).multipliers",),
    "parameter_sweep": ("sweep",),
    "periodic_orbit": ("find_orbit",),
    "phase_portrait": ("plotting.plot_phase_portrait",),
    "plot": ("plotting", "simulate(...).plot"),
    "poincare": ("section", "impact_map", "stroboscopic_map"),
    "poincare_map": ("impact_map", "stroboscopic_map"),
    "poincare_section": ("section",),
    "read_toml": ("load_machine",),
    "run": ("simulate",),
    "solve": ("simulate", "find_orbit"),
    "solve_ivp": ("simulate",),
    "spring": ("Mechanism",),
    "stroboscopic_section": ("section",),
    "system": ("Mechanism",),
    "time_history": ("simulate(...).plot",),
    "torus": ("find_circle",),
}
OF_COMMANDS = {
    "bifurcation": ("diagram", "branch", "curve"),
    "bifurcation-diagram": ("diagram", "branch"),
    "continue": ("branch",),
    "find-orbit": ("orbit",),
    "floquet": ("orbit",),
    "frf": ("response",),
    "integrate": ("simulate",),
    "map": ("plane",),
    "multipliers": ("orbit",),
    "optimise": ("design",),
    "optimize": ("design",),
    "poincare": ("section",),
    "run": ("simulate",),
    "torus": ("circle",),
}
OF_RESULTS = {
    "d": ("displacement", "position"),
    "df": ("to_dataframe",),
    "eigenvalues": ("multipliers",),
    "events": ("time", "status"),
    "floquet": ("multipliers",),
    "floquet_multipliers": ("multipliers",),
    "impact_times": ("time",),
    "lyapunov": ("exponent", "exponents", "value"),
    "p": ("parameter",),
    "show": ("plot",),
    "success": ("converged", "end"),
    "symbol": ("orbit_type",),
    "t": ("time", "times"),
    "times": ("time",),
    "theta": ("phase",),
    "to_pandas": ("to_dataframe",),
    "to_xarray": ("to_dataset",),
    "v": ("velocity", "velocity_before", "velocity_after"),
    "x": ("position", "positions"),
    "y": ("position", "velocity_before", "velocity_after"),
}
OF_ARGUMENTS = {
    "c": ("damping", "zeta"),
    "dt": ("t_max",),
    "duration": ("t_max",),
    "e": ("restitution",),
    "freq": ("omega",),
    "frequency": ("omega", "parameter"),
    "bound": ("bounds",),
    "band": ("bounds",),
    "gap": ("clearance", "half_clearance", "upper"),
    "initial_state": ("start", "guess"),
    "ic": ("start", "guess"),
    "k": ("stiffness",),
    "m": ("mass",),
    "n": ("points", "impacts", "starts"),
    "n_impacts": ("impacts",),
    "n_periods": ("periods",),
    "params": ("over",),
    "r": ("restitution",),
    "over": ("bounds", "band"),
    "range": ("bounds", "band"),
    "settle": ("settle_periods", "settle_impacts", "settle_iterates", "settle_events"),
    "state": ("start", "guess"),
    "most": ("most_impacts", "most_branches", "most_curves", "most_classified", "most_motions"),
    "number": ("points",),
    "t": ("t_max", "phase"),
    "t_end": ("t_max",),
    "t_final": ("t_max",),
    "t_span": ("t_max",),
    "tend": ("t_max",),
    "time": ("t_max",),
    "transient": ("settle_periods", "settle_impacts", "settle_iterates", "settle_events"),
    "v": ("velocity",),
    "w": ("omega",),
    "x": ("position",),
    "x0": ("start", "guess", "position"),
    "y0": ("start", "guess"),
    "v0": ("velocity",),
}


def meant(
    word: str, known: Iterable[str], same: Mapping[str, tuple[str, ...]] = NONE, prefix: str = ""
) -> str:
    """Return " Did you mean x or y?", or nothing where no known name is near.

    Parameters
    ----------
    word
        The word that is not known.
    known
        Names that are.
    same
        Names of the same thing by word; those that begin with a known name are told.
    prefix
        What stands before each name.
    """
    names = list(known)
    first = {one.lower(): one for one in names}
    told = [
        one
        for one in same.get(word.lower(), ())
        if one.partition("(")[0].partition(".")[0] in names
    ]
    near = told or [first[one] for one in get_close_matches(word.lower(), first, 1)]
    return f" Did you mean {' or '.join(prefix + one for one in near)}?" if near else ""


def missing_name(module: str, name: str, known: Iterable[str]) -> AttributeError:
    """Error for a name that a module has not, with the one that is meant."""
    return AttributeError(f"module {module!r} has no attribute {name!r}.{meant(name, known)}")


def missing_attribute(owner: Any, name: str, known: Iterable[str]) -> AttributeError:
    """Error for an attribute that a result has not, with the one that is meant."""
    kind = type(owner).__name__
    return AttributeError(
        f"{kind!r} object has no attribute {name!r}.{meant(name, known, OF_RESULTS)}"
    )
