"""Controllers as closed loops with an energy of their own."""
# Written by python/make_stubs.py: do not edit.
import typing
from typing import Any, Callable, Optional

import numpy
from numpy.typing import NDArray

from . import Function, Law, MechanicalModel, Model, Network


class Finding:
    holds: typing.ClassVar[Finding]
    fails: typing.ClassVar[Finding]
    reported: typing.ClassVar[Finding]
    not_judged: typing.ClassVar[Finding]
    @property
    def name(self) -> str: ...
    @property
    def value(self) -> int: ...
    def __init__(self, value: int) -> None: ...

class CertificateItem:
    """One line of a certificate: a condition with its number and bound, or a figure without a bound."""
    @property
    def name(self) -> str: ...
    @property
    def finding(self) -> Finding: ...
    @property
    def value(self) -> float: ...
    @property
    def bound(self) -> float:
        """NaN: none."""
        ...
    @property
    def text(self) -> str:
        """What was looked at, in a few words."""
        ...
    @property
    def numbers(self) -> list[float]: ...
    @property
    def at(self) -> list[float]:
        """The state or coordinates where the worst was found; may be empty."""
        ...

class Certificate:
    """What was verified of a closed loop, and how."""
    @property
    def title(self) -> str: ...
    @property
    def items(self) -> list[CertificateItem]: ...
    def item(self, name: str) -> CertificateItem: ...
    @property
    def holds(self) -> bool:
        """No item fails, and none is not judged."""
        ...
    def text(self) -> str:
        """A table for people."""
        ...
    def json(self) -> str:
        """The same for programs."""
        ...
    def html(self) -> str:
        """The table for pages."""
        ...
    def __str__(self) -> str: ...
    def __bool__(self) -> bool: ...

class ClosedLoop(Model):
    """A closed loop as a port-Hamiltonian system with the energy H_d it was shaped to have, and a certificate. State: that of
    the plant. The field of this model is the target dynamics; that the plant under the law moves so is what was verified.
    """
    @property
    def plant(self) -> Model: ...
    @property
    def rest(self) -> list[float]:
        """x*: where the loop is to rest."""
        ...
    @property
    def certificate(self) -> Certificate: ...
    @property
    def actuated(self) -> list[int]:
        """Offsets in the plant's u that the law writes."""
        ...
    @property
    def gain_names(self) -> list[str]: ...
    def law(self, t: float, x: Any) -> NDArray[numpy.float64]:
        """u, as many numbers as the plant has inputs, 0 where there is no actuator."""
        ...

class JointSpring:
    """A spring at a joint of one degree of freedom: U = k (q - rest)^2 / 2, or k (1 - cos(q - rest))."""
    def __init__(self, *, port: str = ..., stiffness: float = ..., rest: float = ..., periodic: bool = ...) -> None: ...
    @property
    def port(self) -> str:
        """'shoulder.torque'"""
        ...
    @port.setter
    def port(self, value: str) -> None: ...
    @property
    def stiffness(self) -> float: ...
    @stiffness.setter
    def stiffness(self, value: float) -> None: ...
    @property
    def rest(self) -> float: ...
    @rest.setter
    def rest(self, value: float) -> None: ...
    @property
    def periodic(self) -> bool: ...
    @periodic.setter
    def periodic(self, value: bool) -> None: ...

class PoseSpring:
    """A spring between a body and a place in the world, of a link's point and of its attitude:
    U = k |r - position|^2 / 2 + tr(A (1 - R_d^T R)), A = diag(attitude_stiffness).
    """
    def __init__(self, *, link: str = ..., point: typing.Sequence[float] = ..., stiffness: float = ..., position: typing.Sequence[float] = ..., attitude_stiffness: typing.Sequence[float] = ..., attitude: Any = ...) -> None: ...
    @property
    def link(self) -> str: ...
    @link.setter
    def link(self, value: str) -> None: ...
    @property
    def point(self) -> tuple:
        """In the link's frame [m]."""
        ...
    @point.setter
    def point(self, value: tuple) -> None: ...
    @property
    def stiffness(self) -> float:
        """k [N/m]"""
        ...
    @stiffness.setter
    def stiffness(self, value: float) -> None: ...
    @property
    def position(self) -> tuple:
        """In the world [m]."""
        ...
    @position.setter
    def position(self, value: tuple) -> None: ...
    @property
    def attitude_stiffness(self) -> tuple:
        """[N m]"""
        ...
    @attitude_stiffness.setter
    def attitude_stiffness(self, value: tuple) -> None: ...
    @property
    def attitude(self) -> Any:
        """R_d, (3, 3)."""
        ...
    @attitude.setter
    def attitude(self, value: Any) -> None: ...

