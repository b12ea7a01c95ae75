"""The compiled part of porthos."""
# Written by python/make_stubs.py: do not edit.
import typing
from typing import Any, Callable, Optional

import numpy
from numpy.typing import NDArray

from . import energy_shaping as energy_shaping, vsa as vsa


class InvalidArgument(ValueError):
    """A user's mistake: the text names what was wrong, its value and what was expected (and file:line for files)."""
    ...

class IoError(OSError):
    """A file that cannot be written: its name and the reason of the operating system."""
    ...

class Dual:
    """Forward-mode derivative along one direction: v + d eps with eps^2 = 0.

    Object arrays of it go through systems and laws written in Python; numpy's sin, cos, tan, sqrt, exp, log, tanh, sinh and cosh
    take them, those of math do not.
    """
    def __init__(self, v: float, d: float = 0.0) -> None: ...
    @property
    def v(self) -> float:
        """Value."""
        ...
    @v.setter
    def v(self, value: float) -> None: ...
    @property
    def d(self) -> float:
        """Derivative along the seeded direction."""
        ...
    @d.setter
    def d(self, value: float) -> None: ...
    @typing.overload
    def __add__(self, arg0: Dual) -> Dual: ...
    @typing.overload
    def __add__(self, arg0: float) -> Dual: ...
    def __radd__(self, arg0: float) -> Dual: ...
    @typing.overload
    def __sub__(self, arg0: Dual) -> Dual: ...
    @typing.overload
    def __sub__(self, arg0: float) -> Dual: ...
    def __rsub__(self, arg0: float) -> Dual: ...
    @typing.overload
    def __mul__(self, arg0: Dual) -> Dual: ...
    @typing.overload
    def __mul__(self, arg0: float) -> Dual: ...
    def __rmul__(self, arg0: float) -> Dual: ...
    @typing.overload
    def __truediv__(self, arg0: Dual) -> Dual: ...
    @typing.overload
    def __truediv__(self, arg0: float) -> Dual: ...
    def __rtruediv__(self, arg0: float) -> Dual: ...
    @typing.overload
    def __lt__(self, arg0: Dual) -> bool: ...
    @typing.overload
    def __lt__(self, arg0: float) -> bool: ...
    @typing.overload
    def __gt__(self, arg0: Dual) -> bool: ...
    @typing.overload
    def __gt__(self, arg0: float) -> bool: ...
    @typing.overload
    def __le__(self, arg0: Dual) -> bool: ...
    @typing.overload
    def __le__(self, arg0: float) -> bool: ...
    @typing.overload
    def __ge__(self, arg0: Dual) -> bool: ...
    @typing.overload
    def __ge__(self, arg0: float) -> bool: ...
    def __neg__(self) -> Dual: ...
    def __pow__(self, arg0: float) -> Dual: ...
    def __float__(self) -> float: ...
    def __abs__(self) -> Dual: ...
    def fabs(self) -> Dual: ...
    def square(self) -> Dual: ...
    def conjugate(self) -> Dual: ...
    def sin(self) -> Dual: ...
    def cos(self) -> Dual: ...
    def tan(self) -> Dual: ...
    def sqrt(self) -> Dual: ...
    def exp(self) -> Dual: ...
    def log(self) -> Dual: ...
    def tanh(self) -> Dual: ...
    def sinh(self) -> Dual: ...
    def cosh(self) -> Dual: ...

class Quad:
    """A 113-bit float, of reference solutions. Like Dual in object arrays."""
    def __init__(self, v: float) -> None: ...
    @typing.overload
    def __add__(self, arg0: Quad) -> Quad: ...
    @typing.overload
    def __add__(self, arg0: float) -> Quad: ...
    def __radd__(self, arg0: float) -> Quad: ...
    @typing.overload
    def __sub__(self, arg0: Quad) -> Quad: ...
    @typing.overload
    def __sub__(self, arg0: float) -> Quad: ...
    def __rsub__(self, arg0: float) -> Quad: ...
    @typing.overload
    def __mul__(self, arg0: Quad) -> Quad: ...
    @typing.overload
    def __mul__(self, arg0: float) -> Quad: ...
    def __rmul__(self, arg0: float) -> Quad: ...
    @typing.overload
    def __truediv__(self, arg0: Quad) -> Quad: ...
    @typing.overload
    def __truediv__(self, arg0: float) -> Quad: ...
    def __rtruediv__(self, arg0: float) -> Quad: ...
    @typing.overload
    def __lt__(self, arg0: Quad) -> bool: ...
    @typing.overload
    def __lt__(self, arg0: float) -> bool: ...
    @typing.overload
    def __gt__(self, arg0: Quad) -> bool: ...
    @typing.overload
    def __gt__(self, arg0: float) -> bool: ...
    @typing.overload
    def __le__(self, arg0: Quad) -> bool: ...
    @typing.overload
    def __le__(self, arg0: float) -> bool: ...
    @typing.overload
    def __ge__(self, arg0: Quad) -> bool: ...
    @typing.overload
    def __ge__(self, arg0: float) -> bool: ...
    def __neg__(self) -> Quad: ...
    def __pow__(self, arg0: float) -> Quad: ...
    def __float__(self) -> float: ...
    def __abs__(self) -> Quad: ...
    def fabs(self) -> Quad: ...
    def square(self) -> Quad: ...
    def conjugate(self) -> Quad: ...
    def sin(self) -> Quad: ...
    def cos(self) -> Quad: ...
    def tan(self) -> Quad: ...
    def sqrt(self) -> Quad: ...
    def exp(self) -> Quad: ...
    def log(self) -> Quad: ...
    def tanh(self) -> Quad: ...
    def sinh(self) -> Quad: ...
    def cosh(self) -> Quad: ...

class BlockKind:
    """linear: any real number. angle: 2 pi-periodic, kept in (-pi, pi] plus a turn count. rotation: a quaternion (w, x, y, z), body to parent, whose conjugate block is its lift."""
    linear: typing.ClassVar[BlockKind]
    angle: typing.ClassVar[BlockKind]
    rotation: typing.ClassVar[BlockKind]
    @property
    def name(self) -> str: ...
    @property
    def value(self) -> int: ...
    def __init__(self, value: int) -> None: ...

class Block:
    """A slice of the state vector."""
    def __init__(self, *, name: str = ..., kind: BlockKind = ..., at: int = ..., size: int = ..., momentum: int = ..., unit: str = ..., momentum_unit: str = ...) -> None: ...
    @property
    def name(self) -> str: ...
    @name.setter
    def name(self, value: str) -> None: ...
    @property
    def kind(self) -> BlockKind: ...
    @kind.setter
    def kind(self, value: BlockKind) -> None: ...
    @property
    def at(self) -> int:
        """Offset of its coordinates in the state."""
        ...
    @at.setter
    def at(self, value: int) -> None: ...
    @property
    def size(self) -> int: ...
    @size.setter
    def size(self, value: int) -> None: ...
    @property
    def momentum(self) -> int:
        """Offset of the conjugate block, -1 for none."""
        ...
    @momentum.setter
    def momentum(self, value: int) -> None: ...
    @property
    def unit(self) -> str: ...
    @unit.setter
    def unit(self, value: str) -> None: ...
    @property
    def momentum_unit(self) -> str: ...
    @momentum_unit.setter
    def momentum_unit(self, value: str) -> None: ...

class PortKind:
    """effort in, flow out (a force or torque drives; a rate answers), or the other way round."""
    effort_in: typing.ClassVar[PortKind]
    flow_in: typing.ClassVar[PortKind]
    @property
    def name(self) -> str: ...
    @property
    def value(self) -> int: ...
    def __init__(self, value: int) -> None: ...

class Port:
    """A power port. Sign: u y is the power flowing into the system [W]."""
    def __init__(self, *, name: str = ..., kind: PortKind = ..., size: int = ..., at: int = ..., input_unit: str = ..., output_unit: str = ..., required: bool = ...) -> None: ...
    @property
    def name(self) -> str: ...
    @name.setter
    def name(self, value: str) -> None: ...
    @property
    def kind(self) -> PortKind: ...
    @kind.setter
    def kind(self, value: PortKind) -> None: ...
    @property
    def size(self) -> int: ...
    @size.setter
    def size(self, value: int) -> None: ...
    @property
    def at(self) -> int:
        """Offset of this port in u and in y."""
        ...
    @at.setter
    def at(self, value: int) -> None: ...
    @property
    def input_unit(self) -> str: ...
    @input_unit.setter
    def input_unit(self, value: str) -> None: ...
    @property
    def output_unit(self) -> str: ...
    @output_unit.setter
    def output_unit(self, value: str) -> None: ...
    @property
    def required(self) -> bool:
        """Means nothing unless it is joined to something."""
        ...
    @required.setter
    def required(self, value: bool) -> None: ...

class PowerKind:
    """supplied adds to the stored energy, dissipated takes away, observed is no part of this balance."""
    supplied: typing.ClassVar[PowerKind]
    dissipated: typing.ClassVar[PowerKind]
    observed: typing.ClassVar[PowerKind]
    @property
    def name(self) -> str: ...
    @property
    def value(self) -> int: ...
    def __init__(self, value: int) -> None: ...

class PowerAccount:
    """A power that changes the stored energy."""
    def __init__(self, *, name: str = ..., kind: PowerKind = ..., control: bool = ...) -> None: ...
    @property
    def name(self) -> str: ...
    @name.setter
    def name(self, value: str) -> None: ...
    @property
    def kind(self) -> PowerKind: ...
    @kind.setter
    def kind(self, value: PowerKind) -> None: ...
    @property
    def control(self) -> bool:
        """A controller's."""
        ...
    @control.setter
    def control(self, value: bool) -> None: ...

class Invariant:
    """A quantity the unforced, undamped field keeps."""
    def __init__(self, *, name: str = ..., size: int = ..., at: int = ..., degree: int = ..., unit: str = ...) -> None: ...
    @property
    def name(self) -> str: ...
    @name.setter
    def name(self, value: str) -> None: ...
    @property
    def size(self) -> int: ...
    @size.setter
    def size(self, value: int) -> None: ...
    @property
    def at(self) -> int:
        """Offset in the vector of all invariants."""
        ...
    @at.setter
    def at(self, value: int) -> None: ...
    @property
    def degree(self) -> int:
        """1 linear, 2 quadratic in x, 0 any other function."""
        ...
    @degree.setter
    def degree(self, value: int) -> None: ...
    @property
    def unit(self) -> str: ...
    @unit.setter
    def unit(self, value: str) -> None: ...

class Traits:
    def __init__(self, *, autonomous: bool = ..., canonical: bool = ..., separable: bool = ..., quadratic: bool = ..., lossless: bool = ...) -> None: ...
    @property
    def autonomous(self) -> bool: ...
    @autonomous.setter
    def autonomous(self, value: bool) -> None: ...
    @property
    def canonical(self) -> bool:
        """x = (q, p) in two halves and J = [0 I; -I 0]."""
        ...
    @canonical.setter
    def canonical(self, value: bool) -> None: ...
    @property
    def separable(self) -> bool:
        """H = T(p) + V(q)."""
        ...
    @separable.setter
    def separable(self, value: bool) -> None: ...
    @property
    def quadratic(self) -> bool:
        """H has at most degree two in the momenta that blocks name."""
        ...
    @quadratic.setter
    def quadratic(self, value: bool) -> None: ...
    @property
    def lossless(self) -> bool:
        """R = 0."""
        ...
    @lossless.setter
    def lossless(self, value: bool) -> None: ...

