"""Written by tools/name_stubs.py."""

from vibroimpact.machines.ball_harvester import BallHarvester as BallHarvester
from vibroimpact.machines.bilinear_oscillator import BilinearOscillator as BilinearOscillator
from vibroimpact.machines.block_on_belt import BlockOnBelt as BlockOnBelt
from vibroimpact.machines.bouncing_ball import BouncingBall as BouncingBall
from vibroimpact.machines.cam_follower import CamFollower as CamFollower
from vibroimpact.machines.drill_string import DrillString as DrillString
from vibroimpact.machines.dry_impact_oscillator import DryImpactOscillator as DryImpactOscillator
from vibroimpact.machines.dual_component import DualComponent as DualComponent
from vibroimpact.machines.electromagnetic_harvester import (
    ElectromagneticHarvester as ElectromagneticHarvester,
)
from vibroimpact.machines.energy_sink import EnergySink as EnergySink
from vibroimpact.machines.fermi_ulam import FermiUlam as FermiUlam
from vibroimpact.machines.friction_oscillator import FrictionOscillator as FrictionOscillator
from vibroimpact.machines.gear_backlash import GearBacklash as GearBacklash
from vibroimpact.machines.gear_rattle import GearRattle as GearRattle
from vibroimpact.machines.impact_damper import ImpactDamper as ImpactDamper
from vibroimpact.machines.impact_oscillator import ImpactOscillator as ImpactOscillator
from vibroimpact.machines.impact_pair import ImpactPair as ImpactPair
from vibroimpact.machines.mole import Mole as Mole
from vibroimpact.machines.multi_unit_damper import MultiUnitDamper as MultiUnitDamper
from vibroimpact.machines.piezo_harvester import PiezoHarvester as PiezoHarvester
from vibroimpact.machines.pounding_structures import PoundingStructures as PoundingStructures
from vibroimpact.machines.rammer import Rammer as Rammer
from vibroimpact.machines.shaker import Shaker as Shaker
from vibroimpact.machines.soft_impact_oscillator import SoftImpactOscillator as SoftImpactOscillator
from vibroimpact.machines.vibration_hammer import VibrationHammer as VibrationHammer
from vibroimpact.machines.vibro_impact_capsule import VibroImpactCapsule as VibroImpactCapsule
from vibroimpact.machines.wheelset import Wheelset as Wheelset