class PortDamping:
    """Damping -d y at a port, on each of its numbers."""
    def __init__(self, *, port: str = ..., damping: list[float] = ...) -> None: ...
    @property
    def port(self) -> str: ...
    @port.setter
    def port(self, value: str) -> None: ...
    @property
    def damping(self) -> list[float]:
        """One number for all, or one each."""
        ...
    @damping.setter
    def damping(self, value: list[float]) -> None: ...

class PotentialShaping:
    """What a mechanism shall feel."""
    def __init__(self, *, name: str = ..., joints: list[JointSpring] = ..., poses: list[PoseSpring] = ..., damping: list[PortDamping] = ..., compensate: bool = ..., constant_compensation: bool = ..., actuators: list[str] = ..., zero_momentum: bool = ..., rest: list[float] = ..., tolerance: float = ...) -> None: ...
    @property
    def name(self) -> str: ...
    @name.setter
    def name(self, value: str) -> None: ...
    @property
    def joints(self) -> list[JointSpring]: ...
    @joints.setter
    def joints(self, value: list[JointSpring]) -> None: ...
    @property
    def poses(self) -> list[PoseSpring]: ...
    @poses.setter
    def poses(self, value: list[PoseSpring]) -> None: ...
    @property
    def damping(self) -> list[PortDamping]: ...
    @damping.setter
    def damping(self, value: list[PortDamping]) -> None: ...
    @property
    def compensate(self) -> bool:
        """Takes the plant's own potential away, gravity and the springs of joints, so that H_d = T + U. Raises where it acts at a joint without actuator."""
        ...
    @compensate.setter
    def compensate(self, value: bool) -> None: ...
    @property
    def constant_compensation(self) -> bool:
        """A constant force that balances the plant's potential at the rest point instead."""
        ...
    @constant_compensation.setter
    def constant_compensation(self, value: bool) -> None: ...
    @property
    def actuators(self) -> list[str]:
        """Ports with an actuator; empty: every joint port."""
        ...
    @actuators.setter
    def actuators(self, value: list[str]) -> None: ...
    @property
    def zero_momentum(self) -> bool:
        """For a base that floats without actuators: the loop of total momentum zero."""
        ...
    @zero_momentum.setter
    def zero_momentum(self, value: bool) -> None: ...
    @property
    def rest(self) -> list[float]:
        """Rest coordinates, nq numbers."""
        ...
    @rest.setter
    def rest(self, value: list[float]) -> None: ...
    @property
    def tolerance(self) -> float: ...
    @tolerance.setter
    def tolerance(self, value: float) -> None: ...

class PotentialLoop(ClosedLoop):
    """A mechanism with potential shaping and damping injection: the plant's own structure with

        H_d = H + U (- V),  R_d = R + G Kd G^T,  u = -dU - Kd y.

    Raises InvalidArgument naming the port, link or number at fault, a force no actuator can make, or a rest point that is none.
    """
    def __init__(self, plant: MechanicalModel, shaping: PotentialShaping) -> None: ...

class MatchedLoop(ClosedLoop):
    """A plant under interconnection and damping assignment (IDA-PBC): kinetic and potential energy shaped, the matching equations checked over a region."""
    def residual(self, x: Any) -> tuple[float, float]:
        """Relative residuals of the matching equations, (kinetic, potential)."""
        ...
    def state(self, q: list[float], v: list[float]) -> NDArray[numpy.float64]:
        """(q, p = M(q) v)."""
        ...