class Description:
    """What a port-Hamiltonian system says of itself. Lists are handed out as copies: set them whole."""
    def __init__(self, *, name: str = ..., nx: int = ..., nu: int = ..., blocks: list[Block] = ..., ports: list[Port] = ..., invariants: list[Invariant] = ..., traits: Traits = ..., storages: list[str] = ..., powers: list[PowerAccount] = ...) -> None: ...
    @property
    def name(self) -> str: ...
    @name.setter
    def name(self, value: str) -> None: ...
    @property
    def nx(self) -> int:
        """Numbers in the state."""
        ...
    @nx.setter
    def nx(self, value: int) -> None: ...
    @property
    def nu(self) -> int:
        """Numbers in the input, and in the output."""
        ...
    @nu.setter
    def nu(self, value: int) -> None: ...
    @property
    def blocks(self) -> list[Block]: ...
    @blocks.setter
    def blocks(self, value: list[Block]) -> None: ...
    @property
    def ports(self) -> list[Port]: ...
    @ports.setter
    def ports(self, value: list[Port]) -> None: ...
    @property
    def invariants(self) -> list[Invariant]:
        """Besides H."""
        ...
    @invariants.setter
    def invariants(self, value: list[Invariant]) -> None: ...
    @property
    def traits(self) -> Traits: ...
    @traits.setter
    def traits(self, value: Traits) -> None: ...
    @property
    def storages(self) -> list[str]:
        """Parts of H, for the ledger."""
        ...
    @storages.setter
    def storages(self, value: list[str]) -> None: ...
    @property
    def powers(self) -> list[PowerAccount]:
        """d/dt sum of storages = sum supplied - sum dissipated, with all open ports at u = 0."""
        ...
    @powers.setter
    def powers(self, value: list[PowerAccount]) -> None: ...
    def invariant_count(self) -> int: ...

class Model:
    """A port-Hamiltonian system: immutable, shared by threads."""
    @property
    def description(self) -> Description: ...
    def instantiate(self) -> System:
        """The evaluator: hamiltonian, gradient, field and the rest on numpy arrays."""
        ...

class System:
    """One system evaluated: an immutable model seen through a workspace of its own. Model.instantiate() makes one.

        x' = (J(x) - R(x)) e + G(x) u,    y = G(x)^T e,    e = dH/dx(x)

    Arrays: x, e, dx have nx numbers, u and y have nu; each of one state, or all of n, (n, nx). u left out is zero. Angles
    count no turns.
    """
    @property
    def description(self) -> Description: ...
    @property
    def model(self) -> Model: ...
    def hamiltonian(self, x: NDArray[numpy.float64], out: Optional[NDArray[numpy.float64]] = None) -> typing.Union[float, NDArray[numpy.float64]]:
        """H(x) [J]: a number, or (n,) of a batch."""
        ...
    def gradient(self, x: NDArray[numpy.float64], out: Optional[NDArray[numpy.float64]] = None) -> NDArray[numpy.float64]:
        """e = dH/dx."""
        ...
    def field(self, t: float, x: NDArray[numpy.float64], u: Optional[NDArray[numpy.float64]] = None, out: Optional[NDArray[numpy.float64]] = None) -> NDArray[numpy.float64]:
        """dx = (J - R) e + G u at time t, plus the system's own sources."""
        ...
    def rate(self, t: float, x: NDArray[numpy.float64], e: NDArray[numpy.float64], out: Optional[NDArray[numpy.float64]] = None) -> NDArray[numpy.float64]:
        """The field for any efforts e instead of dH/dx(x), as discrete gradients put them in."""
        ...
    def apply_structure(self, x: NDArray[numpy.float64], e: NDArray[numpy.float64], out: Optional[NDArray[numpy.float64]] = None) -> NDArray[numpy.float64]:
        """J(x) e, for any e."""
        ...
    def apply_dissipation(self, x: NDArray[numpy.float64], e: NDArray[numpy.float64], out: Optional[NDArray[numpy.float64]] = None) -> NDArray[numpy.float64]:
        """R(x) e, for any e. Zero for a lossless system."""
        ...
    def apply_input(self, x: NDArray[numpy.float64], u: NDArray[numpy.float64], out: Optional[NDArray[numpy.float64]] = None) -> NDArray[numpy.float64]:
        """G(x) u."""
        ...
    def output(self, x: NDArray[numpy.float64], e: NDArray[numpy.float64], out: Optional[NDArray[numpy.float64]] = None) -> NDArray[numpy.float64]:
        """y = G(x)^T e."""
        ...
    def stored(self, x: NDArray[numpy.float64], out: Optional[NDArray[numpy.float64]] = None) -> NDArray[numpy.float64]:
        """The energy in each of description.storages [J]."""
        ...
    def powers(self, t: float, x: NDArray[numpy.float64], e: NDArray[numpy.float64], out: Optional[NDArray[numpy.float64]] = None) -> NDArray[numpy.float64]:
        """Each of description.powers at the efforts e [W]."""
        ...
    def invariants(self, x: NDArray[numpy.float64], out: Optional[NDArray[numpy.float64]] = None) -> NDArray[numpy.float64]:
        """The declared invariants, one after another."""
        ...

class AxiomResult:
    """One axiom: the worst relative violation found and the state where it was found."""
    @property
    def axiom(self) -> str: ...
    @property
    def worst(self) -> float: ...
    @property
    def limit(self) -> float: ...
    @property
    def state(self) -> list[float]: ...
    @property
    def why_not(self) -> str:
        """Why it could not be tried; empty: it was tried."""
        ...
    def applies(self) -> bool: ...
    @property
    def holds(self) -> bool: ...

class CheckReport:
    @property
    def axioms(self) -> list[AxiomResult]: ...
    @property
    def holds(self) -> bool: ...
    def text(self) -> str:
        """One line per axiom; a violated one names the worst value, the limit and the state."""
        ...
    def __str__(self) -> str: ...
    def __bool__(self) -> bool: ...

class UserModel(Model):
    """Makes a Model out of an object with two methods:

        description() -> Description
        hamiltonian(x) -> number

    and any of these, which return what they give (x, e, u are arrays; a method that is missing has the default):

        gradient(x)           dH/dx                                  default: duals of hamiltonian
        structure(x, e)       J(x) e                                 default: canonical
        dissipation(x, e)     R(x) e                                 default: zero
        input(x, u)           G(x) u                                 default: no ports
        drive(t, x)           what the field has besides             default: none
        invariants(x)         the declared ones                      default: none declared
        flow(k, t, h, x)      x moved by the exact flow of part k    default: none
        stored(x)             the energy in each storage             default: one storage, H
        powers(t, x, e)       the declared powers                    default: dissipation and drive, where there are such

    y = G^T e is derived from `input`, so ports are collocated by construction. Arrays are of float64 in runs, of longdouble where
    errors are measured, and object arrays of Dual and Quad in checks and references: write the mathematics with operators
    and numpy's sin, cos, sqrt, exp, log, tanh. compare, monodromy and gradient need gradient(x).

    Raises InvalidArgument for blocks outside of x, ports outside of u, slices that overlap, and methods that are missing.
    """
    def __init__(self, system: Any) -> None: ...

class Law:
    """u = kappa(t, x, y): a controller's, see Network.control."""

class Function:
    """y = f(x): a law of an element, or a signal v(t)."""
    def __call__(self, x: float) -> float: ...

class MassProperties:
    """Mass properties of a body as users give them."""
    def __init__(self, *, mass: float = ..., com: typing.Sequence[float] = ..., inertia: typing.Sequence[float] = ..., axes: Any = ...) -> None: ...
    @property
    def mass(self) -> float:
        """[kg]"""
        ...
    @mass.setter
    def mass(self, value: float) -> None: ...
    @property
    def com(self) -> tuple:
        """Centre of mass in the body frame [m]."""
        ...
    @com.setter
    def com(self, value: tuple) -> None: ...
    @property
    def inertia(self) -> tuple:
        """About the centre of mass, along `axes` [kg m^2], tensor elements xx, xy, xz, yy, yz, zz."""
        ...
    @inertia.setter
    def inertia(self, value: tuple) -> None: ...
    @property
    def axes(self) -> Any:
        """Inertia axes in the body frame, (3, 3)."""
        ...
    @axes.setter
    def axes(self, value: Any) -> None: ...

class JointSpec:
    """A joint as users give it."""
    def __init__(self, *, name: str = ..., type: str = ..., axis: typing.Sequence[float] = ..., second_axis: Any = ..., pitch: float = ..., damping: float = ..., stiffness: float = ..., rest: float = ..., rotor_inertia: float = ...) -> None: ...
    @property
    def name(self) -> str:
        """Empty: the body's name."""
        ...
    @name.setter
    def name(self, value: str) -> None: ...
    @property
    def type(self) -> str:
        """One of joint_type_names()."""
        ...
    @type.setter
    def type(self, value: str) -> None: ...
    @property
    def axis(self) -> tuple:
        """In the joint frame; need not be unit. Ignored by spherical and free."""
        ...
    @axis.setter
    def axis(self, value: tuple) -> None: ...
    @property
    def second_axis(self) -> Any:
        """universal: second rotation axis; planar: first translation."""
        ...
    @second_axis.setter
    def second_axis(self, value: Any) -> None: ...
    @property
    def pitch(self) -> float:
        """helical [m/rad]."""
        ...
    @pitch.setter
    def pitch(self, value: float) -> None: ...
    @property
    def damping(self) -> float:
        """Viscous [N m s/rad | N s/m], >= 0; joints of one degree of freedom only."""
        ...
    @damping.setter
    def damping(self, value: float) -> None: ...
    @property
    def stiffness(self) -> float:
        """Spring [N m/rad | N/m], >= 0; joints of one degree of freedom only."""
        ...
    @stiffness.setter
    def stiffness(self, value: float) -> None: ...
    @property
    def rest(self) -> float:
        """The spring's rest coordinate [rad | m]."""
        ...
    @rest.setter
    def rest(self, value: float) -> None: ...
    @property
    def rotor_inertia(self) -> float:
        """Rotor (armature) inertia [kg m^2 | kg], >= 0: n^2 J of a rotor of inertia J behind a gear of ratio n, as the joint feels it."""
        ...
    @rotor_inertia.setter
    def rotor_inertia(self, value: float) -> None: ...

class BodySpec:
    """A body, the joint that carries it and where the joint sits."""
    def __init__(self, *, name: str = ..., parent: str = ..., joint: JointSpec = ..., mass: MassProperties = ..., position: typing.Sequence[float] = ..., rotation: Any = ...) -> None: ...
    @property
    def name(self) -> str: ...
    @name.setter
    def name(self, value: str) -> None: ...
    @property
    def parent(self) -> str:
        """Name of another body, or 'world'."""
        ...
    @parent.setter
    def parent(self, value: str) -> None: ...
    @property
    def joint(self) -> JointSpec: ...
    @joint.setter
    def joint(self, value: JointSpec) -> None: ...
    @property
    def mass(self) -> MassProperties: ...
    @mass.setter
    def mass(self, value: MassProperties) -> None: ...
    @property
    def position(self) -> tuple:
        """Origin of the joint frame (= body frame at q = 0) in the parent's body frame [m]."""
        ...
    @position.setter
    def position(self, value: tuple) -> None: ...
    @property
    def rotation(self) -> Any:
        """Axes of the joint frame in the parent's body frame, (3, 3); see rotation_from_rpy()."""
        ...
    @rotation.setter
    def rotation(self, value: Any) -> None: ...

