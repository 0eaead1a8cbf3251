"""Exact dynamics and bifurcations of vibro-impact systems: all public names and their modules."""

from vibroimpact import continuation as continuation
from vibroimpact import normal_forms as normal_forms
from vibroimpact import plotting as plotting
from vibroimpact._core.errors import BackendUnavailableError as BackendUnavailableError
from vibroimpact._core.errors import ClusterLostError as ClusterLostError
from vibroimpact._core.errors import InvalidParameterError as InvalidParameterError
from vibroimpact._core.errors import StoreError as StoreError
from vibroimpact._core.errors import VibroImpactError as VibroImpactError
from vibroimpact.attractors.classify import Attractor as Attractor
from vibroimpact.attractors.classify import classify as classify
from vibroimpact.attractors.point_sets import InvariantSet as InvariantSet
from vibroimpact.attractors.point_sets import Kind as Kind
from vibroimpact.attractors.point_sets import classify_points as classify_points
from vibroimpact.attractors.sweep_attractor import sweep_attractor as sweep_attractor
from vibroimpact.bifurcations.atlas import Atlas as Atlas
from vibroimpact.bifurcations.atlas import AtlasPoint as AtlasPoint
from vibroimpact.bifurcations.atlas import bifurcation_atlas as bifurcation_atlas
from vibroimpact.bifurcations.continue_bifurcation import MapPoint as MapPoint
from vibroimpact.bifurcations.continue_bifurcation import (
    continue_bifurcation as continue_bifurcation,
)
from vibroimpact.bifurcations.continue_bifurcation import continue_level as continue_level
from vibroimpact.bifurcations.curve import BifurcationCurve as BifurcationCurve
from vibroimpact.bifurcations.curve import CodimensionTwoPoint as CodimensionTwoPoint
from vibroimpact.bifurcations.grazing_contact import GrazingContact as GrazingContact
from vibroimpact.bifurcations.store import load_curve as load_curve
from vibroimpact.bifurcations.store import save_curve as save_curve
from vibroimpact.bifurcations.switch_curve import NoCurve as NoCurve
from vibroimpact.bifurcations.switch_curve import switch_curve as switch_curve
from vibroimpact.bifurcations.tongue import NoTongue as NoTongue
from vibroimpact.bifurcations.tongue import Tongue as Tongue
from vibroimpact.bifurcations.tongue import tongue as tongue
from vibroimpact.branches import stop_rules
from vibroimpact.branches.branch import BifurcationPoint as BifurcationPoint
from vibroimpact.branches.branch import Branch as Branch
from vibroimpact.branches.continue_orbit import continue_orbit as continue_orbit
from vibroimpact.branches.diagram import Diagram as Diagram
from vibroimpact.branches.diagram import branch_diagram as branch_diagram
from vibroimpact.branches.store import load_branch as load_branch
from vibroimpact.branches.store import save_branch as save_branch
from vibroimpact.branches.switch import NoBranch as NoBranch
from vibroimpact.branches.switch import switch_branch as switch_branch
from vibroimpact.closed_forms.bifurcations import Bifurcation as Bifurcation
from vibroimpact.closed_forms.bifurcations import symmetric_bifurcations as symmetric_bifurcations
from vibroimpact.closed_forms.section_jacobian import section_jacobian as section_jacobian
from vibroimpact.closed_forms.symmetric_orbits import SymmetricOrbit as SymmetricOrbit
from vibroimpact.closed_forms.symmetric_orbits import symmetric_orbits as symmetric_orbits
from vibroimpact.continuation import Steps as Steps
from vibroimpact.design import measure
from vibroimpact.design.answers import Answer as Answer
from vibroimpact.design.curves import ResponseCurve as ResponseCurve
from vibroimpact.design.maps import DesignMap as DesignMap
from vibroimpact.design.maps import design_map as design_map
from vibroimpact.design.measure import Measure as Measure
from vibroimpact.design.measure import measure_of as measure_of
from vibroimpact.design.objective import Objective as Objective
from vibroimpact.design.objective import mean_over as mean_over
from vibroimpact.design.objective import worst_over as worst_over
from vibroimpact.design.optimise import Design as Design
from vibroimpact.design.optimise import optimise as optimise
from vibroimpact.design.pareto import ParetoFront as ParetoFront
from vibroimpact.design.pareto import pareto_front as pareto_front
from vibroimpact.design.response import Response as Response
from vibroimpact.design.response import frequency_response as frequency_response
from vibroimpact.design.tuned import TunedDamper as TunedDamper
from vibroimpact.design.tuned import tuned_damper as tuned_damper
from vibroimpact.machines.impact_damper import ImpactDamper as ImpactDamper
from vibroimpact.machines.impact_oscillator import ImpactOscillator as ImpactOscillator
from vibroimpact.machines.machine import Scales as Scales
from vibroimpact.model.elements import Friction as Friction
from vibroimpact.model.elements import FrictionState as FrictionState
from vibroimpact.model.elements import NormalLoad as NormalLoad
from vibroimpact.model.elements import PhaseSwitch as PhaseSwitch
from vibroimpact.model.elements import PhaseSwitchState as PhaseSwitchState
from vibroimpact.model.elements import RigidStopState as RigidStopState
from vibroimpact.model.elements import SoftStop as SoftStop
from vibroimpact.model.elements import SoftStopState as SoftStopState
from vibroimpact.model.harmonic import Harmonic as Harmonic
from vibroimpact.model.hybrid_system import HybridSystem as HybridSystem
from vibroimpact.model.hybrid_system import LinearGuard as LinearGuard
from vibroimpact.model.hybrid_system import LinearMode as LinearMode
from vibroimpact.model.hybrid_system import Transition as Transition
from vibroimpact.model.mechanism import Contact as Contact
from vibroimpact.model.mechanism import Mechanism as Mechanism
from vibroimpact.model.mechanism import RigidStop as RigidStop
from vibroimpact.model.parameters import Family as Family
from vibroimpact.model.state import State as State
from vibroimpact.normal_forms import ExplicitMap as ExplicitMap
from vibroimpact.normal_forms import normal_form as normal_form
from vibroimpact.orbits.find import Guess as Guess
from vibroimpact.orbits.find import find_orbit as find_orbit
from vibroimpact.orbits.maps import full_map as full_map
from vibroimpact.orbits.maps import half_map as half_map
from vibroimpact.orbits.maps import impact_map as impact_map
from vibroimpact.orbits.maps import stroboscopic_map as stroboscopic_map
from vibroimpact.orbits.orbit import Orbit as Orbit
from vibroimpact.orbits.search import find_orbits as find_orbits
from vibroimpact.orbits.search_result import OrbitSearch as OrbitSearch
from vibroimpact.simulation.derivatives import MapDerivative as MapDerivative
from vibroimpact.simulation.derivatives import map_derivative as map_derivative
from vibroimpact.simulation.hybrid_run import HybridRun as HybridRun
from vibroimpact.simulation.hybrid_run import simulate_hybrid as simulate_hybrid
from vibroimpact.simulation.lyapunov import LyapunovEstimate as LyapunovEstimate
from vibroimpact.simulation.lyapunov import lyapunov_exponent as lyapunov_exponent
from vibroimpact.simulation.lyapunov_spectrum import LyapunovSpectrum as LyapunovSpectrum
from vibroimpact.simulation.lyapunov_spectrum import lyapunov_spectrum as lyapunov_spectrum
from vibroimpact.simulation.sections import Section as Section
from vibroimpact.simulation.sections import StroboscopicSection as StroboscopicSection
from vibroimpact.simulation.sections import impact_section as impact_section
from vibroimpact.simulation.sections import stroboscopic_section as stroboscopic_section
from vibroimpact.simulation.simulate import Run as Run
from vibroimpact.simulation.simulate import RunEnd as RunEnd
from vibroimpact.simulation.simulate import Status as Status
from vibroimpact.simulation.simulate import simulate as simulate
from vibroimpact.sweeps import observers
from vibroimpact.sweeps.analyses.basins import attractor_state as attractor_state
from vibroimpact.sweeps.analyses.basins import basins as basins
from vibroimpact.sweeps.analyses.diagram import bifurcation_sweep as bifurcation_sweep
from vibroimpact.sweeps.analyses.plane import multistability as multistability
from vibroimpact.sweeps.analyses.plane import plane as plane
from vibroimpact.sweeps.listed_starts import ListedStarts as ListedStarts
from vibroimpact.sweeps.rerun import rerun_sweep as rerun_sweep
from vibroimpact.sweeps.starts import GridStarts as GridStarts
from vibroimpact.sweeps.starts import RandomStarts as RandomStarts
from vibroimpact.sweeps.sweep import sweep as sweep
from vibroimpact.tori.branch import CircleBranch as CircleBranch
from vibroimpact.tori.branch import CircleEvent as CircleEvent
from vibroimpact.tori.circle import Circle as Circle
from vibroimpact.tori.continue_circle import continue_circle as continue_circle
from vibroimpact.tori.find import CircleGuess as CircleGuess
from vibroimpact.tori.find import find_circle as find_circle
from vibroimpact.tori.switch_circle import switch_circle as switch_circle

measures = measure
observe = observers
stop = stop_rules

__version__: str
