"""Variable-stiffness actuators."""
# Written by python/make_stubs.py: do not edit.
import typing
from typing import Any, Callable, Optional

import numpy
from numpy.typing import NDArray

from . import Function, Law, MechanicalModel, Model, Network


class Limits:
    """Where deflection and sigma end. Beyond, a stop takes up energy as well; nothing is clipped."""
    def __init__(self, *, deflection: float = ..., stop_stiffness: float = ..., sigma_lower: float = ..., sigma_upper: float = ..., sigma_stop_stiffness: float = ...) -> None: ...
    @property
    def deflection(self) -> float:
        """[rad], > 0"""
        ...
    @deflection.setter
    def deflection(self, value: float) -> None: ...
    @property
    def stop_stiffness(self) -> float:
        """[N m/rad^2] where deflection is given, > 0"""
        ...
    @stop_stiffness.setter
    def stop_stiffness(self, value: float) -> None: ...
    @property
    def sigma_lower(self) -> float: ...
    @sigma_lower.setter
    def sigma_lower(self, value: float) -> None: ...
    @property
    def sigma_upper(self) -> float: ...
    @sigma_upper.setter
    def sigma_upper(self, value: float) -> None: ...
    @property
    def sigma_stop_stiffness(self) -> float:
        """[J/sigma^3]"""
        ...
    @sigma_stop_stiffness.setter
    def sigma_stop_stiffness(self, value: float) -> None: ...

class Elastic:
    """The elastic energy E(q, theta, sigma) of an actuator: q link angle, theta the motor's equilibrium angle, sigma what sets the stiffness: numbers, or arrays that numpy broadcasts."""
    @property
    def family(self) -> str: ...
    @property
    def title(self) -> str: ...
    @property
    def sigma(self) -> str:
        """What sigma is; empty: the energy does not depend on it."""
        ...
    @property
    def sigma_unit(self) -> str: ...
    @property
    def limits(self) -> Limits: ...
    @property
    def remark(self) -> str:
        """What costs its users accuracy, as a stiffness that jumps; empty: nothing known."""
        ...
    @property
    def loop(self) -> float:
        """Of a measured spring the width of the loop of its rows, loading above unloading [N m]; 0: none that is told from noise."""
        ...
    def energy(self, q: Any, theta: Any, sigma: Any = 0.0) -> Any:
        """E [J]: a float, or an array of their shape"""
        ...
    def slopes(self, q: Any, theta: Any, sigma: Any = 0.0) -> tuple:
        """dE/d(q, theta, sigma): efforts a motion has to bring up; what the spring does is their negative."""
        ...
    def stiffness(self, q: Any, theta: Any, sigma: Any = 0.0) -> Any:
        """d2E/dq2 [N m/rad]: a float, or an array of their shape"""
        ...
    def hessian(self, q: Any, theta: Any, sigma: Any = 0.0) -> NDArray[numpy.float64]:
        """Second derivatives, rows and columns (q, theta, sigma): (..., 3, 3)."""
        ...

class Quantity:
    """A number and where it comes from."""
    @property
    def name(self) -> str: ...
    @property
    def value(self) -> list[float]: ...
    @property
    def unit(self) -> str: ...
    @property
    def provenance(self) -> str:
        """published, derived, from memory (unverified: do not use in design) or illustrative"""
        ...
    @property
    def source(self) -> str: ...

class Device:
    """A device of the catalogue: docs/actuators.md."""
    @property
    def name(self) -> str: ...
    @property
    def title(self) -> str: ...
    @property
    def family(self) -> str:
        """Empty: no model, its parameters are not public."""
        ...
    @property
    def parameters(self) -> list[Quantity]: ...
    @property
    def datasheet(self) -> list[Quantity]: ...
    @property
    def limits(self) -> Limits: ...
    @property
    def remark(self) -> str: ...

class Drive:
    """What moves theta or sigma."""
    def __init__(self, *, kind: Drive.Kind = ..., inertia: float = ..., gear: float = ..., viscous: float = ..., friction: Function = ..., torque_limit: float = ..., rate_limit: float = ..., command: Function = ..., kp: float = ..., kd: float = ..., p: list[float] = ...) -> None: ...
    class Kind:
        fixed: typing.ClassVar[Kind]
        torque: typing.ClassVar[Kind]
        position: typing.ClassVar[Kind]
        rate: typing.ClassVar[Kind]
        servo: typing.ClassVar[Kind]
        @property
        def name(self) -> str: ...
        @property
        def value(self) -> int: ...
        def __init__(self, value: int) -> None: ...
    @property
    def kind(self) -> Drive.Kind: ...
    @kind.setter
    def kind(self, value: Drive.Kind) -> None: ...
    @property
    def inertia(self) -> float:
        """Of torque, position: J on the rotor's side [kg m^2], > 0."""
        ...
    @inertia.setter
    def inertia(self, value: float) -> None: ...
    @property
    def gear(self) -> float: ...
    @gear.setter
    def gear(self, value: float) -> None: ...
    @property
    def viscous(self) -> float:
        """[N m s/rad], >= 0, on the rotor's side."""
        ...
    @viscous.setter
    def viscous(self, value: float) -> None: ...
    @property
    def friction(self) -> Function:
        """Of the gear at its output, force by rate; None: none."""
        ...
    @friction.setter
    def friction(self, value: Function) -> None: ...
    @property
    def torque_limit(self) -> float:
        """L [N m] at the output: L tanh(wish / L)."""
        ...
    @torque_limit.setter
    def torque_limit(self, value: float) -> None: ...
    @property
    def rate_limit(self) -> float:
        """[rad/s] at the output."""
        ...
    @rate_limit.setter
    def rate_limit(self, value: float) -> None: ...
    @property
    def command(self) -> Function:
        """Torque [N m], rate [rad/s] or position [rad] at time t; None: 0, or an open port."""
        ...
    @command.setter
    def command(self, value: Function) -> None: ...
    @property
    def kp(self) -> float:
        """Of position [N m/rad]."""
        ...
    @kp.setter
    def kp(self, value: float) -> None: ...
    @property
    def kd(self) -> float:
        """Of position [N m s/rad]."""
        ...
    @kd.setter
    def kd(self, value: float) -> None: ...
    @property
    def p(self) -> list[float]:
        """Of servo [1/s^3, 1/s^2, 1/s], stable: p1 < p2 p3."""
        ...
    @p.setter
    def p(self, value: list[float]) -> None: ...