class Remark:
    """Something noticed in the input that does not stop a run."""
    @property
    def where(self) -> str:
        """'file:line', may be empty."""
        ...
    @property
    def text(self) -> str: ...

class JointCoordinates:
    """A coordinate block: where a joint's numbers stand in q (and p) and in v (and tau)."""
    @property
    def name(self) -> str: ...
    @property
    def joint(self) -> str:
        """Name of the joint it belongs to."""
        ...
    @property
    def q(self) -> slice:
        """Slice of q and p."""
        ...
    @property
    def v(self) -> slice:
        """Slice of v and tau."""
        ...
    @property
    def unit(self) -> str: ...
    @property
    def momentum_unit(self) -> str: ...
    @property
    def rate_unit(self) -> str: ...

class Mechanism:
    """An articulated mechanism: an immutable tree of bodies. Made by MechanismBuilder or read_urdf().

    q = joint coordinates, v = joint rates (body-frame twists of ball and free joints, [angular; linear]),
    p = momenta conjugate to q, of the same size as q.
    """
    @property
    def name(self) -> str: ...
    @property
    def nq(self) -> int: ...
    @property
    def nv(self) -> int: ...
    @property
    def body_count(self) -> int:
        """Moving bodies, fixed joints merged."""
        ...
    @property
    def total_mass(self) -> float:
        """Of the moving bodies [kg]."""
        ...
    @property
    def gravity(self) -> tuple:
        """Uniform, world axes [m/s^2]."""
        ...
    @property
    def coordinates(self) -> list[JointCoordinates]: ...
    def coordinate(self, name: str) -> JointCoordinates:
        """The coordinates of the block of that name; InvalidArgument names the known ones."""
        ...
    @property
    def bodies(self) -> list[str]:
        """Names of the user's bodies."""
        ...
    @property
    def remarks(self) -> list[Remark]:
        """Faults of the input that do not reach the dynamics or were accepted."""
        ...
    def neutral(self) -> NDArray[numpy.float64]:
        """q with every coordinate zero and every quaternion (1, 0, 0, 0)."""
        ...

class MechanismBuilder:
    """Collects bodies in any order, validates, and makes the immutable Mechanism."""
    def __init__(self, name: str = 'mechanism') -> None: ...
    def add(self, body: BodySpec) -> MechanismBuilder: ...
    def gravity(self, g: Any) -> MechanismBuilder:
        """Uniform gravity, world axes [m/s^2]."""
        ...
    def accept_unphysical_inertia(self, accept: bool) -> MechanismBuilder:
        """Takes inertias that are positive but break the triangle inequality, as some published robots have; each becomes a remark. Off by default."""
        ...
    def build(self) -> Mechanism:
        """The mechanism.

        Raises InvalidArgument naming the offender: duplicate or unknown names, a cycle, a negative or non-finite mass, an
        inertia that is not positive or breaks the triangle inequality, a zero axis, an unknown joint type, a moving part
        without inertia about its joint, negative damping or stiffness.
        """
        ...

class UrdfResult:
    @property
    def mechanism(self) -> Mechanism: ...
    @property
    def notes(self) -> list[Remark]:
        """Unknown tags and attributes, mimic, limits, friction, ignored geometry counts."""
        ...
    @property
    def root_link(self) -> str: ...

class BodyPort:
    """A power port on a body: a frame fixed to a link, with the link's axes. Port '<name>.wrench', 6 numbers each way:
    u = [moment; force] on the link about the frame's origin [N m; N]; y = twist [angular; linear] of the frame [rad/s; m/s].
    """
    def __init__(self, *, name: str = ..., link: str = ..., position: typing.Sequence[float] = ...) -> None: ...
    @property
    def name(self) -> str: ...
    @name.setter
    def name(self, value: str) -> None: ...
    @property
    def link(self) -> str:
        """Any moving body, one on a fixed joint too."""
        ...
    @link.setter
    def link(self, value: str) -> None: ...
    @property
    def position(self) -> tuple:
        """Origin in the link's frame [m]."""
        ...
    @position.setter
    def position(self, value: tuple) -> None: ...

class Motion:
    """A position told for every time [rad or m]."""
    def position(self, t: float) -> float: ...
    def rate(self, t: float) -> float: ...
    @property
    def instants(self) -> list[float]:
        """Times at which a higher derivative jumps: steps should end there [s]."""
        ...

class LinkFrame:
    """A frame fixed to a link of a mechanism, or to the world."""
    def __init__(self, *, link: str = ..., position: typing.Sequence[float] = ..., axes: Any = ...) -> None: ...
    @property
    def link(self) -> str:
        """Any body of the mechanism; empty: the world."""
        ...
    @link.setter
    def link(self, value: str) -> None: ...
    @property
    def position(self) -> tuple:
        """Origin in the link's frame [m]."""
        ...
    @position.setter
    def position(self, value: tuple) -> None: ...
    @property
    def axes(self) -> Any:
        """Its axes as columns in the link's frame, (3, 3)."""
        ...
    @axes.setter
    def axes(self, value: Any) -> None: ...

class LoopJoint:
    """A joint that closes a loop: frame b moves relative to frame a as the type allows. Types: revolute, continuous,
    prismatic, cylindrical, helical (about and along z), spherical, universal (z of a, x of b), planar (in x, y), fixed;
    on_plane, on_line, on_curve: only the origin of b is held, on z = 0, on the z axis, on a smooth curve through points.
    """
    def __init__(self, *, name: str = ..., type: str = ..., a: LinkFrame = ..., b: LinkFrame = ..., pitch: float = ..., points: list[list[float]] = ..., closed: bool = ...) -> None: ...
    @property
    def name(self) -> str: ...
    @name.setter
    def name(self, value: str) -> None: ...
    @property
    def type(self) -> str: ...
    @type.setter
    def type(self, value: str) -> None: ...
    @property
    def a(self) -> LinkFrame: ...
    @a.setter
    def a(self, value: LinkFrame) -> None: ...
    @property
    def b(self) -> LinkFrame: ...
    @b.setter
    def b(self, value: LinkFrame) -> None: ...
    @property
    def pitch(self) -> float:
        """Of a helical joint [m/rad]."""
        ...
    @pitch.setter
    def pitch(self, value: float) -> None: ...
    @property
    def points(self) -> list[list[float]]:
        """Of on_curve: [x, y] in a [m], about equally far apart, >= 2 (closed: 3)."""
        ...
    @points.setter
    def points(self, value: list[list[float]]) -> None: ...
    @property
    def closed(self) -> bool:
        """Of on_curve: whether the last point is joined to the first."""
        ...
    @closed.setter
    def closed(self, value: bool) -> None: ...

class Rod:
    """A massless rod: the origins of both frames keep their distance."""
    def __init__(self, *, name: str = ..., a: LinkFrame = ..., b: LinkFrame = ..., length: float = ...) -> None: ...
    @property
    def name(self) -> str: ...
    @name.setter
    def name(self, value: str) -> None: ...
    @property
    def a(self) -> LinkFrame: ...
    @a.setter
    def a(self, value: LinkFrame) -> None: ...
    @property
    def b(self) -> LinkFrame: ...
    @b.setter
    def b(self, value: LinkFrame) -> None: ...
    @property
    def length(self) -> float:
        """[m], > 0"""
        ...
    @length.setter
    def length(self, value: float) -> None: ...

class Coupling:
    """A gear, belt, rack or mimic joint: the sum of factor * coordinate is the offset; angles count their turns."""
    def __init__(self, *, name: str = ..., factors: dict[str, float] = ..., offset: float = ...) -> None: ...
    @property
    def name(self) -> str: ...
    @name.setter
    def name(self, value: str) -> None: ...
    @property
    def factors(self) -> dict[str, float]:
        """By coordinate, with one degree of freedom each."""
        ...
    @factors.setter
    def factors(self, value: dict[str, float]) -> None: ...
    @property
    def offset(self) -> float:
        """In the unit of factor times coordinate."""
        ...
    @offset.setter
    def offset(self, value: float) -> None: ...

class Rolling:
    """A body that touches the plane z = 0 of the frame `ground` and does not slip. Types, by the frame `wheel`: disk (thin,
    axle z), sphere, blade (no motion along z), no_spin (no turn about z). Needs a pgauss method.
    """
    def __init__(self, *, name: str = ..., type: str = ..., ground: LinkFrame = ..., wheel: LinkFrame = ..., radius: float = ...) -> None: ...
    @property
    def name(self) -> str: ...
    @name.setter
    def name(self, value: str) -> None: ...
    @property
    def type(self) -> str: ...
    @type.setter
    def type(self, value: str) -> None: ...
    @property
    def ground(self) -> LinkFrame:
        """By default the world."""
        ...
    @ground.setter
    def ground(self, value: LinkFrame) -> None: ...
    @property
    def wheel(self) -> LinkFrame: ...
    @wheel.setter
    def wheel(self, value: LinkFrame) -> None: ...
    @property
    def radius(self) -> float:
        """Of a disk or sphere [m], > 0."""
        ...
    @radius.setter
    def radius(self, value: float) -> None: ...

class Driven:
    """A joint coordinate with one degree of freedom that moves as told, by a motor of any strength; its account is '<name>.power'."""
    def __init__(self, *, name: str = ..., coordinate: str = ..., motion: Motion = ...) -> None: ...
    @property
    def name(self) -> str: ...
    @name.setter
    def name(self, value: str) -> None: ...
    @property
    def coordinate(self) -> str: ...
    @coordinate.setter
    def coordinate(self, value: str) -> None: ...
    @property
    def motion(self) -> Motion:
        """Angles count their turns."""
        ...
    @motion.setter
    def motion(self, value: Motion) -> None: ...

class ClosedStart:
    """What close_loops() found and did."""
    @property
    def gap(self) -> float:
        """Largest gap at the start [m or rad]."""
        ...
    @property
    def slip(self) -> float:
        """Largest rate of a gap at the start [1/s]."""
        ...
    @property
    def moved(self) -> float:
        """Largest change of a coordinate [m or rad]."""
        ...
    @property
    def sped_up(self) -> float:
        """Largest change of a rate [m/s or rad/s]."""
        ...
    @property
    def rank(self) -> int:
        """Independent rows at the closed position."""
        ...
    @property
    def largest(self) -> str:
        """Name of the constraint with the largest gap."""
        ...

class Reactions:
    """What the constraints of a model exert at a state, from the accelerations: by name, the wrench of a loop on link b (of
    a rolling body on its wheel) about the origin of its frame, in the axes of a (of the ground), [moment; force] [N m; N]; the
    tension of a rod [N]; the torque or force of a coupling or motor on each of its joints, '<name>.<joint>'. Where they are
    not unique, those of the smallest norm.
    """
    def __init__(self, model: Model) -> None:
        """Raises InvalidArgument without constraints."""
        ...
    def at(self, x: Any, t: float = 0.0, turns: Any = None) -> dict:
        """x: the flat state, on the constraints; turns: of its angle blocks."""
        ...