class InertiaWheelPendulum:
    """q1 the pendulum from upright, q2 the wheel in the world [rad]: M = diag(I1, I2), V = m3 cos q1. Source: Ortega, Spong, Gomez-Estern, Blankenstein 2002."""
    def __init__(self, *, I1: float = ..., I2: float = ..., m3: float = ..., a1: float = ..., a2: float = ..., a3: float = ..., k1: float = ..., kv: float = ...) -> None: ...
    @property
    def I1(self) -> float:
        """Of the pendulum about its pivot with the wheel's mass at its axis, J + m_w l_w² [kg m²]."""
        ...
    @I1.setter
    def I1(self, value: float) -> None: ...
    @property
    def I2(self) -> float:
        """Of the wheel about its axis [kg m²]."""
        ...
    @I2.setter
    def I2(self, value: float) -> None: ...
    @property
    def m3(self) -> float:
        """No mass: m g l of pendulum and wheel, the torque of gravity when level [N m]."""
        ...
    @m3.setter
    def m3(self, value: float) -> None: ...
    @property
    def a1(self) -> float:
        """M_d = [[a1, a2], [a2, a3]]."""
        ...
    @a1.setter
    def a1(self, value: float) -> None: ...
    @property
    def a2(self) -> float:
        """See a1."""
        ...
    @a2.setter
    def a2(self, value: float) -> None: ...
    @property
    def a3(self) -> float:
        """See a1."""
        ...
    @a3.setter
    def a3(self, value: float) -> None: ...
    @property
    def k1(self) -> float:
        """Of ½ z² in V_d, z = q2 - I1 (a2 + a3)/(I2 (a1 + a2)) q1."""
        ...
    @k1.setter
    def k1(self, value: float) -> None: ...
    @property
    def kv(self) -> float:
        """Damping injected, -kv Gᵀ ∂H_d/∂p."""
        ...
    @kv.setter
    def kv(self, value: float) -> None: ...

class BallAndBeam:
    """q1 the ball from the middle [m], q2 the beam [rad]: M = diag(1, L² + q1²), V = g q1 sin q2, of a ball of 1 kg. Source: Ortega, Spong, Gomez-Estern, Blankenstein 2002, section VI."""
    def __init__(self, *, L: float = ..., g: float = ..., kp: float = ..., kv: float = ...) -> None: ...
    @property
    def L(self) -> float:
        """√(J/m), J of beam and ball about the hinge, the ball there, m of the ball [m]."""
        ...
    @L.setter
    def L(self, value: float) -> None: ...
    @property
    def g(self) -> float:
        """Acceleration of gravity along the beam when upright [m/s²]."""
        ...
    @g.setter
    def g(self, value: float) -> None: ...
    @property
    def kp(self) -> float:
        """Of ½ z² in V_d, z = q2 - asinh(q1/L)/√2."""
        ...
    @kp.setter
    def kp(self, value: float) -> None: ...
    @property
    def kv(self) -> float:
        """Damping injected, -kv Gᵀ ∂H_d/∂p."""
        ...
    @kv.setter
    def kv(self, value: float) -> None: ...

class CartPole:
    """q1 the pole from upright [rad], q2 the cart [m], whose acceleration u is the input: q1'' = a sin q1 - b cos q1 u. Source: Acosta, Ortega, Astolfi, Mahindrakar 2005, section IV."""
    def __init__(self, *, a: float = ..., b: float = ..., k: float = ..., m22: float = ..., P: float = ..., kv: float = ..., q2_rest: float = ...) -> None: ...
    @property
    def a(self) -> float:
        """m g l/J of the pole, J about its hinge; of a point mass g/l [1/s²]."""
        ...
    @a.setter
    def a(self, value: float) -> None: ...
    @property
    def b(self) -> float:
        """m l/J of the pole; of a point mass 1/l [1/m]."""
        ...
    @b.setter
    def b(self, value: float) -> None: ...
    @property
    def k(self) -> float:
        """Scale of M_d, and 1/k of the pole's part of V_d."""
        ...
    @k.setter
    def k(self, value: float) -> None: ...
    @property
    def m22(self) -> float:
        """The constant part of (M_d)_22 = k cos q1 + m22."""
        ...
    @m22.setter
    def m22(self, value: float) -> None: ...
    @property
    def P(self) -> float:
        """Of ½ z² in V_d, z = q2 - q2_rest + a function of q1."""
        ...
    @P.setter
    def P(self, value: float) -> None: ...
    @property
    def kv(self) -> float:
        """Damping injected, -kv Gᵀ ∂H_d/∂p."""
        ...
    @kv.setter
    def kv(self, value: float) -> None: ...
    @property
    def q2_rest(self) -> float:
        """Where the cart is to stop [m]."""
        ...
    @q2_rest.setter
    def q2_rest(self, value: float) -> None: ...

