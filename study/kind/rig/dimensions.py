"""The tables of a rig's case file that give the dimensions of its bodies; what is left out is as in `geometry`."""

from typing import Literal

from casefile.quantity import Angle, Length
from casefile.table import CaseModel
from geometry.blade import Blade
from geometry.damper import Damper
from geometry.decoupler import Decoupler
from geometry.rig import Rig


class BladeDimensions(CaseModel):
    """The rig's blade, and the disc on it that the shaker pushes.

    The fields are those of `geometry.blade.Blade`, `kind` is what a blade's own case file says.
    """

    kind: Literal["rig"] = "rig"
    length: Length = Blade.length
    thickness: Length = Blade.thickness
    edge_thickness: Length = Blade.edge_thickness
    chord: Length = Blade.chord
    flat_width: Length = Blade.flat_width
    root_chord: Length = Blade.root_chord
    root_thickness: Length = Blade.root_thickness
    root_height: Length = Blade.root_height
    contact_height: Length = Blade.contact_height
    contact_length: Length = Blade.contact_length
    pad_clearance: Length = Blade.pad_clearance
    pad_height_above_groove: Length = Blade.pad_height_above_groove
    lip_above_axis: Length = Blade.lip_above_axis
    groove_radius: Length = Blade.groove_radius
    cone_half_angle: Angle = Blade.cone_half_angle
    excitation_height: Length = Blade.excitation_height
    excitation_radius: Length = Rig.excitation_radius

    def blade(self) -> Blade:
        """Its dimensions, checked as a whole."""
        return Blade(**self.model_dump(exclude={"kind", "excitation_radius"}))


class DamperDimensions(CaseModel):
    """Both dampers; the fields are those of `geometry.damper.Damper`."""

    radius: Length = Damper.radius
    cylinder_length: Length = Damper.cylinder_length
    contact_length: Length = Damper.contact_length
    shoulder: Length = Damper.shoulder
    cone_half_angle: Angle = Damper.cone_half_angle

    def damper(self) -> Damper:
        """Its dimensions, checked as a whole."""
        return Damper(**self.model_dump())


class DecouplerDimensions(CaseModel):
    """Both de-couplers; the fields are those of `geometry.decoupler.Decoupler`."""

    width: Length = Decoupler.width
    contact_length: Length = Decoupler.contact_length
    end_clearance: Length = Decoupler.end_clearance
    groove_radius: Length = Decoupler.groove_radius
    lip_above_axis: Length = Decoupler.lip_above_axis
    pad_height_above_groove: Length = Decoupler.pad_height_above_groove
    plate_thickness: Length = Decoupler.plate_thickness
    arm_angle: Angle = Decoupler.arm_angle
    arms_meet: Length = Decoupler.arms_meet
    arm_thickness: Length = Decoupler.arm_thickness
    stub_length: Length = Decoupler.stub_length
    arm_length: Length = Decoupler.arm_length
    neck_thickness: Length = Decoupler.neck_thickness
    neck_length: Length = Decoupler.neck_length
    cell_thickness: Length = Decoupler.cell_thickness
    cell_length: Length = Decoupler.cell_length
    cone_half_angle: Angle = Decoupler.cone_half_angle

    def decoupler(self) -> Decoupler:
        """Its dimensions, checked as a whole."""
        return Decoupler(**self.model_dump())