class MechanicalModel(Model):
    """A mechanism as a port-Hamiltonian system: x = (q, p), canonical J,

        H = p M(q)^-1 p / 2 + V_gravity(q) + sum k (q_j - rest)^2 / 2,   R = diag(0, joint damping).

    Ports, one per joint: '<joint>.torque', '<joint>.force', '<joint>.wrench' (several degrees of freedom), then the body ports.
    Invariants: linear and angular momentum of mechanisms free in the world without gravity, and of every quaternion.
    """
    def __init__(self, mechanism: Mechanism, ports: list[BodyPort] = [], constraints: list[Union[LoopJoint, Rod, Coupling, Rolling, Driven]] = []) -> None:
        """constraints: LoopJoint, Rod, Coupling, Rolling and Driven objects with names of their own."""
        ...
    def close_loops(self, q: Any, v: Any, held: list[str] = []) -> tuple:
        """Moves a start onto the constraints: (q, v, what was found). held: coordinates that stay if the others can close the loops. Raises InvalidArgument if they cannot be closed."""
        ...
    @property
    def mechanism(self) -> Mechanism: ...
    def state(self, q: Any, v: Any) -> NDArray[numpy.float64]:
        """The flat state x of coordinates q and joint rates v."""
        ...
    def rates(self, x: Any, turns: Any = None) -> NDArray[numpy.float64]:
        """Joint rates of a flat state. turns: of its angle blocks, as State.turns; None: they stand in the angles."""
        ...

class Potential:
    """An energy U(z) with its slope U'(z): a spring, a limit, any potential of one coordinate."""
    def __init__(self, energy: Function, slope: Function) -> None: ...

class BlockPotential:
    """An energy of a coordinate of several numbers."""

class Held:
    """A value held until it is set again. One per run: set between steps only."""
    def __init__(self) -> None: ...
    @property
    def value(self) -> float: ...
    @value.setter
    def value(self, value: float) -> None: ...
    def signal(self) -> Function: ...

class Casimir:
    """A weighted sum of numbers of the state that keeps its value whatever H is."""
    @property
    def text(self) -> str:
        """'spring.elongation - arm.elbow'"""
        ...
    @property
    def terms(self) -> dict[int, float]:
        """The weight of each number of the state in it."""
        ...

class NetworkModel(Model):
    """The system a Network builds. State: the members' states one after another; with one member its blocks keep their names,
    with several they are prefixed '<member>.'.
    """
    def offset(self, member: str) -> int:
        """Where the state of a member begins."""
        ...
    @property
    def casimirs(self) -> list[Casimir]:
        """The Casimirs."""
        ...

class Network:
    """Collects members and junctions, checks each as it comes, and builds the model. Ports are named
    '<member>.<port>', as 'arm.elbow.torque'.

    Every method raises InvalidArgument with one sentence for an unknown or ambiguous name, ports whose kinds, sizes or units
    do not match, and a port that is joined already. In all u = (K - D) y + v with K skew and D + D^T >= 0.
    """
    def __init__(self, name: str) -> None: ...
    def add(self, name: str, member: Model) -> Network:
        """A member. Several of one type share their model."""
        ...
    def main(self, name: str) -> Network:
        """The member the others are elements of: its blocks, ledger and invariants keep their names."""
        ...
    def feedback(self, effort_in: str, flow_in: str) -> Network:
        """The flow of effort_in drives flow_in, whose effort acts back: u_a = -y_b, u_b = y_a."""
        ...
    def transformer(self, effort_in: str, flow_in: str, ratio: float) -> Network:
        """A gear, a lever: u_b = ratio y_a, u_a = -ratio y_b."""
        ...
    def gyrator(self, a: str, b: str, r: float) -> Network:
        """A motor constant, a precession: of two ports of one kind, u_b = r y_a, u_a = -r y_b."""
        ...
    def one_junction(self, name: str, ends: Any) -> Network:
        """One flow, efforts sum to zero; exactly one effort_in port sets the flow. ends: ports, or (port, sign)."""
        ...
    def zero_junction(self, name: str, ends: Any) -> Network:
        """One effort, flows sum to zero; exactly one flow_in port sets the effort. ends: ports, or (port, sign)."""
        ...
    def couple(self, ports: list[str], K: Any) -> Network:
        """u = K y over the ports one after another. InvalidArgument if K is not skew."""
        ...
    @typing.overload
    def resist(self, name: str, port: str, law: Function, component: int = 0) -> Network:
        """u -= law(y) of a port of size 1, or of one component of a larger one."""
        ...
    @typing.overload
    def resist(self, name: str, ports: list[str], D: Any) -> Network:
        """Rayleigh damping u -= D y over the ports one after another. InvalidArgument if D + D^T is not >= 0."""
        ...
    def lugre(self, name: str, port: str, *, coulomb: float, breakaway: float = 0.0, stribeck: float = 0.0, viscous: float = 0.0, bristle_stiffness: float, bristle_damping: float = 0.0, component: int = 0) -> Network:
        """Dry friction by a bristle that bends before it slips (Canudas de Wit and others 1995), at an effort_in port of size 1 or
        one component of a larger one: z' = v - s0 |v| z / g(v), force = s0 z + s1 z' + viscous v, with s0 = bristle_stiffness [N/m or
        N m/rad], s1 = bristle_damping and g = coulomb + (breakaway - coulomb) exp(-(v/stribeck)^2). A member `name` keeps the bend z
        and stores s0 z^2 / 2; the loss is `name`.loss. Raises InvalidArgument where it would make energy: viscous less than
        bristle_damping (breakaway - coulomb) / coulomb.
        """
        ...
    def source(self, name: str, port: str, v: Function, component: int = 0) -> Network:
        """u += v(t)."""
        ...
    @typing.overload
    def control(self, name: str, port: str, law: Law, *, period: float = 0.0, encoder: list[str] = [], sensors: list[str] = []) -> Network:
        """A controller on a port of any size: u += kappa(t, x, y), x the state of the port's member. Its power is in the ledger as
        `name`, and nothing asks it to be passive.

        period [s], a whole number of steps; 0: continuously. A sampled one is held between the instants k period; `name` is then
        what kappa would have supplied all the time, and `name`.hold what the hold adds. encoder: coordinates
        ('<member>.<block>'), it sees their mean flow over the last period. sensors: ports whose outputs kappa sees too.
        kappa is a function of t, x and y alone and is called at other times too; a law that remembers something takes a list of ports.
        """
        ...
    @typing.overload
    def control(self, name: str, ports: list[str], law: Any, *, period: float, memory: int = 0) -> Network:
        """A sampled controller that remembers, on ports of one member: law(t, x, y) -> u is called at the instants k period
        alone, in turn, and u is held until the next. x: the state of the member, angles unwrapped; y, u: outputs and inputs of the
        ports, one after another. The ledger lists its power as `name`.

        law: an object whose attributes are its memory. They must be what pickle takes, or the object has __getstate__ and
        __setstate__, or stateless = True. Runs use copies of it: it stays as it is, and each run begins with it. memory: bytes that it may
        need; 0: twice those of the start and 4096 more. Raises InvalidArgument for ports of two members, LawFailure where the law fails.
        """
        ...
    @typing.overload
    def potential(self, name: str, coordinate: str, U: Potential) -> Network:
        """H += U(z), z a coordinate with a conjugate momentum: '<member>.<block>'."""
        ...
    @typing.overload
    def potential(self, name: str, coordinate: str, U: BlockPotential) -> Network:
        """The same for a coordinate of several numbers: an attitude, a place in space."""
        ...
    def build(self) -> NetworkModel:
        """The system. Ports that nothing was joined to stay its ports.

        Raises InvalidArgument for a required port that is not joined, an open port with feedthrough, or an algebraic loop without
        a solution.
        """
        ...

class Claim:
    """What a method says of a property; the test suite checks every `holds` and `fails`."""
    holds: typing.ClassVar[Claim]
    fails: typing.ClassVar[Claim]
    unknown: typing.ClassVar[Claim]
    @property
    def name(self) -> str: ...
    @property
    def value(self) -> int: ...
    def __init__(self, value: int) -> None: ...

class Declaration:
    """What a method keeps, for lossless systems unless said otherwise."""
    @property
    def name(self) -> str:
        """The name in scenes."""
        ...
    @property
    def title(self) -> str: ...
    @property
    def family(self) -> str: ...
    @property
    def order(self) -> int:
        """0: varies with a tolerance."""
        ...
    @property
    def symmetric(self) -> Claim: ...
    @property
    def symplectic(self) -> Claim: ...
    @property
    def energy_exact(self) -> Claim:
        """H kept to rounding for any H."""
        ...
    @property
    def passivity_exact(self) -> Claim:
        """The discrete power balance closes to rounding for any H."""
        ...
    @property
    def quadratic_invariants(self) -> Claim: ...
    @property
    def constraints(self) -> bool:
        """Whether it keeps closed loops and couplings."""
        ...
    @property
    def resumable(self) -> bool: ...
    @property
    def rival(self) -> bool:
        """Another library's method, for comparison."""
        ...
    @property
    def source(self) -> str: ...

class Solver:
    """How an implicit method solves its equations."""
    automatic: typing.ClassVar[Solver]
    fixed_point: typing.ClassVar[Solver]
    newton_articulated: typing.ClassVar[Solver]
    newton_dense: typing.ClassVar[Solver]
    newton_krylov: typing.ClassVar[Solver]
    @property
    def name(self) -> str: ...
    @property
    def value(self) -> int: ...
    def __init__(self, value: int) -> None: ...

class Cost:
    @property
    def steps(self) -> int: ...
    @property
    def evaluations(self) -> int:
        """Of the field (or its parts) for one state."""
        ...
    @property
    def sweeps(self) -> int:
        """Of the implicit iteration."""
        ...
    @property
    def factorisations(self) -> int:
        """Of a Newton matrix."""
        ...

class State:
    """A state of double-length numbers x + lo, with the turns taken off its angle blocks and an integer clock.

    `x` and `lo` are views: they change with the state.
    """
    def __init__(self, model: Model, x: Any) -> None: ...
    @property
    def x(self) -> NDArray[numpy.float64]:
        """Value, (nx,)."""
        ...
    @property
    def lo(self) -> NDArray[numpy.float64]:
        """Low word, |lo| <= ulp(x)/2."""
        ...
    @property
    def turns(self) -> NDArray[numpy.int64]:
        """One per angle block: the true angle is x + lo + 2 pi turns."""
        ...
    @property
    def step(self) -> int:
        """Steps taken."""
        ...
    def copy(self) -> State: ...

class Integrator:
    """A method at work on one system with one step size. One object per thread."""
    @property
    def declaration(self) -> Declaration: ...
    @property
    def step_size(self) -> float: ...
    @property
    def cost(self) -> Cost: ...
    @property
    def remark(self) -> str:
        """What the method has to say of how it went. Empty: nothing unusual."""
        ...
    @property
    def port_work(self) -> NDArray[numpy.float64]:
        """Energy that went through each of the system's powers in the last step [J]."""
        ...
    def time(self, state: State) -> float:
        """The time of a state that step() has brought here [s]."""
        ...
    def step(self, state: State) -> None:
        """Advances the state by one step. RuntimeError if it does not converge or is not finite: the state is unchanged."""
        ...
    def run(self, state: State, steps: int, every: int = 1) -> tuple:
        """Advances the state by that many steps, without the GIL. Returns (t, x): times (n,) and states (n, nx) at the start and
        after every `every`-th step. Ctrl-C stops between steps; the state is then where it came to.
        """
        ...