class Acrobot:
    """q1 the shoulder from upright, q2 the elbow [rad]: M = [[c1 + c2 + 2 c3 cos q2, c2 + c3 cos q2], [., c2]], V = g (c4 cos q1 + c5 cos(q1 + q2)). Source: Mahindrakar, Astolfi, Ortega, Viola 2006."""
    def __init__(self, *, c1: float = ..., c2: float = ..., c3: float = ..., c4: float = ..., c5: float = ..., g: float = ..., a2: float = ..., a3: float = ..., ku: float = ..., kv: float = ...) -> None: ...
    @staticmethod
    def of(plant: Model, g: float = 9.81) -> Acrobot:
        """The numbers of the dynamics read off a plant with coordinates (shoulder from upright, elbow)."""
        ...
    @property
    def c1(self) -> float:
        """J1 + m1 lc1² + m2 l1² about the shoulder [kg m²]; l1: from shoulder to elbow."""
        ...
    @c1.setter
    def c1(self, value: float) -> None: ...
    @property
    def c2(self) -> float:
        """J2 + m2 lc2² about the elbow [kg m²]; lc2: from the elbow to the centre of mass."""
        ...
    @c2.setter
    def c2(self, value: float) -> None: ...
    @property
    def c3(self) -> float:
        """m2 l1 lc2 [kg m²]."""
        ...
    @c3.setter
    def c3(self, value: float) -> None: ...
    @property
    def c4(self) -> float:
        """m1 lc1 + m2 l1 [kg m]; lc1: from the shoulder to the centre of mass."""
        ...
    @c4.setter
    def c4(self, value: float) -> None: ...
    @property
    def c5(self) -> float:
        """m2 lc2 [kg m]."""
        ...
    @c5.setter
    def c5(self, value: float) -> None: ...
    @property
    def g(self) -> float:
        """Acceleration of gravity [m/s²]."""
        ...
    @g.setter
    def g(self, value: float) -> None: ...
    @property
    def a2(self) -> float:
        """M_d = [[k a2, a2], [a2, a3]], k = 1 - √(c1/c2)."""
        ...
    @a2.setter
    def a2(self, value: float) -> None: ...
    @property
    def a3(self) -> float:
        """See a2."""
        ...
    @a3.setter
    def a3(self, value: float) -> None: ...
    @property
    def ku(self) -> float:
        """Of ½ z² in V_d, z = q2 + (1 + √(c1/c2)) q1."""
        ...
    @ku.setter
    def ku(self, value: float) -> None: ...
    @property
    def kv(self) -> float:
        """Damping injected, -kv Gᵀ ∂H_d/∂p."""
        ...
    @kv.setter
    def kv(self, value: float) -> None: ...

class NullSpacePosture:
    """A posture for the degrees of freedom that a task leaves, and the tank that pays for keeping it out of the task."""
    def __init__(self, *, stiffness: list[float] = ..., rest: list[float] = ..., level: float = ..., least: float = ..., most: float = ..., fill: float = ...) -> None: ...
    @property
    def stiffness(self) -> list[float]:
        """K_n of each joint [N m/rad | N/m]; one number: all."""
        ...
    @stiffness.setter
    def stiffness(self, value: list[float]) -> None: ...
    @property
    def rest(self) -> list[float]:
        """q_n; need not agree with the task."""
        ...
    @rest.setter
    def rest(self, value: list[float]) -> None: ...
    @property
    def level(self) -> float:
        """Energy in the tank at the start [J]."""
        ...
    @level.setter
    def level(self, value: float) -> None: ...
    @property
    def least(self) -> float: ...
    @least.setter
    def least(self, value: float) -> None: ...
    @property
    def most(self) -> float:
        """Bounds it keeps [J]."""
        ...
    @most.setter
    def most(self, value: float) -> None: ...
    @property
    def fill(self) -> float:
        """Share of the injected damping's power that goes into the tank, in [0, 1]."""
        ...
    @fill.setter
    def fill(self, value: float) -> None: ...

