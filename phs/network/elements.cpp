#include "phs/network/elements.h"

#include <cmath>
#include <numbers>

#include "phs/functions/of_time.h"
#include "phs/functions/spline.h"
#include "phs/system/user_model.h"

namespace porthos::phs {
namespace {

void require(bool condition, const char* element, const char* what, double value,
             const char* expected) {
  if (!condition || !std::isfinite(value))
    throw InvalidArgument(std::string(element) + ": " + what + " is " + number(value) +
                          ", expected " + expected);
}

template <class T>
using In = std::span<const T>;
template <class T>
using Out = std::span<T>;

/// A single state number that only its input changes: x' = u, y = ∂H/∂x.
struct Store {
  template <class T>
  void structure(In<T>, In<T>, Out<T> Je) const {
    Je[0] = T(0.0);
  }
  template <class T>
  void input(In<T>, In<T> u, Out<T> Gu) const {
    Gu[0] = u[0];
  }
};

/// z' = u, y = U'(z).
struct SpringElement : Store {
  Potential U;
  Domain d;

  Description description() const {
    Description s;
    s.name = "spring";
    s.nx = s.nu = 1;
    s.blocks = {{"elongation", BlockKind::linear, 0, 1, -1, d.displacement, ""}};
    s.ports = {{"ends", PortKind::flow_in, 1, 0, d.flow, d.effort, true}};
    return s;
  }
  template <class T>
  T hamiltonian(In<T> x) const {
    return (*U.energy)(x[0]);
  }
  template <class T>
  void gradient(In<T> x, Out<T> e) const {
    e[0] = (*U.slope)(x[0]);
  }
};

/// p' = u, y = p / m.
struct InertiaElement : Store {
  double mass;
  Domain d;

  Description description() const {
    Description s;
    s.name = "inertia";
    s.nx = s.nu = 1;
    s.blocks = {{"momentum", BlockKind::linear, 0, 1, -1, d.momentum, ""}};
    s.ports = {{"body", PortKind::effort_in, 1, 0, d.effort, d.flow}};
    return s;
  }
  template <class T>
  T hamiltonian(In<T> x) const {
    return T(0.5 / mass) * x[0] * x[0];
  }
  template <class T>
  void gradient(In<T> x, Out<T> e) const {
    e[0] = x[0] / T(mass);
  }
};

/// x = (φ, p): φ' = -R i - k n ω + V, p' = k n i - b n² ω + τ with i = φ/L, ω = p/(n² J).
struct Motor {
  DcMotor m;
  double k, J, b;  ///< seen at the shaft
  explicit Motor(const DcMotor& motor)
      : m(motor),
        k(m.constant * m.gear),
        J(m.rotor_inertia * m.gear * m.gear),
        b(m.friction * m.gear * m.gear) {}

  Description description() const {
    Description s;
    s.name = "dc motor";
    s.nx = s.nu = 2;
    s.blocks = {{"flux", BlockKind::linear, 0, 1, -1, "V s", ""},
                {"momentum", BlockKind::linear, 1, 1, -1, "kg m^2/s", ""}};
    s.ports = {{"supply", PortKind::effort_in, 1, 0, "V", "A"},
               {"shaft", PortKind::effort_in, 1, 1, "N m", "rad/s"}};
    s.traits.lossless = m.resistance == 0 && m.friction == 0;
    s.storages = {"winding", "rotor"};
    s.powers = {{"copper", PowerKind::dissipated}, {"rotor_friction", PowerKind::dissipated}};
    return s;
  }
  template <class T>
  T hamiltonian(In<T> x) const {
    return T(0.5 / m.inductance) * x[0] * x[0] + T(0.5 / J) * x[1] * x[1];
  }
  template <class T>
  void gradient(In<T> x, Out<T> e) const {
    e[0] = x[0] / T(m.inductance);
    e[1] = x[1] / T(J);
  }
  template <class T>
  void structure(In<T>, In<T> e, Out<T> Je) const {
    Je[0] = T(-k) * e[1];
    Je[1] = T(k) * e[0];
  }
  template <class T>
  void dissipation(In<T>, In<T> e, Out<T> Re) const {
    Re[0] = T(m.resistance) * e[0];
    Re[1] = T(b) * e[1];
  }
  template <class T>
  void input(In<T>, In<T> u, Out<T> Gu) const {
    Gu[0] = u[0];
    Gu[1] = u[1];
  }
  template <class T>
  void stored(In<T> x, Out<T> values) const {
    values[0] = T(0.5 / m.inductance) * x[0] * x[0];
    values[1] = T(0.5 / J) * x[1] * x[1];
  }
  template <class T>
  void powers(T, In<T>, In<T> e, Out<T> values) const {
    values[0] = T(m.resistance) * e[0] * e[0];
    values[1] = T(b) * e[1] * e[1];
  }
};

/// x = φ: φ' = -R i + V - k n ω. The flow port "shaft" takes ω and returns -k n i. The rotor
/// friction belongs to the joint.
struct Drive {
  DcMotor m;

