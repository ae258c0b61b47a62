"""From CAD to reduced models and the response of structures with friction: the public names.

::

    import stickslip as ss

    mesh = ss.mesh_blade(ss.Blade(), ss.MeshRule(element=ss.HEX20, through_thickness=1, length_ratio=2.3))
    system = ss.supported_system(mesh, *ss.assemble(mesh, ss.STEEL), [ss.Support(nodes=mesh.nodes("clamp"))])
    print(ss.modes(system, 3).frequency)  # Hz

`__all__` is the promise of what stays; ``docs/api.md`` lists it. Nothing is imported before a name is used: each is
found in its package. The other modules of that package can be imported as well, without the promise.
"""

import importlib
from typing import TYPE_CHECKING, Any

from stickslip._packages import require_own_packages

if TYPE_CHECKING:
    from correlation.campaign.read_campaign import read_campaign as read_campaign
    from fe.assembly import assemble as assemble
    from fe.boundary import Support as Support
    from fe.boundary import supported_system as supported_system
    from fe.element.hex8 import HEX8 as HEX8
    from fe.element.hex20 import HEX20 as HEX20
    from fe.element.tet10 import TET10 as TET10
    from fe.file.mesh_file import read_mesh as read_mesh
    from fe.file.mesh_file import write_mesh as write_mesh
    from fe.mac import modal_assurance_criterion as modal_assurance_criterion
    from fe.material import STEEL as STEEL
    from fe.material import Material as Material
    from fe.mesh import Mesh as Mesh
    from fe.mesher.blade import mesh_blade as mesh_blade
    from fe.mesher.mesh_rule import MeshRule as MeshRule
    from fe.modal import modes as modes
    from geometry.blade import Blade as Blade
    from geometry.blade_solid import blade_part as blade_part
    from geometry.errors import ComputationFailed as ComputationFailed
    from geometry.errors import InputError as InputError
    from geometry.rig import Rig as Rig
    from geometry.step_io import write_step as write_step
    from hbsolve.backbone.backbone import backbone as backbone
    from hbsolve.balance import HarmonicBalance as HarmonicBalance
    from hbsolve.continuation.branch import ResponseBranch as ResponseBranch
    from hbsolve.continuation.branch import load_branch as load_branch
    from hbsolve.continuation.controlled_response import controlled_response as controlled_response
    from hbsolve.continuation.detached import detached_curves as detached_curves
    from hbsolve.continuation.response import frequency_response as frequency_response
    from hbsolve.continuation.response import level_response as level_response
    from hbsolve.continuation.response_surface import response_surface as response_surface
    from hbsolve.limits.objective import OutputHarmonic as OutputHarmonic
    from hbsolve.limits.response_limits import limit_problem as limit_problem
    from hbsolve.limits.response_limits import response_limits as response_limits
    from hbsolve.stability.branch_stability import branch_stability as branch_stability
    from hbsolve.stability.crossing_branch import crossing_branches as crossing_branches
    from hbsolve.stability.stability import stability as stability
    from hbsolve.steady_state import steady_state as steady_state
    from reduction.base_excitation import BaseExcitation as BaseExcitation
    from reduction.base_excitation import BaseMotion as BaseMotion
    from reduction.craig_bampton import craig_bampton as craig_bampton
    from reduction.file.rom_hdf5 import load_rom as load_rom
    from reduction.file.rom_hdf5 import save_rom as save_rom
    from reduction.joint_law.function_law import joint_law as joint_law
    from reduction.jointed_system import BoucWenJoint as BoucWenJoint
    from reduction.jointed_system import CubicSpring as CubicSpring
    from reduction.jointed_system import DampedStop as DampedStop
    from reduction.jointed_system import ElasticStop as ElasticStop
    from reduction.jointed_system import FrictionContact as FrictionContact
    from reduction.jointed_system import FrictionEllipse as FrictionEllipse
    from reduction.jointed_system import HertzContact as HertzContact
    from reduction.jointed_system import IwanJoint as IwanJoint
    from reduction.jointed_system import JenkinsChain as JenkinsChain
    from reduction.jointed_system import JenkinsElement as JenkinsElement
    from reduction.jointed_system import JointedSystem as JointedSystem
    from reduction.jointed_system import LuGreFriction as LuGreFriction
    from reduction.jointed_system import Play as Play
    from reduction.jointed_system import PolynomialSpring as PolynomialSpring
    from reduction.jointed_system import PowerSpring as PowerSpring
    from reduction.jointed_system import QuadraticDamper as QuadraticDamper
    from reduction.jointed_system import SmoothFriction as SmoothFriction
    from reduction.jointed_system import StructuralDamper as StructuralDamper
    from reduction.jointed_system import ValanisJoint as ValanisJoint
    from reduction.jointed_system import ViscousDamper as ViscousDamper
    from reduction.jointed_system import along as along
    from reduction.jointed_system import between as between
    from reduction.rom import ReducedModel as ReducedModel
    from reduction.static_contact import static_state as static_state
    from study.case.setup import read_case as read_case
    from study.compare.run import compare as compare
    from study.diagnose.round import diagnose_case as diagnose
    from study.spread.spread import spread as spread
    from study.sweep.run import sweep as sweep
    from transient.integrate import integrate as integrate
    from transient.steady import steady_motion as steady_motion

