#include "energy_shaping/laws/joint_swing_up.h"

#include <fmt/format.h>

#include <algorithm>
#include <random>

#include "energy_shaping/laws/detail/swing_law.h"
#include "energy_shaping/loop/closed_loop.h"
#include "phs/system/random_state.h"

namespace porthos::energy_shaping {
namespace {

void check_gains(const SwingUpGains& g) {
  const auto refuse = [](const char* name, double value, const char* expected) {
    throw InvalidArgument(
        fmt::format("the {} of a swing-up is {:g}, expected {}", name, value, expected));
  };
  if (!(g.pump >= 0)) refuse("pump", g.pump, "0 or more");
  if (!(g.margin.value_or(0) >= 0)) refuse("energy margin", *g.margin, "0 J or more");
  if (g.pump > 0 && (g.energy != 0 || g.inertia != 1))
    refuse("pump", g.pump, "0 with an energy and an inertia gain, or gains by a bandwidth");
  const bool chosen = g.energy == 0 && g.inertia > 0;
  if (!(g.energy > 0) && !chosen) refuse("energy gain", g.energy, "more than 0");
  if (!(g.limit > 0)) refuse("limit", g.limit, "more than 0");
  for (const auto& [name, gain] :
       {std::pair{"inertia", g.inertia}, {"stiffness", g.stiffness}, {"damping", g.damping}})
    if (!(gain >= 0)) refuse(name, gain, "0 or more");
  if (g.inertia == 0 && g.stiffness > 0) refuse("stiffness", g.stiffness, "0 without an inertia");
  if (g.inertia == 0 && g.damping > 0) refuse("damping", g.damping, "0 without an inertia");
  if (g.inertia > 0 && g.damping == 0) refuse("damping", 0, "more than 0 with an inertia");
}

}  // namespace

JointSwingUp::JointSwingUp(std::shared_ptr<const mechanics::MechanicalModel> plant,
                           const std::string& actuator, std::vector<double> upright,
                           const SwingUpGains& gains)
    : actuator_(actuator), upright_(upright), data_(std::make_shared<Data>()) {
  const auto& d = plant->description();
  const auto& m = plant->mechanism();
  phs::refuse_constraints(d, "a swing-up");
  for (const auto& c : m.coordinates())
    if (c.nq != 1)
      throw InvalidArgument("a swing-up takes joints of one degree of freedom; '" + c.joint +
                            "' has several");
  require_size("upright", upright.size(), size_t(m.nq()));
  check_gains(gains);
  data_->plant = plant;
  data_->joint = size_t(port_offsets(d, {actuator})[0]);
  data_->target = upright[data_->joint];
  data_->gains = gains;
  if (gains.energy == 0 && gains.stiffness > 0)
    data_->damping_ratio = gains.damping / (2 * std::sqrt(gains.stiffness));
  for (const auto& j : m.joint_properties())
    if (size_t(j.v) != data_->joint) data_->friction += j.damping;
  certificate_ = Certificate("swing-up of '" + d.name + "' by " + actuator);
  upright.resize(2 * upright.size(), 0.0);
  data_->wanted = plant->instantiate<double>()->hamiltonian(upright);
  certificate_.report("wanted energy", data_->wanted, "E* of the upright [J]");
  look_for_the_lowest(upright);
  choose_margin(upright);
  if (gains.pump > 0) {
    check_pump(upright);
  } else {
    if (gains.inertia > 0) check_denominator(upright);
    check_descent(upright);
  }
  if (data_->friction > 0)
    certificate_.report("friction without actuator", data_->friction,
                        gains.pump > 0 ? "sum of damping: the pump pays for it"
                                       : "sum of damping: V can rise by its power where E < E*; "
                                         "a pump pays for it");
  refuse_failure(certificate_);
}

/// k_D against the supremum of k_E (E* - V(q))/m(q): random points, the best refined.
void JointSwingUp::check_denominator(const std::vector<double>& upright) {
  const size_t n = upright.size() / 2;
  SwingPlant<double> plant(data_);
  const auto needed = [&](const std::vector<double>& x) {
    plant.look(x);
    return (data_->wanted - plant.energy) / plant.mobility;
  };
  SwingPositions positions(*data_, upright);
  auto worst = upright, x = upright;
  double most = needed(worst);
  const auto take = [&] {
    const double value = needed(x);
    if (value <= most) return false;
    most = value;
    worst = x;
    return true;
  };
  for (int i = 0; i < 4000; ++i) {
    positions.draw(x);
    take();
  }
  for (double size = 0.1; size > 1e-9;) {
    bool better = false;
    for (size_t k = 0; k < n; ++k)
      for (const double way : {size, -size}) {
        x = worst;
        x[k] += way;
        better = take() || better;
      }
    if (!better) size /= 2;
  }
  worst.resize(n);
  SwingUpGains& gains = data_->gains;
  if (gains.energy == 0) {
    gains.energy = 0.9 * gains.inertia / most;
    certificate_.report("energy gain", gains.energy,
                        "0.9 of the largest that the inertia gain allows [s²/(kg m²)²]");
  }
  certificate_.at_least("inertia gain", gains.inertia, gains.energy * most * (1 + 1e-9),
                        "k_D > sup k_E (E* - V)/m: 4000 positions, the worst refined; slides "
                        "within 1 m",
                        worst);
}

/// The plant under the law, without its limit, loses V as the formula says.
void JointSwingUp::check_descent(const std::vector<double>& upright) {
  const auto& plant = *data_->plant;
  const auto& d = plant.description();
  const size_t n = upright.size() / 2, joint = data_->joint;
  auto unlimited = std::make_shared<Data>(*data_);
  unlimited->gains.limit = HUGE_VAL;
  auto law = SwingLaw{unlimited}.evaluator<double>();
  const auto f = plant.instantiate<double>();
  const auto gradient = plant.instantiate<phs::Dual>();
  std::vector<double> u(size_t(d.nu)), dx(2 * n), e(2 * n);
  std::vector<phs::Dual> s(2 * n), rates(2 * n);
  std::mt19937_64 generator(2);
  const SwingUpGains& k = data_->gains;
  SumsOfZero sums;
  for (int i = 0; i < 500; ++i) {
    const auto x = phs::random_state(d, 1.0, generator);
    law(0.0, std::span<const double>(x), std::span<double>(u));
    f->field(0.0, x, u, dx);
    f->gradient(x, e);
    for (size_t j = 0; j < 2 * n; ++j) s[j] = phs::Dual(x[j], dx[j]);
    gradient->gradient(s, rates);
    double E1 = 0, friction = 0;
    for (size_t j = 0; j < 2 * n; ++j) E1 += e[j] * dx[j];
    for (const auto& j : plant.mechanism().joint_properties())
      if (size_t(j.v) != joint) friction += j.damping * e[n + size_t(j.v)] * e[n + size_t(j.v)];
    const double off = f->hamiltonian(x) - data_->wanted, rate = e[n + joint];
    const double weight = k.inertia > 0 ? k.energy : 1;
    sums.add({weight * off * E1, k.inertia * rate * rates[n + joint].d,
              k.stiffness * rate * (x[joint] - data_->target),
              k.inertia > 0 ? k.damping * rate * rate : k.energy * off * off * rate * rate,
              weight * off * friction},
             x);
  }
  const auto worst = sums.worst();
  certificate_.at_most("V' = -k_V q'² - friction", worst.value, 1e-8,
                       "of the plant under the law without a limit, at 500 states, relative",
                       worst.where);
}

PortLaw JointSwingUp::port_law() const {
  return port_laws(SwingLaw{data_}, data_->plant->description(), {int(data_->joint)})[0];
}

void JointSwingUp::check_start(const std::vector<double>& x) const {
  std::vector<double> u(size_t(data_->plant->description().nu)), dx(x.size());
  SwingLaw{data_}.evaluator<double>()(0.0, std::span<const double>(x), std::span<double>(u));
  data_->plant->instantiate<double>()->field(0.0, x, u, dx);
  // the energy to gain, over a radian, measures the torques that are not rounding
  const auto n = long(dx.size() / 2);
  const double torque =
      1e-9 * std::fabs(data_->plant->instantiate<double>()->hamiltonian(x) - data_->wanted);
  if (std::all_of(dx.begin(), dx.begin() + n, [](double rate) { return rate == 0; }) &&
      std::all_of(dx.begin() + n, dx.end(),
                  [torque](double rate) { return std::fabs(rate) <= torque; }))
    throw InvalidArgument(
        "the start is a rest point of plant and law, which stay there for ever, expected a start "
        "beside it, for example 0.01 rad");
}

}  // namespace porthos::energy_shaping