class ClaimResult:
    """One claim of a method, as it shows on a system."""
    @property
    def claim(self) -> str: ...
    @property
    def declared(self) -> bool: ...
    @property
    def measured(self) -> float:
        """The error; of the order, the order."""
        ...
    @property
    def bound(self) -> float:
        """The largest error, the smallest order of what holds."""
        ...
    @property
    def why_not(self) -> str:
        """Why it could not be measured; empty if it was."""
        ...
    @property
    def holds(self) -> bool:
        """Whether what is declared shows."""
        ...

class ClaimReport:
    """What check_method() found, for print()."""
    @property
    def claims(self) -> list[ClaimResult]: ...
    @property
    def holds(self) -> bool:
        """All declared claims do; False too where the steps break down."""
        ...
    def __str__(self) -> str: ...

class Limits:
    """Limits of the verdict, relative. None: not checked; no limit at all: the defaults."""
    def __init__(self, *, energy: Optional[float] = ..., linear_momentum: Optional[float] = ..., angular_momentum: Optional[float] = ..., quaternion_norm: Optional[float] = ..., balance: Optional[float] = ..., symmetry: Optional[float] = ..., step_halving: Optional[float] = ..., orbital: Optional[float] = ..., coupling: Optional[float] = ..., constraints: Optional[float] = ...) -> None: ...
    @property
    def energy(self) -> Optional[float]: ...
    @energy.setter
    def energy(self, value: Optional[float]) -> None: ...
    @property
    def linear_momentum(self) -> Optional[float]: ...
    @linear_momentum.setter
    def linear_momentum(self, value: Optional[float]) -> None: ...
    @property
    def angular_momentum(self) -> Optional[float]: ...
    @angular_momentum.setter
    def angular_momentum(self, value: Optional[float]) -> None: ...
    @property
    def quaternion_norm(self) -> Optional[float]: ...
    @quaternion_norm.setter
    def quaternion_norm(self, value: Optional[float]) -> None: ...
    @property
    def balance(self) -> Optional[float]: ...
    @balance.setter
    def balance(self, value: Optional[float]) -> None: ...
    @property
    def symmetry(self) -> Optional[float]: ...
    @symmetry.setter
    def symmetry(self, value: Optional[float]) -> None: ...
    @property
    def step_halving(self) -> Optional[float]: ...
    @step_halving.setter
    def step_halving(self, value: Optional[float]) -> None: ...
    @property
    def orbital(self) -> Optional[float]: ...
    @orbital.setter
    def orbital(self, value: Optional[float]) -> None: ...
    @property
    def coupling(self) -> Optional[float]: ...
    @coupling.setter
    def coupling(self, value: Optional[float]) -> None: ...
    @property
    def constraints(self) -> Optional[float]: ...
    @constraints.setter
    def constraints(self, value: Optional[float]) -> None: ...

class SceneData:
    """A scene: what describes a run completely. Every key of a file: docs/scene.md."""
    def __init__(self) -> None: ...
    @property
    def path(self) -> str: ...
    @property
    def stops(self) -> int: ...
    @property
    def events(self) -> list[str]:
        """What its [[event]]s do, a text each."""
        ...
    @property
    def title(self) -> str: ...
    @title.setter
    def title(self, value: str) -> None: ...
    @property
    def method(self) -> str:
        """See methods(); 'auto': found by pilot runs."""
        ...
    @method.setter
    def method(self, value: str) -> None: ...
    @property
    def step(self) -> float:
        """[s]"""
        ...
    @step.setter
    def step(self, value: float) -> None: ...
    @property
    def duration(self) -> float:
        """[s]; where it is no whole number of steps the last one is shorter."""
        ...
    @duration.setter
    def duration(self, value: float) -> None: ...
    @property
    def record_every(self) -> float:
        """[s]; of whole steps, one or more."""
        ...
    @record_every.setter
    def record_every(self, value: float) -> None: ...
    @property
    def centre_stays(self) -> bool:
        """Whether the centre of mass of what floats stays in the state. Else, where it moves as without the rest, it is integrated apart."""
        ...
    @centre_stays.setter
    def centre_stays(self, value: bool) -> None: ...
    @property
    def rtol(self) -> float:
        """Of reference solvers that work to a tolerance."""
        ...
    @rtol.setter
    def rtol(self, value: float) -> None: ...
    @property
    def iteration_tolerance(self) -> float:
        """Of implicit methods; 0: to rounding."""
        ...
    @iteration_tolerance.setter
    def iteration_tolerance(self, value: float) -> None: ...
    @property
    def checkpoint_every(self) -> float:
        """Wall-clock seconds."""
        ...
    @checkpoint_every.setter
    def checkpoint_every(self, value: float) -> None: ...
    @property
    def verify(self) -> Limits: ...
    @verify.setter
    def verify(self, value: Limits) -> None: ...

class Assembly:
    """Everything a run needs, put together from a scene."""
    @property
    def model(self) -> Model:
        """What is run."""
        ...
    @property
    def mechanism(self) -> Mechanism:
        """The mechanism in it; None in a system without one."""
        ...
    @property
    def initial(self) -> State:
        """Where a run begins; relative to the centre of mass where that moves in closed form, see in_world()."""
        ...
    @property
    def start(self) -> NDArray[numpy.float64]:
        """The numbers of `initial`, nx, angles with their turns."""
        ...
    @property
    def mechanical(self) -> MechanicalModel:
        """The model of the mechanism alone, with its constraints; None without a mechanism."""
        ...
    def in_world(self, t: float, state: State) -> State:
        """A state of the model at time t [s] as the world sees it: places and momenta with those of the centre of mass, where that moves in closed form; else the state itself."""
        ...
    @property
    def certificates(self) -> list[Certificate]:
        """Of the scene's controllers, in their order."""
        ...
    @property
    def notes(self) -> list[Remark]: ...

class RunFile:
    """The run.h5 of a run."""
    def __init__(self, path: Any) -> None: ...
    @property
    def names(self) -> list[str]:
        """Every dataset, 'state/elbow', 'energy_error', ..."""
        ...
    def read(self, name: str) -> Any:
        """A dataset as an array, or its text."""
        ...
    def attributes(self, object: str = '/') -> dict:
        """Attributes of a dataset or group ('/': of the file)."""
        ...

class LivePicture:
    """Pictures of a mechanism in any pose, as the playback of a report.html draws it."""
    def __init__(self, mechanism: Mechanism, page: str, *, size: tuple[int, int] = (640, 480), camera: str = 'iso', follow: str = 'place', dark: bool = False) -> None: ...
    def picture(self, q: NDArray[numpy.float64]) -> NDArray[Any]:
        """(height, width, 3), red, green and blue in 0 to 255. q: nq coordinates."""
        ...

class Gradient:
    """The cost of a run and its gradient, from gradient()."""
    @property
    def cost(self) -> float:
        """J."""
        ...
    @property
    def start(self) -> NDArray[numpy.float64]:
        """dJ/dx at the start, (nx,)."""
        ...
    @property
    def parameters(self) -> dict:
        """dJ/dtheta by name, with the state at the start kept."""
        ...
    @property
    def start_along(self) -> NDArray[numpy.float64]:
        """The change of start along the direction, (nx,): d2J/dx2 times it, and that by its parameters; empty without one."""
        ...
    @property
    def parameters_along(self) -> dict:
        """The change of parameters along the direction, by name; empty without one."""
        ...
    @property
    def duration(self) -> float:
        """dJ/dT by the duration [1/s], all steps made longer alike, if no part of J depends on t itself; nan where the model does, and with sampled controllers."""
        ...
    @property
    def end(self) -> State:
        """The last state."""
        ...
    @property
    def growth(self) -> float:
        """log10 of |dJ/dx at the start| / |d end/dx at the end|, nan without an end cost. Large: the run is chaotic over its length, and the gradient, though exact, tells nothing of a finite change."""
        ...
    @property
    def steps_taken(self) -> int:
        """By the method, those repeated from checkpoints included."""
        ...

class LyapunovSpectrum:
    """Lyapunov exponents along a run, from lyapunov_spectrum()."""
    @property
    def exponents(self) -> NDArray[numpy.float64]:
        """[1/s], (count,); largest first where they have settled."""
        ...
    @property
    def of_second_half(self) -> NDArray[numpy.float64]:
        """The same over the second half: how far the two differ tells how far they have settled."""
        ...
    @property
    def time(self) -> float:
        """That they are means over [s]."""
        ...
    @property
    def end(self) -> State:
        """The last state."""
        ...

class RunEvent:
    """What ends a part of a run and changes its state, for gradient_across_events(): functions of (t, x, numbers), in Dual."""
    def __init__(self, name: str, *, guard: Any = None, direction: str = 'rising', at: Optional[float] = None, reset: Any = None, numbers: dict = {}, then: int = -1, ends: bool = False) -> None:
        """guard: its zero is the instant, from below ("rising"), above ("falling") or "both"; or `at` [s] is the instant.
        reset: returns the state after it, of the phase that follows; without one it is the same. numbers: of the event, by name
        (a restitution, a place), which are parameters. then: the phase that follows; -1: the same. ends: it ends the run.
        """
        ...
    @property
    def name(self) -> str:
        """Its name."""
        ...

class EventGradient:
    """The cost of a run and its gradient, from gradient_across_events()."""
    @property
    def cost(self) -> float:
        """J."""
        ...
    @property
    def time(self) -> float:
        """Of the end [s]."""
        ...
    @property
    def end(self) -> State:
        """The last state."""
        ...
    @property
    def start(self) -> NDArray[numpy.float64]:
        """dJ/dx at the start, (nx,)."""
        ...
    @property
    def parameters(self) -> dict:
        """dJ/dtheta by name, with the state at the start kept: of the models, "<event>.<number>", and "<event>.at" of an event at a given time."""
        ...
    @property
    def events(self) -> list:
        """(phase, number of the event, time [s]) of each that happened."""
        ...

