#include "vsa/actuator.h"

#include <fmt/format.h>

#include "phs/error.h"
#include "phs/network/elements.h"
#include "vsa/detail/actuator_system.h"

namespace porthos::vsa {
namespace {

using Kind = Drive::Kind;

bool has_rotor(const Drive& d) { return d.kind == Kind::torque || d.kind == Kind::position; }

[[noreturn]] void refuse_actuator(const std::string& why) {
  throw InvalidArgument("actuator: " + why);
}

void check(const char* axis, const Drive& d) {
  const auto require = [&](bool ok, const char* what, double value, const char* expected) {
    if (!ok || std::isnan(value))
      refuse_actuator(fmt::format("{} {} is {}, expected {}", axis, what, value, expected));
  };
  if (has_rotor(d)) {
    require(d.inertia > 0 && d.inertia < HUGE_VAL, "inertia", d.inertia,
            "more than 0 kg m^2: a torque on no inertia has no rate (or a drive by rate)");
    require(d.gear != 0 && std::fabs(d.gear) < HUGE_VAL, "gear", d.gear, "a number that is not 0");
    require(d.viscous >= 0 && d.viscous < HUGE_VAL, "viscous", d.viscous, "0 N m s/rad or more");
    require(d.rate_limit == HUGE_VAL || d.torque_limit < HUGE_VAL, "torque_limit", d.torque_limit,
            "a number, as a rate limit is given");
  } else {
    const char* const expected = "none: only a drive by torque or position has a rotor";
    require(d.inertia == 0, "inertia", d.inertia, expected);
    require(d.viscous == 0 && !d.friction, "viscous or friction", d.viscous, expected);
    require(d.torque_limit == HUGE_VAL, "torque_limit", d.torque_limit, expected);
    require(d.rate_limit == HUGE_VAL || d.kind == Kind::rate, "rate_limit", d.rate_limit,
            "none, or a drive by torque, position or rate");
  }
  require(d.torque_limit > 0, "torque_limit", d.torque_limit, "more than 0 N m");
  require(d.rate_limit > 0, "rate_limit", d.rate_limit, "more than 0 rad/s");
  if (d.kind == Kind::position) {
    require(d.kp >= 0 && d.kp < HUGE_VAL, "kp", d.kp, "0 N m/rad or more");
    require(d.kd >= 0 && d.kd < HUGE_VAL, "kd", d.kd, "0 N m s/rad or more");
  }
  if (d.kind == Kind::servo) {
    for (const double p : d.p) require(p > 0, "servo coefficient", p, "more than 0");
    if (!(d.p[0] < d.p[1] * d.p[2]))  // Routh
      refuse_actuator(
          fmt::format("{} servo has p1 = {} and p2 p3 = {}, expected p1 less than p2 p3: it would "
                      "not be stable",
                      axis, d.p[0], d.p[1] * d.p[2]));
  }
  if ((d.kind == Kind::servo || d.kind == Kind::position) && !d.command)
    refuse_actuator(fmt::format("{} has no command, expected a position", axis));
  if (d.kind == Kind::fixed && d.command)
    refuse_actuator(fmt::format("{} is fixed and has a command, expected one of both", axis));
}

class ActuatorModel final : public phs::ModelFor<ActuatorModel> {
 public:
  explicit ActuatorModel(const Actuator& a) { describe(a); }
  const phs::Description& description() const override { return l_.description; }
  template <class T>
  std::unique_ptr<phs::System<T>> make_system() const {
    return std::make_unique<ActuatorSystem<T>>(l_);
  }