class NullSpaceLoop(ClosedLoop):
    """A redundant arm that holds its hand at a place by a spring and its posture by another that the hand does not feel:

        tau = -dU_x - Kd q' - (1 - alpha J^T Jbar^T) K_n (q - q_n),   Jbar = M^-1 J^T (J M^-1 J^T)^-1

    Energy that the projected posture makes comes from a tank, whose energy E is a state: (q, p, E). H_d never rises.
    task: a PotentialShaping with one pose, damping, and a rest near which to look. Raises InvalidArgument for a task that leaves
    no degree of freedom. Source: Khatib 1987; Dietrich, Ott, Stramigioli 2016.
    """
    def __init__(self, plant: MechanicalModel, task: PotentialShaping, posture: NullSpacePosture) -> None: ...
    @property
    def task_size(self) -> int: ...
    def projected(self, q: Any, tau: Any) -> NDArray[numpy.float64]:
        """(1 - J^T Jbar^T) tau at q: what the task does not feel."""
        ...
    def task_acceleration(self, q: Any, tau: Any) -> NDArray[numpy.float64]:
        """J M^-1 tau."""
        ...

class WheelBase:
    """Pose of a floating base by thrusters and reaction wheels: a shaping that asks for a wrench at the base, its force made by
    the thrusters and its moment by the wheels, least |tau|. Whatever spin the wheels have, H_d falls. Not a ClosedLoop: the wheels
    turn on at rest.
    """
    def __init__(self, shaped: PotentialLoop, wheels: list[str], *, base_port: str = 'base.wrench', limits: list[float] = [], capacities: list[float] = [], period: float = 0.0, samples: int = 500, tolerance: float = 1e-10) -> None:
        """wheels: their ports, 'wheel_x.torque', of axisymmetric wheels on the base, three axes or more. limits: largest |torque| of each [N m]; none: without. capacities: largest momentum of each [N m s], of torques held for `period` [s]."""
        ...
    @property
    def certificate(self) -> Certificate: ...
    def law(self, x: Any) -> NDArray[numpy.float64]:
        """u of the plant: force, no moment, wheels, joints."""
        ...
    def hamiltonian(self, x: Any) -> float:
        """H_d [J]."""
        ...
    def dissipation(self, x: Any) -> float:
        """The power H_d falls by [W]."""
        ...
    def control(self, network: Network, name: str, member: str, *, period: float = 0.0) -> Network:
        """Puts the law on the ports of a network's member."""
        ...

class Trajectory:
    """Where the joints are to be: q_d(t) with two derivatives."""
    def at(self, t: float) -> tuple:
        """(q_d, q_d', q_d'') at time t."""
        ...

class PdPlus:
    """Tracking of a fully actuated arm:

        tau = M(q) q_d'' + C(q, q') q_d' + D q' + dV - Kp e - Kd e',   e = q - q_d

    The error energy H_e = e'^T M e' / 2 + e^T Kp e / 2 falls exactly by e'^T Kd e'. Source: Paden, Panja 1988.
    """
    def __init__(self, plant: MechanicalModel, trajectory: Trajectory, kp: list[float], kd: list[float]) -> None: ...
    def error(self, t: float, x: list[float]) -> float:
        """The largest |e_i| [rad | m] at the plant's state x = (q, p)."""
        ...
    def error_energy(self, t: float, x: list[float]) -> float:
        """H_e [J]."""
        ...
    def error_power(self, t: float, x: list[float]) -> float:
        """e'^T Kd e' [W], the rate H_e falls at."""
        ...
    def control(self, network: Network, name: str, member: str, *, period: float = 0.0) -> Network:
        """Puts the law on the ports of a network's member."""
        ...

class SweepResult:
    """One run of a sweep."""
    @property
    def gains(self) -> list[float]: ...
    @property
    def settling(self) -> float:
        """Time after which H_d stays below `settled` of its start [s]; inf: never, or not `defined`."""
        ...
    @property
    def peak(self) -> float:
        """Largest |u| [N m | N]."""
        ...
    @property
    def residual(self) -> float:
        """Share of H_d that is left at the end."""
        ...
    @property
    def max_excursion(self) -> float:
        """Largest |q_i - q_i*|."""
        ...
    @property
    def left(self) -> float:
        """Deprecated: residual."""
        ...
    @property
    def travel(self) -> float:
        """Deprecated: max_excursion."""
        ...
    @property
    def finite(self) -> bool: ...
    @property
    def defined(self) -> bool:
        """False: the run left where the law is meant (half_width of numerical_matching)."""
        ...
    @property
    def elsewhere(self) -> bool:
        """True: H_d came down at another minimum, as a full turn away."""
        ...

