"""Written by tools/name_stubs.py."""

from vibroimpact.sweeps.observers.dashpots import Dashpots as Dashpots
from vibroimpact.sweeps.observers.dissipation import Dissipation as Dissipation
from vibroimpact.sweeps.observers.extremes import Extremes as Extremes
from vibroimpact.sweeps.observers.final import Final as Final
from vibroimpact.sweeps.observers.forces import Forces as Forces
from vibroimpact.sweeps.observers.harmonic import Harmonic as Harmonic
from vibroimpact.sweeps.observers.impacts import Impacts as Impacts
from vibroimpact.sweeps.observers.impulse import Impulse as Impulse
from vibroimpact.sweeps.observers.lyapunov import Lyapunov as Lyapunov
from vibroimpact.sweeps.observers.power import Power as Power
from vibroimpact.sweeps.observers.progress import Progress as Progress
from vibroimpact.sweeps.observers.rms import Rms as Rms
from vibroimpact.sweeps.observers.rotation import Rotation as Rotation
from vibroimpact.sweeps.observers.section import Section as Section
from vibroimpact.sweeps.observers.settling import Settling as Settling
from vibroimpact.sweeps.observers.shares import Shares as Shares
from vibroimpact.sweeps.observers.spectrum import Spectrum as Spectrum
from vibroimpact.sweeps.observers.speeds import Speeds as Speeds
from vibroimpact.sweeps.observers.states import States as States
from vibroimpact.sweeps.observers.stroboscopic import Stroboscopic as Stroboscopic
from vibroimpact.sweeps.observers.symbol import Symbol as Symbol