class Environment:
    """Environments for learning and planning: reset, act, observe, over a batch.

    An action is a row of port inputs u, held over `substeps` steps; rewards are the caller's, from observations and actions.
    Random numbers belong to (seed, environment, episode): the same seed and actions give the same bits. An environment whose
    episode ends (reached, cut off, or the method failed) begins the next in the same step; its last observation is in
    final_observations. Arrays are views, (count, ...), written by reset() and step(): copy what is to stay.
    """
    def __init__(self, model: Model, start: Any, *, count: int = 1, method: str = 'gauss4', step: float = 0.01, substeps: int = 1, seed: int = 0, longest: int = 0, threads: int = 1, ports: list[str] = [], observed: list[int] = [], outputs: bool = False, begin: Any = None, ended: Any = None, cases: list[tuple[Model, Any, Any]] = []) -> None:
        """start: state an episode begins from, nx numbers. longest: actions after which an episode is cut off; 0: never. threads: 0
        for as many as the machine has. ports: that actions drive; empty: all. observed: state numbers; empty: all. outputs:
        whether y of the ports that are driven is observed after them.

        begin(uniform, x) -> x: where an episode begins; uniform(n) gives n random numbers in [0, 1) of the episode's own.
        ended(x) -> bool: whether an episode has ended at x. Both take the GIL: end() ends episodes by one call for all.
        cases: [(model, start, ended or None), ...] in place of model and start: models that differ in numbers alone. Every episode draws
        the one it begins as; what each environment has now stands in `cases`.
        """
        ...
    @property
    def count(self) -> int: ...
    @property
    def action_size(self) -> int: ...
    @property
    def observation_size(self) -> int: ...
    @property
    def interval(self) -> float:
        """Seconds from action to action."""
        ...
    def reset(self, seed: Optional[int] = None) -> Any:
        """Begins the first episode of a seed in every environment; without one, the next episode, which is the one that the last step began where it ended one. Returns observations."""
        ...
    def reset_each(self, seeds: list[int]) -> Any:
        """The same with a seed for each environment."""
        ...
    def step(self, actions: Any) -> tuple:
        """actions: (count, action_size). Returns (observations, terminated, truncated)."""
        ...
    def end(self, which: numpy.ndarray[bool], *, failed: bool = False) -> Any:
        """Ends the episodes of the environments where `which` is True, (count,), in the step just taken, as `ended` does, or as a failure does: what it observed last is then what it did before the step. Returns observations."""
        ...
    @property
    def observations(self) -> Any:
        """(count, observation_size)"""
        ...
    @property
    def final_observations(self) -> NDArray[numpy.float64]:
        """Of the environments whose episode ended in the last step, what was observed at its end; else as observations."""
        ...
    @property
    def terminated(self) -> Any:
        """Where an episode ended in the last step, by `ended` or a failure."""
        ...
    @property
    def truncated(self) -> Any:
        """Where it ended by its length."""
        ...
    @property
    def failed(self) -> Any:
        """Where the method failed."""
        ...
    @property
    def outcomes(self) -> list[str]:
        """Why the method failed in the last step; '' where it did not."""
        ...
    @property
    def energies(self) -> NDArray[numpy.float64]:
        """H of each environment [J]."""
        ...
    @property
    def final_energies(self) -> NDArray[numpy.float64]:
        """H of each environment at its final_observations [J]."""
        ...
    @property
    def iterations(self) -> float:
        """Iterations of the method per step of it in the last step(), mean of all environments; of an explicit method 1."""
        ...
    @property
    def alone(self) -> int:
        """How many environments left the SIMD lanes in the last step(), because the iteration did not contract: each took Newton's method alone, some ten times as long."""
        ...
    @property
    def lengths(self) -> NDArray[numpy.int64]:
        """Steps taken in the episode."""
        ...
    @property
    def cases(self) -> NDArray[Any]:
        """The case of each environment."""
        ...
    @property
    def final_cases(self) -> NDArray[Any]:
        """The case of each environment at its final_observations."""
        ...
    @property
    def episodes(self) -> NDArray[numpy.int64]:
        """Number of the episode."""
        ...
    def state(self, environment: int) -> State:
        """The state of an environment."""
        ...
    def set_state(self, environment: int, state: State) -> None:
        """Puts another state in its place; its episode goes on."""
        ...

class SceneOutputs:
    """[[output]]s of a scene without sampled controllers, at states of its assembly. names: of outputs, or of their numbers, as 'tip.x'; none: all."""
    def __init__(self, scene: SceneData, assembly: Assembly, names: list[str]) -> None: ...
    @property
    def names(self) -> list[str]:
        """Of the numbers; outputs that the scene does not have are left out."""
        ...
    def at(self, times: Any, states: Any, inputs: Any = None) -> NDArray[numpy.float64]:
        """times: (n,) [s]; states: (n, nx); inputs: (n, nu) that act there, None: 0. Returns (n, numbers) in the units of the outputs."""
        ...

def check(model: Model, *, samples: int = 32, spread: float = 1.0, tolerance: float = 1e-11, seed: int = 1) -> CheckReport:
    """Checks the axioms at random states: J skew, R symmetric and >= 0, e = dH/dx against forward duals, field = rate(e) + Gu,
    the storages' sum against H, H' = y u + supplied - dissipated, no dissipated power below 0, and the declared invariants.

    States are normal with deviation `spread`; rotation blocks are unit quaternions. tolerance: relative to the sizes of the
    terms compared. Cost: about 3 nx evaluations per sample.
    """
    ...

def law(f: Callable[..., Any]) -> Law:
    """f(t, x, y) -> u as a Law: x the state of the system it acts on, y the output of its port, u the input there. A function of these alone: InvalidArgument in the run if it gives two answers. See UserModel for what the arrays hold; of laws that remember see Network.control."""
    ...

def function(f: Callable[..., Any]) -> Function:
    """f(x) -> number as a Function, in every scalar; see UserModel."""
    ...

def rotation_from_rpy(roll: float, pitch: float, yaw: float) -> Any:
    """The rotation matrix of URDF's roll-pitch-yaw: Rz(yaw) Ry(pitch) Rx(roll), rounded once."""
    ...

def joint_type_names() -> list[str]:
    """Names of all joint types a user may ask for."""
    ...

def read_urdf(path: Any, *, base: str = 'fixed', gravity: Any = None, massless_links: bool = False, rotor_inertia: dict[str, float] = {}, accept_unphysical_inertia: bool = False, use_damping: bool = True) -> UrdfResult:
    """Reads a mechanism from a URDF file.

    base: 'fixed' or 'free', how the root link is carried. gravity: world axes [m/s^2], by default none,
    of which a note tells where the base is fixed. massless_links: a link without
    <inertial> is a massless frame instead of an error. rotor_inertia: [kg m^2 | kg] by joint name. use_damping: <dynamics
    damping> becomes viscous joint damping. Raises InvalidArgument 'file:line: ...' for a missing file, broken XML, missing or malformed
    numbers, unknown joint types, several root links, cycles, and everything MechanismBuilder refuses.
    """
    ...

def parse_urdf(text: str, name: str = '<text>', *, base: str = 'fixed', gravity: Any = None, massless_links: bool = False, rotor_inertia: dict[str, float] = {}, accept_unphysical_inertia: bool = False, use_damping: bool = True) -> UrdfResult:
    """Reads a mechanism from the text of a URDF file; `name` stands for the file in messages.

    base: 'fixed' or 'free', how the root link is carried. gravity: world axes [m/s^2], by default none,
    of which a note tells where the base is fixed. massless_links: a link without
    <inertial> is a massless frame instead of an error. rotor_inertia: [kg m^2 | kg] by joint name. use_damping: <dynamics
    damping> becomes viscous joint damping. Raises InvalidArgument 'file:line: ...' for a missing file, broken XML, missing or malformed
    numbers, unknown joint types, several root links, cycles, and everything MechanismBuilder refuses.
    """
    ...

def steady_motion(start: float, rate: float) -> Motion:
    """start + rate t."""
    ...

def swinging_motion(middle: float, amplitude: float, frequency: float, phase: float = 0.0) -> Motion:
    """middle + amplitude sin(2 pi frequency t + phase); frequency in Hz."""
    ...

def moves(start: float, moves: list[tuple[float, float, float]]) -> Motion:
    """Moves of least jerk with rests between, each (at, duration, to) [s, s, rad or m]."""
    ...

def aba(mechanism: Mechanism, q: NDArray[numpy.float64], v: NDArray[numpy.float64], tau: Optional[NDArray[numpy.float64]] = None, wrench: Optional[NDArray[numpy.float64]] = None, out: Optional[NDArray[numpy.float64]] = None) -> NDArray[numpy.float64]:
    """Forward dynamics by the articulated-body algorithm, O(n): M(q) vdot + C(q, v) v + dV/dq = tau + loads.

    q: configuration, (nq,) or (n, nq). v: joint rates, (nv,) [rad/s | m/s]. tau: joint forces, (nv,) [N m | N].
    wrench: per moving body [moment; force] about its frame's origin in its own axes, (bodies, 6) [N m; N].
    Returns vdot, (nv,) or (n, nv); of a free or ball joint the derivative of its body-frame twist. Every array has one
    state, or all have n, in C order; a batch runs in SIMD lanes and gives the bits of its rows one by one.
    Source: Featherstone 2008, table 7.1.
    """
    ...

def rnea(mechanism: Mechanism, q: NDArray[numpy.float64], v: Optional[NDArray[numpy.float64]] = None, vdot: Optional[NDArray[numpy.float64]] = None, wrench: Optional[NDArray[numpy.float64]] = None, out: Optional[NDArray[numpy.float64]] = None) -> NDArray[numpy.float64]:
    """Inverse dynamics by the recursive Newton-Euler algorithm, O(n): tau = M(q) vdot + C(q, v) v + dV/dq - wrench terms.

    Shapes as in aba; v and vdot left out are zero. Returns tau, (nv,) or (n, nv).
    Source: Featherstone 2008, table 5.1, with the world accelerated by -g.
    """
    ...

def rnea_derivatives(mechanism: Mechanism, q: NDArray[numpy.float64], v: NDArray[numpy.float64], vdot: NDArray[numpy.float64], wrench: Optional[NDArray[numpy.float64]] = None) -> tuple[NDArray[numpy.float64], NDArray[numpy.float64]]:
    """Inverse dynamics and its derivatives, O(n depth): returns (tau, dtau_dq, dtau_dv).

    Shapes as in rnea; the matrices are (nv, nv) or (n, nv, nv). The derivative by the coordinates of a ball or free joint is
    along its twists: it turns about the child's axes, a free joint also moves along them. Rates and wrenches keep their
    values in their bodies' axes. Source: Carpentier, Mansard 2018; Singh, Russell, Wensing 2022.
    """
    ...

def aba_derivatives(mechanism: Mechanism, q: NDArray[numpy.float64], v: NDArray[numpy.float64], tau: NDArray[numpy.float64], wrench: Optional[NDArray[numpy.float64]] = None) -> tuple[NDArray[numpy.float64], NDArray[numpy.float64]]:
    """Forward dynamics and its derivatives: returns (vdot, dvdot_dq, dvdot_dv, dvdot_dtau), the last M(q)^-1.

    Shapes and coordinates as in rnea_derivatives. Springs and dampers of the mechanism's joints are not part of it.
    """
    ...

def inertial_regressor(mechanism: Mechanism, q: NDArray[numpy.float64], v: NDArray[numpy.float64], vdot: NDArray[numpy.float64]) -> NDArray[numpy.float64]:
    """Y of tau = Y theta, inverse dynamics as a linear function of the bodies' inertias, without rotors and wrenches.

    theta has ten numbers for each of mechanism.bodies: mass, first moment (3), and xx xy xz yy yz zz of the inertia about
    the origin of the body's frame, along its axes. Returns Y, (nv, 10 bodies) or (n, nv, 10 bodies).
    Source: Atkeson, An, Hollerbach 1986.
    """
    ...

def crba(mechanism: Mechanism, q: NDArray[numpy.float64], out: Optional[NDArray[numpy.float64]] = None) -> NDArray[numpy.float64]:
    """Joint-space mass matrix by the composite-rigid-body algorithm, O(n depth).

    q: (nq,) or (n, nq). Returns M, (nv, nv) or (n, nv, nv), both triangles; zero between branches.
    Source: Featherstone 2008, table 6.2.
    """
    ...

def jacobian(mechanism: Mechanism, q: NDArray[numpy.float64], body: str, axes: str = 'world', out: Optional[NDArray[numpy.float64]] = None) -> NDArray[numpy.float64]:
    """Jacobian of a body frame: its twist is J v, [angular; linear], the linear part that of the frame's origin.

    axes: 'body' or 'world', the axes the rows are written in. Returns J, (6, nv) or (n, 6, nv).
    """
    ...