class JointSwingUp:
    """The law of swing_up(): a mechanism swings up by the energy of one driven joint."""
    @property
    def certificate(self) -> Certificate: ...
    @property
    def wanted_energy(self) -> float:
        """H at rest in the upright and the margin [J]."""
        ...
    def check_start(self, x: list[float]) -> None:
        """Raises InvalidArgument for a start (q, p), (2 nq,), that plant and law never leave."""
        ...
    def control(self, network: Network, name: str, member: str, *, period: float = 0.0) -> Network:
        """Puts the law on its port of a network's member. period [s]; 0: continuous."""
        ...

class Lqr:
    """The linear-quadratic regulator of a mechanism about an equilibrium: u = u* - K (x - x*), x = (q, p). Local: the
    certificate has the poles of the linearised loop. Source: Kalman 1960.
    """
    def __init__(self, plant: MechanicalModel, actuators: list[str], rest: list[float], *, position: list[float], rate: list[float], effort: list[float], periodic: list[bool] = []) -> None:
        """actuators: ports of one number each. rest: q*, (nq,). Weights: position and rate of each coordinate, (nq,), effort of each actuator. periodic: which angles count modulo full turns, (nq,). Raises InvalidArgument for weights of the wrong number or sign, and a rest that is no equilibrium or that the actuators cannot stabilise."""
        ...
    @property
    def certificate(self) -> Certificate: ...
    def certify_sampled(self, period: float, delay: int = 0) -> None:
        """Adds the condition 'sampled': the held linear loop is stable. period [s]. Of several periods the worst stays, its text tells the rate. Raises InvalidArgument with a rate that would do."""
        ...
    @property
    def gains(self) -> Any:
        """K, (actuators, 2 nq), on (q - q*, p)."""
        ...
    @property
    def effort(self) -> list[float]:
        """u* of each actuator."""
        ...
    def cost_to_go(self, x: Any) -> float:
        """(x - x*)^T P (x - x*) at (q, p), (2 nq,)."""
        ...
    def falling_level(self, limits: list[float] = []) -> float:
        """Up to which cost_to_go() falls along the plant under the law: 400 directions and the worst near them; 0: none. Some ms."""
        ...
    def control(self, network: Network, name: str, member: str, *, limits: list[float] = [], period: float = 0.0) -> Network:
        """Puts the law on the ports of a network's member. limits: largest |u| of each; none: without. period [s]; 0: continuous."""
        ...

def joint_regulation(model: MechanicalModel, rest: list[float], bandwidth: float, damping_ratio: float, skip: list[str] = []) -> PotentialShaping:
    """Joint springs and dampers of a bandwidth [rad/s] and damping ratio at the rest point: k = M_jj w^2, d = 2 zeta M_jj w,
    M_jj the mass the joint feels there while the others stand still. A PotentialShaping. skip: joints without an actuator, which get
    neither: names of ports or of their joints, "elbow.torque" or "elbow"; another name raises InvalidArgument. Where gravity or a
    spring, JointSpec(stiffness=), acts at one, it takes two settings: shaping.compensate = False, since nothing can cancel the
    force there, and in rest the angle at which that joint hangs, where the force is 0 with the others at their rest; another is
    refused as no rest point.
    """
    ...

def inertia_wheel_pendulum(design: InertiaWheelPendulum = ..., plant: Optional[Model] = None) -> MatchedLoop:
    """Pendulum from upright with a reaction wheel. plant: another one to match the law to, else the design's own."""
    ...

def inertia_wheel_gains(design: InertiaWheelPendulum, bandwidth: float, damping_ratio: float = 1.0) -> InertiaWheelPendulum:
    """The design with the gains by which the linearised loop has twice the poles of s² + 2ζω s + ω²; bandwidth ω [rad/s]."""
    ...

def ball_and_beam(design: BallAndBeam = ..., plant: Optional[Model] = None) -> MatchedLoop: ...

def cart_pole(design: CartPole = ..., plant: Optional[Model] = None) -> MatchedLoop:
    """After partial feedback linearisation; the pole within 90 degrees of upright."""
    ...