  Description description() const {
    Description s;
    s.name = "dc drive";
    s.nx = 1;
    s.nu = 2;
    s.blocks = {{"flux", BlockKind::linear, 0, 1, -1, "V s", ""}};
    s.ports = {{"supply", PortKind::effort_in, 1, 0, "V", "A"},
               {"shaft", PortKind::flow_in, 1, 1, "rad/s", "N m", true}};
    s.traits.lossless = m.resistance == 0;
    s.storages = {"winding"};
    s.powers = {{"copper", PowerKind::dissipated}};
    return s;
  }
  template <class T>
  T hamiltonian(In<T> x) const {
    return T(0.5 / m.inductance) * x[0] * x[0];
  }
  template <class T>
  void gradient(In<T> x, Out<T> e) const {
    e[0] = x[0] / T(m.inductance);
  }
  template <class T>
  void structure(In<T>, In<T>, Out<T> Je) const {
    Je[0] = T(0.0);
  }
  template <class T>
  void dissipation(In<T>, In<T> e, Out<T> Re) const {
    Re[0] = T(m.resistance) * e[0];
  }
  template <class T>
  void input(In<T>, In<T> u, Out<T> Gu) const {
    Gu[0] = u[0] - T(m.constant * m.gear) * u[1];
  }
  template <class T>
  void powers(T, In<T>, In<T> e, Out<T> values) const {
    values[0] = T(m.resistance) * e[0] * e[0];
  }
};

void check_motor(const char* name, const DcMotor& m) {
  require(m.inductance > 0, name, "inductance", m.inductance, "more than 0 H");
  require(m.resistance >= 0, name, "resistance", m.resistance, "0 Ohm or more");
  require(true, name, "constant", m.constant, "a finite number of N m/A");
  require(m.gear != 0, name, "gear", m.gear, "a number that is not 0");
}

}  // namespace

FunctionPtr viscous(double damping) {
  require(damping >= 0, "viscous damper", "damping", damping, "0 or more");
  return function([damping](auto v) { return decltype(v)(damping) * v; });
}

FunctionPtr friction(const Friction& f) {
  const char* const name = "friction";
  require(f.coulomb >= 0, name, "coulomb", f.coulomb, "0 or more");
  require(f.viscous >= 0, name, "viscous", f.viscous, "0 or more");
  require(f.breakaway == 0 || f.breakaway >= f.coulomb, name, "breakaway", f.breakaway,
          "the Coulomb force or more");
  const double extra = f.breakaway > f.coulomb ? f.breakaway - f.coulomb : 0;
  require(extra == 0 || f.stribeck > 0, name, "stribeck", f.stribeck, "a rate above 0");
  require(f.smoothing > 0, name, "smoothing", f.smoothing, "a rate above 0");
  const double per_stribeck = extra > 0 ? 1 / f.stribeck : 0;
  return function([=](auto v) {
    using T = decltype(v);
    const T s = T(per_stribeck) * v;
    return (T(f.coulomb) + T(extra) * exp(-(s * s))) * tanh(v / T(f.smoothing)) + T(f.viscous) * v;
  });
}

void check(const LuGre& f) {
  const char* const name = "LuGre friction";
  require(f.coulomb > 0, name, "coulomb", f.coulomb, "more than 0");
  require(f.breakaway == 0 || f.breakaway >= f.coulomb, name, "breakaway", f.breakaway,
          "the Coulomb force or more");
  const double extra = f.breakaway > f.coulomb ? f.breakaway - f.coulomb : 0;
  require(extra == 0 || f.stribeck > 0, name, "stribeck", f.stribeck, "a rate above 0");
  require(f.bristle_stiffness > 0, name, "bristle_stiffness", f.bristle_stiffness, "more than 0");
  require(f.bristle_damping >= 0, name, "bristle_damping", f.bristle_damping, "0 or more");
  const double least = f.bristle_damping * extra / f.coulomb;
  const std::string expected =
      "bristle_damping (breakaway - coulomb) / coulomb = " + number(least, 6) +
      " or more: with less it would make energy";
  require(f.viscous >= least * (1 - 1e-14), name, "viscous", f.viscous,
          least > 0 ? expected.c_str() : "0 or more");
}

Potential spring(double k, double rest, double k3) {
  require(k >= 0, "spring", "stiffness", k, "0 or more");
  require(k3 >= 0, "spring", "cubic stiffness", k3, "0 or more");
  require(true, "spring", "rest", rest, "a finite number");
  return {function([=](auto z) {
            using T = decltype(z);
            const T d = z - T(rest), d2 = d * d;
            return (T(0.5 * k) + T(0.25 * k3) * d2) * d2;
          }),
          function([=](auto z) {
            using T = decltype(z);
            const T d = z - T(rest);
            return (T(k) + T(k3) * d * d) * d;
          })};
}

Potential tabulated_spring(const std::vector<double>& z, const std::vector<double>& force) {
  const auto s =
      std::make_shared<const Spline>(z, force, Spline::Outside::linear, "tabulated spring");
  return {function([s](auto x) { return s->integral(x); }),
          function([s](auto x) { return s->value(x); })};
}

Potential soft_limits(double lower, double upper, double k) {
  require(lower < upper, "soft limits", "lower limit", lower, "less than the upper limit");
  require(true, "soft limits", "upper limit", upper, "a finite number");
  require(k > 0, "soft limits", "stiffness", k, "more than 0");
  return {function([=](auto z) {
            using T = decltype(z);
            const T below = max(T(lower) - z, T(0.0)), above = max(z - T(upper), T(0.0));
            return T(k / 3) * (below * below * below + above * above * above);
          }),
          function([=](auto z) {
            using T = decltype(z);
            const T below = max(T(lower) - z, T(0.0)), above = max(z - T(upper), T(0.0));
            return T(k) * (above * above - below * below);
          })};
}

FunctionPtr constant(double value) {
  require(true, "constant source", "value", value, "a finite number");
  return of_time_alone(function([value](auto t) { return decltype(t)(value); }));
}

FunctionPtr sine(double amplitude, double frequency_Hz, double phase, double offset) {
  require(true, "sine source", "amplitude", amplitude, "a finite number");
  require(true, "sine source", "frequency", frequency_Hz, "a finite number of Hz");
  require(true, "sine source", "phase", phase, "a finite number of rad");
  require(true, "sine source", "offset", offset, "a finite number");
  const double omega = 2 * std::numbers::pi * frequency_Hz;
  return of_time_alone(function([=](auto t) {
    using T = decltype(t);
    return T(offset) + T(amplitude) * sin(T(omega) * t + T(phase));
  }));
}

FunctionPtr profile(const std::vector<double>& t, const std::vector<double>& value) {
  const auto s = std::make_shared<const Spline>(t, value, Spline::Outside::held, "profile");
  return of_time_alone(function([s](auto x) { return s->value(x); }));
}

Held::Held() : value_(std::make_shared<double>(0.0)) {}
FunctionPtr Held::signal() const {
  return function([v = value_](auto t) { return decltype(t)(*v); });
}

std::shared_ptr<const Model> spring_element(const Potential& potential, const Domain& d) {
  return std::make_shared<UserModel<SpringElement>>(SpringElement{{}, potential, d});
}
std::shared_ptr<const Model> inertia_element(double mass, const Domain& d) {
  require(mass > 0, "inertia", "mass", mass, "more than 0");
  return std::make_shared<UserModel<InertiaElement>>(InertiaElement{{}, mass, d});
}
std::shared_ptr<const Model> dc_motor(const DcMotor& m) {
  check_motor("dc motor", m);
  require(m.rotor_inertia > 0, "dc motor", "rotor_inertia", m.rotor_inertia, "more than 0 kg m²");
  require(m.friction >= 0, "dc motor", "friction", m.friction, "0 N m s/rad or more");
  return std::make_shared<UserModel<Motor>>(Motor(m));
}
std::shared_ptr<const Model> dc_drive(const DcMotor& m) {
  check_motor("dc drive", m);
  return std::make_shared<UserModel<Drive>>(Drive{m});
}

}  // namespace porthos::phs