 private:
  void describe(const Actuator& a) {
    l_.elastic = a.elastic;
    phs::Description& d = l_.description;
    const ElasticTraits& traits = a.elastic->traits();
    d.name = "actuator " + traits.family;
    d.storages = {"spring"};
    d.blocks = {{"link", phs::BlockKind::linear, 0, 1, -1, "rad", ""},
                {"theta", phs::BlockKind::linear, 1, 1, -1, "rad", ""}};
    d.ports = {{"link", phs::PortKind::flow_in, 1, 0, "rad/s", "N m", true}};
    d.nx = 2;
    d.nu = 1;
    d.traits.quadratic = true;  // rotors
    l_.axes[0].at = 1;
    if (!traits.sigma.empty()) {
      l_.axes[1].at = d.nx++;
      d.blocks.push_back({"sigma", phs::BlockKind::linear, 2, 1, -1, traits.sigma_unit, ""});
    }
    for (const bool second : {false, true}) {
      Layout::Axis& axis = l_.axes[second];
      const Drive& drive = second ? a.sigma : a.theta;
      if (axis.at < 0) continue;
      axis.kind = drive.kind;
      axis.p = drive.p;
      const std::string name = second ? "sigma" : "theta";
      const std::string effort = second ? traits.sigma_effort_unit() : "N m";
      const std::string rate = second ? traits.sigma_rate_unit() : "rad/s";
      if (has_rotor(drive)) {
        axis.momentum = d.nx++;
        axis.inertia = drive.gear * drive.gear * drive.inertia;
        axis.per_inertia = 1 / axis.inertia;
        axis.damping = drive.gear * drive.gear * drive.viscous;
        auto& block = d.blocks[size_t(axis.at)];
        block.momentum = axis.momentum;
        block.momentum_unit = block.unit == "rad" ? "kg m^2/s"
                              : block.unit == "m" ? "kg m/s"
                                                  : effort + " s";
        axis.port = d.nu++;
        d.ports.push_back({name, phs::PortKind::effort_in, 1, axis.port, effort, rate});
        axis.stored = int(d.storages.size());
        d.storages.push_back(second ? "sigma_rotor" : "rotor");
        if (drive.viscous > 0) {
          axis.friction = int(d.powers.size());
          d.powers.push_back({name + ".viscous", phs::PowerKind::dissipated});
          d.traits.lossless = false;
        }
      } else if (drive.kind == Kind::rate) {
        axis.port = d.nu++;
        d.ports.push_back({name, phs::PortKind::flow_in, 1, axis.port, rate, effort});
      } else if (drive.kind == Kind::servo) {
        axis.servo = d.nx;
        d.nx += 2;
        axis.command = drive.command;
        d.blocks.push_back({name + ".rate", phs::BlockKind::linear, axis.servo, 1, -1, rate, ""});
        d.blocks.push_back({name + ".acceleration", phs::BlockKind::linear, axis.servo + 1, 1, -1,
                            rate + "^2", ""});
        axis.work = int(d.powers.size());
        d.powers.push_back({name + ".servo", phs::PowerKind::supplied});
        d.traits.autonomous = false;
      }
    }
  }
  Layout l_;
};

/// L tanh(u / L)
template <class T>
T limited(const T& u, double L) {
  using phs::tanh;
  return L < HUGE_VAL ? T(L) * tanh(T(u / T(L))) : u;
}

/// Of a drive by torque or position, at the gear's output.
template <class T>
T exerted(const Drive& d, const T& t, const T& angle, const T& rate) {
  const T command = (*d.command)(t);
  if (d.kind == Kind::torque) return limited(command, d.torque_limit);
  return limited(T(T(d.kp) * (command - angle) - T(d.kd) * rate), d.torque_limit);
}

/// A law at the gear's output, force(rate), seen through a lever r: r law(r v).
phs::FunctionPtr behind(phs::FunctionPtr law, double r) {
  if (r == 1) return law;
  return phs::function([law, r](auto v) {
    using T = decltype(v);
    return T(T(r) * (*law)(T(T(r) * v)));
  });
}

bool has_brake(const Drive& d) { return has_rotor(d) && d.rate_limit < HUGE_VAL; }

/// Against the rate v: 0 below the limit w, L at 5 % above it.
template <class T>
T brake(const T& v, double w, double L) {
  using phs::max;
  const double c = L / (0.05 * 0.05 * w * w);
  const T fast = max(T(v - T(w)), T(0.0)), back = max(T(-v - T(w)), T(0.0));
  return T(c) * (fast * fast - back * back);
}

/// The port at which a drive acts; its flow is the gear's output divided by r.
struct Place {
  std::string port;
  double r = 1;
};

void act(phs::Network& n, const std::string& who, const Place& place, size_t at, const Drive& d) {
  if (d.kind == Kind::torque && d.command)
    n.source(who + ".torque", place.port, phs::function([d, r = place.r](auto t) {
               using T = decltype(t);
               return T(T(r) * exerted<T>(d, t, T(0.0), T(0.0)));
             }));
  if (d.kind == Kind::rate && d.command)
    n.source(who + ".rate", place.port, phs::function([f = d.command, L = d.rate_limit](auto t) {
               return limited((*f)(t), L);
             }));
  if (d.kind == Kind::position)
    n.control(who + ".controller", place.port, phs::law([d, at](auto t, auto x, auto y, auto u) {
                using T = std::remove_cvref_t<decltype(t)>;
                u[0] = exerted<T>(d, t, x[at], y[0]);
              }));
  if (d.friction) n.resist(who + ".friction", place.port, behind(d.friction, place.r));
  if (has_brake(d))
    n.resist(who + ".brake", place.port,
             behind(phs::function(
                        [w = d.rate_limit, L = d.torque_limit](auto v) { return brake(v, w, L); }),
                    place.r));
}

/// Adds everything but the member and its junctions.
void act(phs::Network& n, const std::string& name, const std::string& joint_port,
         const Place& theta, const Actuator& a) {
  act(n, name + ".theta", theta, 1, a.theta);
  if (!a.elastic->traits().sigma.empty()) act(n, name + ".sigma", {name + ".sigma"}, 2, a.sigma);
  const double c = a.damping, r = theta.r;
  if (c > 0 && has_rotor(a.theta))
    n.resist(name + ".damping", {joint_port, theta.port},
             phs::Matrix{{c, -r * c}, {-r * c, r * r * c}});
  else if (c > 0)
    n.resist(name + ".damping", joint_port, phs::viscous(c));
  if (a.damper)
    n.control(name + ".damper", joint_port,
              phs::law([f = a.damper, most = a.damper_limit](auto t, auto, auto y, auto u) {
                using T = std::remove_cvref_t<decltype(t)>;
                using phs::max, phs::min;
                u[0] = -min(max(T((*f)(t)), T(0.0)), T(most)) * y[0];
              }));
}

}  // namespace

double drive_torque(const Drive& d, double t, double angle, double rate) {
  return has_rotor(d) && d.command ? exerted(d, t, angle, rate) : 0;
}

double drive_rate(const Drive& d, double t) {
  return d.kind == Kind::rate && d.command ? limited((*d.command)(t), d.rate_limit) : 0;
}

double rotor_losses(const Actuator& a, bool second, double rate, double link_rate) {
  const Drive& d = second ? a.sigma : a.theta;
  if (!has_rotor(d)) return 0;
  double torque = -d.gear * d.gear * d.viscous * rate;
  if (d.friction) torque -= (*d.friction)(rate);
  if (has_brake(d)) torque -= brake(rate, d.rate_limit, d.torque_limit);
  if (!second) torque += a.damping * (link_rate - rate);
  return torque;
}

std::shared_ptr<const phs::Model> actuator_model(const Actuator& a) {
  if (!a.elastic) refuse_actuator("has no elastic energy, expected a device or a family");
  check("theta", a.theta);
  if (a.elastic->traits().sigma.empty()) {
    if (a.sigma.kind != Kind::fixed)
      refuse_actuator(fmt::format(
          "sigma has a drive, but the energy of '{}' does not depend on sigma, expected none",
          a.elastic->traits().family));
  } else {
    check("sigma", a.sigma);
  }
  if (!(a.damping >= 0 && a.damping < HUGE_VAL))
    refuse_actuator(fmt::format("damping is {}, expected 0 N m s/rad or more", a.damping));
  if (a.damping > 0 && !has_rotor(a.theta) && a.theta.kind != Kind::fixed)
    refuse_actuator(
        "damping between link and rotor is given, but theta has no rotor: expected a drive by "
        "torque or position; an element of type damper brakes the joint, not the spring");
  if (!(a.damper_limit > 0))
    refuse_actuator(
        fmt::format("damper_limit is {}, expected more than 0 N m s/rad", a.damper_limit));
  return std::make_shared<ActuatorModel>(a);
}

std::vector<double> actuator_start(const std::string& who, const Actuator& a, double link,
                                   double theta, double sigma) {
  a.elastic->require_inside(who, link, theta, sigma);
  std::vector<double> x(size_t(actuator_model(a)->description().nx), 0.0);
  x[0] = link;
  x[1] = theta;
  if (!a.elastic->traits().sigma.empty()) x[2] = sigma;
  return x;
}

void attach(phs::Network& n, const std::string& name, const std::string& joint_port,
            const Actuator& a) {
  n.add(name, actuator_model(a)).feedback(joint_port, name + ".link");
  act(n, name, joint_port, {name + ".theta"}, a);
}

void attach(phs::Network& n, const std::string& name, const std::string& joint_port,
            const std::string& rotor_port, const Actuator& a) {
  const Drive& d = a.theta;
  if (d.kind != Kind::torque || d.inertia != 0)
    refuse_actuator(
        fmt::format("'{}' has a rotor that is a body, expected theta driven by torque and "
                    "without an inertia, which is the body's",
                    name));
  Actuator spring = a;
  spring.theta.inertia = 1;
  (void)actuator_model(spring);  // checks all other numbers as without a body
  spring.theta = {.kind = Kind::rate};
  spring.damping = 0;
  n.add(name, actuator_model(spring)).feedback(joint_port, name + ".link");
  n.transformer(rotor_port, name + ".theta", 1 / d.gear);
  if (d.viscous > 0) n.resist(name + ".theta.viscous", rotor_port, phs::viscous(d.viscous));
  act(n, name, joint_port, {rotor_port, 1 / d.gear}, a);
}

}  // namespace porthos::vsa