def acrobot(design: Acrobot = ..., plant: Optional[Model] = None, elbow_port: str = 'elbow.force') -> MatchedLoop: ...

def inertia_wheel_plant(design: InertiaWheelPendulum = ...) -> Model: ...

def ball_and_beam_plant(design: BallAndBeam = ...) -> Model: ...

def cart_pole_plant(design: CartPole = ...) -> Model: ...

def acrobot_plant(design: Acrobot = ...) -> Model: ...

def simulate(loop: ClosedLoop, x0: list[float], *, duration: float = 10.0, step: float = 0.01, method: str = 'gauss8', period: float = 0.0, limits: Union[float, list[float]] = [], plant: Optional[Model] = None, record: float = 0.0) -> dict:
    """A simulated run of the plant under the law: a dict of arrays t, H (H_d), x, u (actuated inputs), and peak (largest |u|),
    rise (largest rise of H_d over a step [J]), dissipated, injected (what sampling, limits and another plant put in [J]),
    finished, outcome. period of the controller [s], a multiple of step; 0: continuous. limits: largest |u| of each actuated input
    [N m | N], or one number for all; []: without. record: [s] between records.
    """
    ...

def certify(loop: ClosedLoop, *, lower: list[float], upper: list[float], rate: float = 1.0, samples: int = 2000, starts: list[list[float]] = [], periods: list[float] = ..., duration: float = 10.0, step: float = 0.01, settled: float = 0.01, limits: Union[float, list[float]] = []) -> Certificate:
    """The certificate of the constructor, and: H_d' against the formula, linearised eigenvalues, critical points and basin (up to 3
    coordinates), H_d of each start against it, inputs on the basin, runs of the plant as sampled. lower, upper: the box of
    coordinates looked at, (nq,); rate: |q'_i| up to this. starts: states (nx,) that the runs start from; periods of the controller
    in them [s], multiples of step, 0: continuous. limits: largest |u| of each actuated input [N m | N], or one number for all; []:
    without. They act in the runs, and the shares of them that runs and basin take are told.
    Raises InvalidArgument for no samples, for periods without starts, for limits and starts that do not fit the loop, and, up to 3 coordinates, for a box
    without the rest point inside; for a box and starts beyond the half_width of numerical_matching() too. Cost: seconds.
    """
    ...

def control(network: Network, name: str, member: str, loop: ClosedLoop, *, limits: list[float] = [], period: float = 0.0) -> Network:
    """Puts the law of a loop on the ports of a member of a network. Ledger: `name`, and `name`.hold of a sampled one; over
    several ports `name`.<port>. limits: largest |u| of each actuated input; none: without.
    """
    ...

def rest_to_rest(start: list[float], end: list[float], duration: float) -> Trajectory:
    """From one set of coordinates to another: a polynomial of degree 7 with zero rates, accelerations and jerks at both ends."""
    ...

def sines(centre: list[float], amplitude: list[float], frequency: list[float]) -> Trajectory:
    """q_i = centre_i + amplitude_i sin(2 pi frequency_i t), frequencies in Hz."""
    ...

def sweep(loop: ClosedLoop, gains: list[list[float]], *, start: list[float], duration: float = 20.0, step: float = 0.01, settled: float = 0.01, threads: int = 0, limits: list[float] = []) -> list[SweepResult]:
    """Closed-loop runs with other gains, one row each in the order of gain_names, eight in SIMD lanes at a time. Results in the order of `gains`, the same for any number of threads (0: as many as the machine has). limits: largest |u| of each actuated input in the runs."""
    ...

def grid(values: list[list[float]]) -> list[list[float]]:
    """All combinations of the values of each gain, the last one fastest."""
    ...

def logarithmic(low: float, high: float, count: int) -> list[float]:
    """Values from low to high, even in their logarithms."""
    ...

def fastest(results: list[SweepResult], limit: float) -> Optional[int]:
    """Index of the run that settles first among those with peak <= limit; None if none does."""
    ...

