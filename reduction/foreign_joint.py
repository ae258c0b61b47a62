"""Joints as other programs know them: friction with a constant limit, stops and cubic springs; no varying force."""

from reduction.errors import ExchangeError
from reduction.joint import CubicSpring, ElasticStop, FrictionContact, JenkinsElement, Joint, QuadraticDamper

ForeignJoint = JenkinsElement | ElasticStop | CubicSpring


def foreign_joint(joint: Joint, program: str) -> ForeignJoint:
    """The same joint in the words that other programs have.

    A contact without friction is a stop, k_n max(v - (g - N_0 / k_n), 0).

    Parameters
    ----------
    joint
        Any joint.
    program
        For messages, such as "NLvib".

    Raises
    ------
    ExchangeError
        Friction whose limit follows a varying normal force, or a damper with d abs(v) v.
    """
    if isinstance(joint, QuadraticDamper):
        raise ExchangeError(
            f'joint "{joint.name}" is a damper with the force d |v| v, which {program} does not have: leave it out, or '
            "put a linear damper into the damping matrix"
        )
    if not isinstance(joint, FrictionContact):
        return joint
    if joint.friction_coefficient > 0:
        raise ExchangeError(
            f'joint "{joint.name}" is a friction contact whose normal force varies, which {program} does not have: '
            f"give a JenkinsElement with the limit mu N0 = {joint.friction_coefficient * joint.preload:g} N where it "
            "hardly varies"
        )
    return ElasticStop(
        name=joint.name,
        direction=joint.normal,
        stiffness=joint.normal_stiffness,
        gap=joint.gap - joint.preload / joint.normal_stiffness,
    )