#: Where each name is: module and name there.
_HOME = {
    # Geometry
    "Blade": "geometry.blade:Blade",
    "blade_part": "geometry.blade_solid:blade_part",
    "Rig": "geometry.rig:Rig",
    "write_step": "geometry.step_io:write_step",
    # Finite elements
    "mesh_blade": "fe.mesher.blade:mesh_blade",
    "MeshRule": "fe.mesher.mesh_rule:MeshRule",
    "Mesh": "fe.mesh:Mesh",
    "read_mesh": "fe.file.mesh_file:read_mesh",
    "write_mesh": "fe.file.mesh_file:write_mesh",
    "HEX8": "fe.element.hex8:HEX8",
    "HEX20": "fe.element.hex20:HEX20",
    "TET10": "fe.element.tet10:TET10",
    "Material": "fe.material:Material",
    "STEEL": "fe.material:STEEL",
    "assemble": "fe.assembly:assemble",
    "Support": "fe.boundary:Support",
    "supported_system": "fe.boundary:supported_system",
    "modes": "fe.modal:modes",
    "modal_assurance_criterion": "fe.mac:modal_assurance_criterion",
    # Reduction and joints
    "craig_bampton": "reduction.craig_bampton:craig_bampton",
    "ReducedModel": "reduction.rom:ReducedModel",
    "save_rom": "reduction.file.rom_hdf5:save_rom",
    "load_rom": "reduction.file.rom_hdf5:load_rom",
    "JointedSystem": "reduction.jointed_system:JointedSystem",
    "FrictionContact": "reduction.jointed_system:FrictionContact",
    "JenkinsElement": "reduction.jointed_system:JenkinsElement",
    "IwanJoint": "reduction.jointed_system:IwanJoint",
    "ValanisJoint": "reduction.jointed_system:ValanisJoint",
    "LuGreFriction": "reduction.jointed_system:LuGreFriction",
    "JenkinsChain": "reduction.jointed_system:JenkinsChain",
    "FrictionEllipse": "reduction.jointed_system:FrictionEllipse",
    "DampedStop": "reduction.jointed_system:DampedStop",
    "BoucWenJoint": "reduction.jointed_system:BoucWenJoint",
    "CubicSpring": "reduction.jointed_system:CubicSpring",
    "ElasticStop": "reduction.jointed_system:ElasticStop",
    "Play": "reduction.jointed_system:Play",
    "HertzContact": "reduction.jointed_system:HertzContact",
    "ViscousDamper": "reduction.jointed_system:ViscousDamper",
    "SmoothFriction": "reduction.jointed_system:SmoothFriction",
    "StructuralDamper": "reduction.jointed_system:StructuralDamper",
    "PolynomialSpring": "reduction.jointed_system:PolynomialSpring",
    "PowerSpring": "reduction.jointed_system:PowerSpring",
    "QuadraticDamper": "reduction.jointed_system:QuadraticDamper",
    "joint_law": "reduction.joint_law.function_law:joint_law",
    "BaseMotion": "reduction.base_excitation:BaseMotion",
    "BaseExcitation": "reduction.base_excitation:BaseExcitation",
    "along": "reduction.jointed_system:along",
    "between": "reduction.jointed_system:between",
    "static_state": "reduction.static_contact:static_state",
    # Periodic response
    "HarmonicBalance": "hbsolve.balance:HarmonicBalance",
    "steady_state": "hbsolve.steady_state:steady_state",
    "stability": "hbsolve.stability.stability:stability",
    "branch_stability": "hbsolve.stability.branch_stability:branch_stability",
    "crossing_branches": "hbsolve.stability.crossing_branch:crossing_branches",
    "backbone": "hbsolve.backbone.backbone:backbone",
    "frequency_response": "hbsolve.continuation.response:frequency_response",
    "detached_curves": "hbsolve.continuation.detached:detached_curves",
    "level_response": "hbsolve.continuation.response:level_response",
    "controlled_response": "hbsolve.continuation.controlled_response:controlled_response",
    "response_surface": "hbsolve.continuation.response_surface:response_surface",
    "ResponseBranch": "hbsolve.continuation.branch:ResponseBranch",
    "load_branch": "hbsolve.continuation.branch:load_branch",
    "OutputHarmonic": "hbsolve.limits.objective:OutputHarmonic",
    "limit_problem": "hbsolve.limits.response_limits:limit_problem",
    "response_limits": "hbsolve.limits.response_limits:response_limits",
    # Time
    "integrate": "transient.integrate:integrate",
    "steady_motion": "transient.steady:steady_motion",
    "sweep": "study.sweep.run:sweep",
    "spread": "study.spread.spread:spread",
    # Measurements
    "read_campaign": "correlation.campaign.read_campaign:read_campaign",
    "read_case": "study.case.setup:read_case",
    "compare": "study.compare.run:compare",
    "diagnose": "study.diagnose.round:diagnose_case",
    # Errors
    "InputError": "geometry.errors:InputError",
    "ComputationFailed": "geometry.errors:ComputationFailed",
}

__all__ = sorted(_HOME)  # named once


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"stickslip has no public name {name!r}: dir(stickslip) lists them")
    require_own_packages()
    module, _, there = _HOME[name].partition(":")
    result = getattr(importlib.import_module(module), there)
    globals()[name] = result
    return result


def __dir__() -> list[str]:
    return __all__