class Actuator:
    """An elastic energy and what drives it. Rotors turn about the joint's axis only in what concerns their energy (Spong 1987)."""
    def __init__(self, *, elastic: Elastic = ..., theta: Drive = ..., sigma: Drive = ..., damping: float = ...) -> None: ...
    @property
    def elastic(self) -> Elastic: ...
    @elastic.setter
    def elastic(self, value: Elastic) -> None: ...
    @property
    def theta(self) -> Drive: ...
    @theta.setter
    def theta(self, value: Drive) -> None: ...
    @property
    def sigma(self) -> Drive:
        """Only where the energy depends on it."""
        ...
    @sigma.setter
    def sigma(self, value: Drive) -> None: ...
    @property
    def damping(self) -> float:
        """Beside the spring, between link and rotor [N m s/rad], >= 0."""
        ...
    @damping.setter
    def damping(self, value: float) -> None: ...

def families() -> dict:
    """{family: {parameter: unit}}"""
    ...

def make_elastic(family: str, limits: Limits = ..., **kwargs) -> Elastic:
    """A member of a family; parameters by name, see families()."""
    ...

def table(csv_file: str, smoothing: float = 0.0, limits: Limits = ..., relative_smoothing: float = 0.0) -> Elastic:
    """A measured spring, from a CSV file as the key table of an [[actuator]]: docs/tutorials/actuator.md.

    csv_file: columns deflection [rad], torque [N m] and, where measured, sigma, stiffness [N m/rad] and sigma_effort.
    smoothing: standard deviation of the errors of the torques [N m]; more than 0: places need be no grid and may be repeated.
    relative_smoothing: the same as a share of each torque, as 0.03. Warns of torques that scatter more than stated, or less.
    limits: where none are given for sigma, it has the range of the file. InvalidArgument with file and line: it fits no energy.
    """
    ...

def formula(energy: Any, limits: Limits = ..., **kwargs) -> Elastic:
    """An elastic energy [J] of your own, of the deflection phi = q - theta [rad] and the stiffness setting sigma.

    energy: a text as "0.5*(k0 + k1*sigma^2)*phi^2", whose further names are the parameters, by name; or a function of (phi) or
    (phi, sigma), which is called once, now, and written down as such a text: it may use + - * / **, abs and numpy's functions, no
    comparisons. Torque, stiffness and the effort of sigma are exact derivatives of it. The text is the title of the result.

    limits: where it holds. The range of sigma is required if the energy depends on it; the deflection goes to its limit, or to pi.
    There it has to be finite with a stiffness of 0 or more; else InvalidArgument. TypeError: the function is no formula.
    """
    ...

def devices() -> list[Device]: ...

def device(name: str) -> Device:
    """InvalidArgument for an unknown name lists the known ones."""
    ...

def elastic_of(device: Device) -> Elastic:
    """InvalidArgument for a device without a model."""
    ...

def actuator_model(actuator: Actuator) -> Model:
    """The system of an actuator, without its commands, frictions and limits, which act at its ports.

    x = (link, theta, sigma, momentum of theta, momentum of sigma, servos' rates and accelerations), as far as there are such.
    Ports: 'link' (flow in: joint rate -> dE/dq), 'theta' and 'sigma' by their drives.
    """
    ...

def actuator_start(who: str, actuator: Actuator, link: float, theta: float, sigma: float = 0.0) -> NDArray[numpy.float64]:
    """The start of that state, at rest. link: the joint's own angle at the start [rad]; simulate() refuses another. `who` begins the sentences of what is refused."""
    ...

def attach(network: Network, name: str, joint_port: str, actuator: Actuator) -> None:
    """Adds an actuator `name` to a network and joins it to a joint's port ('<member>.<joint>.torque'), with its commands,
    frictions and limits. Ledger: storages '<name>.spring', '<name>.rotor' of theta, '<name>.sigma_rotor'; works by drive
    '<name>.theta.torque', '.controller', '.rate' or '.servo'; losses '<name>.theta.viscous', '.friction', '.brake'; the same of
    '<name>.sigma'; a loss '<name>.damping' beside the spring. A drive by torque or rate without a command has no work and
    leaves its port '<name>.theta' open. The 'damper' of scenes is commanded: '<name>.damper' is a work, of 0 or less.
    """
    ...