def numerical_matching(plant: Model, *, actuator: str, ratio: float, unactuated: int = 1, half_width: float = 1.0, scale: float = 1.0, determinant: float = 1.0, ku: float = 100.0, kv: float = 1.0, other: float = 3.0, rate: float = 2.0, degree: int = 60, matching: float = 1e-06, name: str = 'numerical matching', rest: list[float] = ...) -> MatchedLoop:
    """Matching (IDA-PBC) of two coordinates with one actuator without a closed form: a MatchedLoop that rests at q = rest.

    plant: two coordinates, an equilibrium at q = rest, from which r and s count: state the upright if the model hangs at 0 (the
    certificate has a line "rest without the law" where the design is for a hanging position). Its masses depend on the coordinate
    r without actuator alone (a pendubot, a cart and pole). actuator: port of the other one, s. ratio: rho = lambda_s/lambda_r of
    lambda = M^-1 M_d e_r. unactuated: r, 0 or 1; it is looked at within +-half_width [rad | m] of rest, beyond which
    the law is not defined (nan, or any number) and certify() refuses boxes and starts; |s| up to `other`, |q'_i| up to `rate`. scale: |lambda_r| at rest;
    determinant: det M_d over its (r, r) number. ku, kv: gains of s - rho r and of damping. degree of the Chebyshev polynomials;
    matching: bound of the relative residuals. Raises InvalidArgument for an actuator of r, a rest at which r is not in equilibrium or near which nothing pulls it, where rho M_rs + M_rr vanishes in the interval, with the place,
    where the polynomials do not resolve the functions, and for residuals above the bound. Cost: some ms to some 100 ms.
    Source: after Auckly, Kapitanski, White 2000.
    """
    ...

def numerical_matching_gains(plant: Model, *, bandwidth: float, damping_ratio: float = 0.7, ratio: float = 0.0, unactuated: int = 1, scale: float = 1.0, rest: list[float] = ...) -> dict:
    """ratio, ku, kv and determinant of numerical_matching() by a bandwidth [rad/s] and a damping ratio: a dict, as in
    numerical_matching(plant, actuator=..., **numerical_matching_gains(plant, bandwidth=7)).

    The loop linearised at the rest point has both twice. The ratio alone decides on the bandwidth: of one that is given (not 0) the
    nearest are found. The other arguments are those of numerical_matching. Raises InvalidArgument for numbers that are not above 0, a
    rest that is no equilibrium, and where no gains make the rest point attract. Cost: some 100 ms.
    """
    ...

def swing_up(plant: MechanicalModel, actuator: str, upright: list[float], *, bandwidth: Optional[float] = None, damping_ratio: float = 0.3, pump: float = 0.0, energy: float = 0.0, inertia: float = 0.0, stiffness: float = 0.0, damping: float = 0.0, limit: float = ..., margin: Optional[float] = None) -> JointSwingUp:
    """Swings a mechanism up by the energy that one driven joint supplies: a JointSwingUp with its certificate.

    actuator: port of the driven joint, 'shoulder.torque'. upright: q*, (nq,) [rad | m]. Gains by the bandwidth [rad/s] and damping
    ratio of the driven joint, with a pump [rad/s^2 | m/s^2] against friction of the other joints; or the four numbers energy,
    inertia, stiffness, damping (docs/controllers.md). limit: of |u| [N m | N]. margin: energy aimed at above that of the upright
    [J]. It does not balance: hand_over() lets an Lqr take over. Raises InvalidArgument for joints of several degrees of freedom, closed loops,
    and gains for which the law is not defined everywhere. Source: Astrom, Furuta 2000; Fantoni, Lozano 2002.
    """
    ...

def hand_over(network: Network, member: str, swing_up: JointSwingUp, balance: Lqr, *, period: float, limits: list[float] = [], level: Optional[float] = None, leave: float = 4.0, names: tuple[str, str] = ('swing_up', 'balance')) -> Network:
    """Puts a JointSwingUp and an Lqr on the ports of a network's member, both sampled every `period` [s]: the Lqr acts
    once its cost_to_go() is below `level` (None: falling_level()), the swing-up again where it is above leave * level. limits: of the
    Lqr. names: their rows in the ledger. Raises InvalidArgument where the cost-to-go falls nowhere, or leave is 1 or less.
    """
    ...

def matched_from_texts(plant: Model, actuated: list[str], coordinates: list[str], Md: list[list[str]], Vd: str, gains: list[tuple[str, float]], solve_skew: bool, rest: list[float], lower: list[float], upper: list[float], rate: float, samples: int, matching: float, refuse: bool, name: str) -> MatchedLoop:
    """What matched_loop() calls, with texts for its formulas."""
    ...