def centroidal_momentum_matrix(mechanism: Mechanism, q: NDArray[numpy.float64], out: Optional[NDArray[numpy.float64]] = None) -> NDArray[numpy.float64]:
    """Centroidal momentum matrix: (k_G, l) = A_G v, k_G about the centre of mass, world axes, rows [angular; linear].

    Of the bodies, without the spin of rotors. Returns A, (6, nv) or (n, 6, nv). Source: Orin, Goswami, Lee 2013.
    """
    ...

def hamiltonian_field(mechanism: Mechanism, q: NDArray[numpy.float64], p: NDArray[numpy.float64], tau: Optional[NDArray[numpy.float64]] = None, wrench: Optional[NDArray[numpy.float64]] = None, out: Optional[tuple[NDArray[numpy.float64], NDArray[numpy.float64]]] = None) -> tuple[NDArray[numpy.float64], NDArray[numpy.float64]]:
    """The O(n) Hamiltonian vector field of H(q, p) = p M(q)^-1 p / 2 + V(q), no mass matrix formed: q' = dH/dp, p' = -dH/dq + loads.

    q, p: (nq,) or (n, nq), rotation blocks: quaternion and lift. Returns (q_dot, p_dot); out: a tuple of two arrays.
    """
    ...

def forward_kinematics(mechanism: Mechanism, q: NDArray[numpy.float64], out: Optional[tuple[NDArray[numpy.float64], NDArray[numpy.float64]]] = None) -> tuple[NDArray[numpy.float64], NDArray[numpy.float64]]:
    """Pose of the moving bodies' frames in the world, root to leaf: (R, r).

    R: (bodies, 3, 3) or (n, bodies, 3, 3), columns are the body's axes; r: (bodies, 3), origins [m]. A user's body: body_pose.
    """
    ...

def body_pose(mechanism: Mechanism, q: NDArray[numpy.float64], body: str, out: Optional[tuple[NDArray[numpy.float64], NDArray[numpy.float64]]] = None) -> tuple[NDArray[numpy.float64], NDArray[numpy.float64]]:
    """Pose of a body of that name in the world: (R, r), (3, 3) and (3,), or (n, 3, 3) and (n, 3)."""
    ...

def coordinate_rates(mechanism: Mechanism, q: NDArray[numpy.float64], v: NDArray[numpy.float64], out: Optional[NDArray[numpy.float64]] = None) -> NDArray[numpy.float64]:
    """Flat coordinate derivatives q' from joint rates v: (nq,) or (n, nq)."""
    ...

def momenta_from_rates(mechanism: Mechanism, q: NDArray[numpy.float64], v: NDArray[numpy.float64], out: Optional[NDArray[numpy.float64]] = None) -> NDArray[numpy.float64]:
    """p = flat momenta of the joint rates v: (nq,) or (n, nq)."""
    ...

def rates_from_momenta(mechanism: Mechanism, q: NDArray[numpy.float64], p: NDArray[numpy.float64], out: Optional[NDArray[numpy.float64]] = None) -> NDArray[numpy.float64]:
    """Joint rates v = M(q)^-1 p from the flat momenta: (nv,) or (n, nv)."""
    ...

def momentum(mechanism: Mechanism, q: NDArray[numpy.float64], p: NDArray[numpy.float64], out: Optional[NDArray[numpy.float64]] = None) -> NDArray[numpy.float64]:
    """Total momentum at (q, p), [angular; linear]: (6,) or (n, 6), world axes, angular about the world's origin [kg m^2/s; kg m/s].

    It is the momentum of the bodies; the spin of rotors is not in it.
    """
    ...

def centre_of_mass(mechanism: Mechanism, q: NDArray[numpy.float64], out: Optional[NDArray[numpy.float64]] = None) -> NDArray[numpy.float64]:
    """Centre of mass of the moving bodies in the world [m]: (3,) or (n, 3)."""
    ...

def kinetic_energy(mechanism: Mechanism, q: NDArray[numpy.float64], p: NDArray[numpy.float64], out: Optional[NDArray[numpy.float64]] = None) -> typing.Union[float, NDArray[numpy.float64]]:
    """T = p q'/2 at (q, p) [J]: a number, or (n,) of a batch."""
    ...

def potential_energy(mechanism: Mechanism, q: NDArray[numpy.float64], out: Optional[NDArray[numpy.float64]] = None) -> typing.Union[float, NDArray[numpy.float64]]:
    """V = -sum m_i g c_i, zero at the world's origin [J]: a number, or (n,) of a batch. Joint springs are the system's."""
    ...

def viscous(damping: float) -> Function:
    """force = damping rate. Raises InvalidArgument if damping < 0."""
    ...

def friction(*, coulomb: float = 0.0, breakaway: float = 0.0, stribeck: float = 0.0, viscous: float = 0.0, smoothing: float = 0.0) -> Function:
    """Dry friction with the Stribeck effect, made smooth; passive by construction, as force and rate have one sign.

    force = (coulomb + (breakaway - coulomb) exp(-(rate/stribeck)^2)) tanh(rate/smoothing) + viscous rate
    """
    ...

def spring(k: float, rest: float = 0.0, k3: float = 0.0) -> Potential:
    """U = k (z - rest)^2 / 2 + k3 (z - rest)^4 / 4."""
    ...

def tabulated_spring(z: list[float], force: list[float]) -> Potential:
    """A force measured at some elongations: a natural cubic spline between them, linear outside."""
    ...

def soft_limits(lower: float, upper: float, k: float) -> Potential:
    """U = k d^3 / 3, d the depth beyond a limit: nothing is felt between the limits."""
    ...

def attitude_spring(stiffness: float, rest: list[float] = ...) -> BlockPotential:
    """U = k (1 - cos theta), theta the angle from the rest attitude (w, x, y, z): torque k sin theta [N m]."""
    ...

def place_spring(stiffness: float, rest: list[float] = ...) -> BlockPotential:
    """U = k |r - rest|^2 / 2."""
    ...

def constant(value: float) -> Function: ...

def sine(amplitude: float, frequency_Hz: float, phase: float = 0.0, offset: float = 0.0) -> Function:
    """offset + amplitude sin(2 pi frequency t + phase)"""
    ...

def profile(t: list[float], value: list[float]) -> Function:
    """Values at times, a natural cubic spline between them, the first and last value outside."""
    ...

def spring_element(potential: Potential, domain: str = 'rotation') -> Model:
    """State: elongation z, z' = rate. Port 'ends' (flow in): rate -> force U'(z). A capacitor in the electrical domain."""
    ...

def inertia_element(mass: float, domain: str = 'rotation') -> Model:
    """State: momentum p, p' = force. Port 'body' (effort in): force -> rate p/m. An inductor in the electrical domain."""
    ...

def dc_motor(*, inductance: float, resistance: float, constant: float, gear: float = 1.0, rotor_inertia: float = 0.0, friction: float = 0.0) -> Model:
    """Direct-current motor with its rotor: torque k i against back-emf k w. States: flux L i [H], momentum of the rotor
    seen at the shaft. Ports 'supply' (effort in: V -> A) and 'shaft' (effort in: N m -> rad/s).
    """
    ...

def dc_drive(*, inductance: float, resistance: float, constant: float, gear: float = 1.0, rotor_inertia: float = 0.0, friction: float = 0.0) -> Model:
    """The drive of a rigid gear: no rotor of its own (give gear^2 rotor_inertia to the joint as its rotor inertia). State:
    flux. Ports 'supply' and 'shaft' (flow in: rad/s -> the torque against it), for Network.feedback with a joint.
    """
    ...

def linear_system(J: Any, G: Any, *, R: Any = None, Q: Any = None, E: Any = None, name: str = 'linear system') -> Model:
    """The linear port-Hamiltonian system E x' = (J - R) Q x + G u, y = G^T Q x, H = x E^T Q x / 2, as a model.

    Matrices as rows; Q and E left out are the identity, R zero. What is not port-Hamiltonian is refused: matrix, entry and
    size of the violation are named.
    """
    ...

def methods() -> list[Declaration]:
    """All methods, in the order of docs and `porthos methods`."""
    ...

def declaration_of(method: str) -> Declaration:
    """The declaration of a method; InvalidArgument for an unknown name lists the known ones."""
    ...

def misfit(method: str, model: Model) -> Optional[str]:
    """Why a method cannot take a system, or None if it can."""
    ...

def integrator(name: str, model: Model, step: float, *, rtol: float = 1e-12, atol: float = 1e-14, max_sweeps: int = 100, solver: Solver = ..., lanes: bool = True, binding: float = 0.0, iteration_tolerance: float = 0.0) -> Integrator:
    """A method by its name in methods() on a system, step [s].

    rtol, atol: of methods that work to a tolerance. max_sweeps: of implicit iterations. iteration_tolerance: 0 iterates to
    rounding, see Options in C++. Raises InvalidArgument for an unknown name (lists the known ones), a step that is zero or not
    finite, a system the method cannot take, or a sampled controller whose period is not a whole number of steps.
    """
    ...

def add_method(name: str, step: Callable[..., Any], *, order: int, title: str = '', symmetric: bool = False, symplectic: bool = False, quadratic_invariants: bool = False, energy_exact: bool = False, needs: list[str] = []) -> None:
    """Adds a method of integration of your own to those of scenes, simulate() and compare().

    step(field, t, x, h) returns x(t + h) - x(t), an array (nx,): the difference keeps the digits that x + difference would lose. t
    [s] and h [s] are numbers, h also negative; x is a read-only array (nx,) of state numbers; field(t, x) returns their rates (nx,). A
    step may depend on its arguments alone. In derivatives and 113-bit references the arrays hold Dual or Quad numbers: write
    the step with operators and numpy's functions. symmetric and energy_exact are checked by
    verify(), all claims by check_method(); else a run or compare() tells what contradicts them. needs: what
    a system must have, of "canonical" (x = (q, p) in two halves), "lossless", "separable" (H = T(p) + V(q)) and "linear_state" (no
    quaternions); others are refused in one sentence. A second call with the same name replaces the method; a run
    by the one before is not resumed by another (see method_version). One step costs some microseconds for Python beside its evaluations. Raises InvalidArgument for the name of a method of Porthos.
    """
    ...

def check_method(method: str, model: Model, start: Any, *, step: float) -> ClaimReport:
    """Measures what a method claims, one of your own too, on a model from a start: order, symmetry, symplecticity by the exact
    derivative of two steps, quadratic invariants, energy, of systems with losses or sources the balance. step [s]: as long as runs have, for the errors of a false claim shrink
    with it. A claim that holds here need not hold on every system.
    """
    ...

def method_version(method: str) -> str:
    """Of a method that was added: the digest of its code, with the numbers, arrays and functions that it uses; it ends in 'not checked' where it uses other objects, whose change a resumed run does not see. Empty: a method of Porthos."""
    ...

def read_scene(path: Any, *, method: Optional[str] = None, step: Optional[float] = None, duration: Optional[float] = None, change: dict[str, Union[float, list[float]]] = {}) -> SceneData:
    """Reads and validates a scene. change: numbers by keys as [ensemble.vary] has them. InvalidArgument, one sentence 'file:line:column: ...', for whatever is wrong in it."""
    ...

def assemble(scene: SceneData) -> Assembly: ...

def assembly_of(model: Model, x: Any) -> Assembly:
    """A system of the user's own instead of a model file, from the state x at time 0."""
    ...

def info_text(scene: SceneData, assembly: Assembly) -> str:
    """What `porthos info` prints: states, ports, invariants, plan, cost of one evaluation."""
    ...

def version_text() -> str:
    """What `porthos --version` prints."""
    ...

def run_into(scene: SceneData, assembly: Assembly, out: str, resume: bool = False, check_symmetry: bool = False, report: Any = None, extend: Optional[float] = None) -> tuple:
    """Runs a scene into a folder: (summary.json, whether it was interrupted). report: called with (fraction, spent, left). extend: continues the finished run in the folder to this time."""
    ...

def run_in_memory(scene: SceneData, assembly: Assembly, check_symmetry: bool = False, report: Any = None) -> tuple:
    """Runs without files: (summary.json, {name: (array, unit)}, states). The names are those of run.h5."""
    ...

def compare_methods(scene: SceneData, assembly: Assembly, methods: list[str], budget: float, duration: Optional[float], out: str, report: Any = None) -> tuple:
    """Speed against error: (compare.json, compare.txt), and the files in `out` unless it is empty."""
    ...

def error_statistics(errors: list[float], *, scale: float = 1.0) -> dict:
    """Growth and drift of a series of errors at equal intervals of time, as runs are judged: max_abs, rms, change, growth_exponent (0 bounded or constant, 0.5 random walk, 1 drift or faster; nan for less than 33 records, too few swings, too much scatter, or a jump within a record: the words tell which), drift_is_significant (beyond five standard errors of a random walk), swing_growth (how many times larger the scatter is in the last part than in the first, if it rises from part to part, else 1) and words (what follows "the error" in the verdict of a run, a drift per record). scale: what the errors are relative to, in the words alone; they compare the error with rounding."""
    ...

def moved_in(folder: os.PathLike) -> tuple:
    """The mechanisms of a finished run, one per phase, and names and energies of its actuators, from the scene and the model in its results; empty for a system without a mechanism."""
    ...

def motion_of(run: Any, most: int, bands: bool) -> tuple:
    """How the mechanism of a Result moved, over its phases: times, and the panels {title with unit: {line: values}}. bands: of a part of many records the least and the largest, in place of one."""
    ...

def states_of(run: Any, most: int, bands: bool) -> tuple:
    """The states of a Result of any system, in the same way."""
    ...

def residual_panel(t: list[float], error: list[float], limit: Optional[float] = None) -> list:
    """What energy_error.svg shows of a series of relative errors, reduced to 1500 columns: (name, stroke, t, value, low), stroke one of line, band, guide, limit."""
    ...

def thinned(count: int, most: int) -> list[int]:
    """Which of `count` records a line of at most `most` shows: one of each of equal parts, anywhere in it but always the same."""
    ...

def is_held(values: list[float]) -> bool:
    """Whether a series is held between instants, and drawn as stairs."""
    ...

def before_holes(times: list[float]) -> list[float]:
    """The instants of the rows behind which others are missing [s]."""
    ...

def line_colours() -> list[str]:
    """Of the lines of every picture, as #rrggbb: those of the SVG files and of the report."""
    ...

def export_csv(folder: str, file: str, names: list[str] = []) -> None:
    """The time series of a finished run as one CSV table: Result.to_csv()."""
    ...

def find_template() -> str:
    """The page of report.html without its data; empty if there is none."""
    ...

def write_report(folder: str, out: str, page: str, models: list[os.PathLike] = []) -> str:
    """Fills the template `page` with the results in a folder and writes `out`. models: where the meshes of the model are. Returns what the playback does not show of them, empty if it shows all."""
    ...

def write_film(page: str, out: str, size: tuple[int, int], start: Optional[float], end: Optional[float], speed: Optional[float], camera: str, follow: str, orbit: bool, arrows: bool, dark: bool, trail: bool, trail_of: list[str], text: bool) -> str:
    """Writes a film or a picture of the playback of a report.html, or of the results in a folder. Returns a remark where bodies turn far between two of its records."""
    ...

def model_folders(scene: SceneData) -> list[os.PathLike]:
    """The folders of a scene's model and of the scene, where its meshes are."""
    ...

def scene_of_case(path: os.PathLike, index: int, *, method: Optional[str] = None, step: Optional[float] = None, duration: Optional[float] = None) -> SceneData:
    """A case of a scene's [ensemble] as a scene by itself; path: the scene file, or the results of the ensemble."""
    ...

def assemblies_of_cases(scene: SceneData, cases: int) -> list[Assembly]:
    """The first cases of a scene's [ensemble] put together; they share one model where they differ in numbers of [initial] alone."""
    ...

def run_ensemble(scene: SceneData, out: str, threads: int = 0, resume: bool = False, report: Any = None) -> bool:
    """Runs the cases of a scene's [ensemble] into a folder; whether it was interrupted."""
    ...

def plan_into(scene: SceneData, assembly: Assembly, out: str) -> tuple:
    """Plans a scene into a folder: (plan.json, whether it was interrupted)."""
    ...

def judge_into(file: str, model: str, map: str, out: str) -> str:
    """Judges a trajectory into a folder: summary.json."""
    ...

def gradient(model: Model, x: Any, step: float, steps: int, *, method: str = 'gauss16', end: Any = None, sampled: Any = None, running: Any = None, memory: int = 67108864, direction: Any = None, parameter_direction: Any = None, end_curvature: Any = None, sampled_curvature: Any = None, running_curvature: Any = None) -> Gradient:
    """The gradient of a run of `steps` steps [s] from the state x (nx,), by the discrete adjoint: exact to rounding for
    the numbers the run computes. It takes the time of a few runs, however many parameters there are.

    The cost is J = end(t, x) + the sum of sampled(t, x) over the ends of all steps + the integral of running(t, x) by the
    method's quadrature. Each is a function that returns (value, gradient (nx,)), with the angles of x unwrapped; the last step
    is asked first. Parameters: "<body>.mass", ".moment.x" (mass times centre), ".inertia.xx" (about the body's origin),
    "<joint>.rotor_inertia", ".stiffness", ".damping", ".rest", and "<element>.factor", a factor on the force of an element of a
    network; networks with controllers or wrenches have none. memory: bytes for stages and checkpoints.

    direction (nx,): a change of the start, along which the gradient is differentiated too: start_along is the product of the
    Hessian of J with it, parameters_along that of the mixed derivatives, exact to rounding as the gradient (tangent over
    adjoint). parameter_direction: a change of parameters by name, {"link_3.mass": 1.0}, which the direction goes along too. end_curvature and the others are functions of (t, x, v) that return the Hessian of their part times v; without
    one, its gradient is differenced, with an error of some 1e-10.

    Raises InvalidArgument for a method without it (docs/derivatives.md, "What is covered"), a model with constraints or
    a sampled law without derivatives, a direction with sampled controllers or in a system without second derivatives, and RuntimeError where a step or its adjoint does not converge.
    """
    ...

def gradient_of_scene(scene: SceneData, assembly: Assembly, end: Any, sampled: Any, running: Any, memory: int, direction: Any, parameter_direction: Any, end_curvature: Any, sampled_curvature: Any, running_curvature: Any) -> Gradient:
    """What Scene.gradient() calls."""
    ...

def monodromy(model: Model, x: Any, step: float, steps: int, *, method: str = 'gauss16') -> tuple:
    """The derivative of the end of a run by its start, (nx, nx), and the last state. Over one period of a periodic orbit it is
    the monodromy matrix: its eigenvalues are the multipliers, 1 twice in a Hamiltonian system. Cost: nx tangents.

    Raises InvalidArgument as gradient(), and RuntimeError where a step or its tangent does not converge.
    """
    ...

def lyapunov_spectrum(model: Model, x: Any, step: float, steps: int, *, method: str = 'gauss16', count: int = 0, settle: int = 0, every: int = 1) -> LyapunovSpectrum:
    """The Lyapunov exponents [1/s] along a run of `steps` steps [s] from x (nx,): tangents carried by the derivative of the steps
    and made orthonormal by QR (Benettin et al. 1980). They converge like 1/t. All nx of a Hamiltonian system come in pairs and
    add up to zero to rounding, those of a damped one to the mean trace of its field's derivative. Each quaternion with its
    momenta has two that are zero.

    count: of the largest; 0: all. settle: steps before the first that counts. every: steps between orthonormalisations.

    Raises InvalidArgument as gradient() and for options out of range, and RuntimeError where a step or its tangent does not
    converge.
    """
    ...

def sensitivity_of_scene(scene: SceneData, of: list[str], by: list[str], uncertainty: Optional[float], threads: int) -> dict:
    """What Scene.sensitivity() calls."""
    ...

def gradient_in_rates(model: MechanicalModel, q: Any, v: Any, start: Any) -> tuple:
    """From Gradient.start of a MechanicalModel that started at coordinates q (nq,) and joint rates v (nv,): (dJ/dq, dJ/dv,
    parameters). The momenta at given rates depend on the inertias, so a parameter's whole derivative is that of
    Gradient.parameters plus the one here.
    """
    ...

def gradient_across_events(phases: list[tuple[Model, list[RunEvent]]], x: Any, step: float, duration: float, *, method: str = 'gauss16', end: Any = None, sampled: Any = None, end_by_time: Any = None, grazing: float = 1e-06) -> EventGradient:
    """The gradient of a run that jumps: bounces, locks, forces that switch on. phases: [(model, [RunEvent, ...]), ...]; the run
    begins in the first, from the state x (nx,) at time 0. A step is cut at the instant of an event, which moves with the
    start, and the gradient is that of the steps as they are cut, to rounding.

    The cost is J = end(t, x) + the sum of sampled(t, x) over the ends of steps that no event cuts, each a function that returns
    (value, gradient (nx,)). end_by_time(t, x): d end/dt, for a run that an event ends. grazing: of a guard's rate at its zero,
    against its change over a step; below it the event grazes.

    Raises InvalidArgument as gradient(), for sampled controllers and for methods without it (docs/derivatives.md), and
    RuntimeError where an event grazes, two are at one instant, or a step or its adjoint does not converge.
    """
    ...

def identify_scene(scene: SceneData, log: Any, parameters: list[str], sigma_of_all: Optional[float], sigma_by_name: dict[str, float], out: Optional[str]) -> dict:
    """What Scene.identify() calls."""
    ...

def _cpp_seconds(mechanism: Mechanism, kernel: str, states: int, lanes: bool, repeats: int) -> float:
    """Least time of a C++ loop over so many states [s]; in lanes: states laid out in packs already."""
    ...

def linearise(model: Model, x: Any, u: Any = None, *, rates: bool = False) -> tuple:
    """A and B of dx' = A dx + B du about a state, exact to rounding: a tuple of arrays (nx, nx) and (nx, nu).

    model: any without closed loops, a mechanism or a network; springs and dampers of joints and elements are part of it. x: the
    state, (nx,), of a mechanism (q, p), as model.state(q, v) makes it; u: the inputs there, (nu,), None: 0. rates: of a
    MechanicalModel at rest, in (q, q') in place of (q, p); a warning tells where it is no equilibrium. Raises InvalidArgument for other
    numbers, for closed loops and sampled laws, and with rates for a state that moves, joints of several degrees of freedom, and other models.
    """
    ...
