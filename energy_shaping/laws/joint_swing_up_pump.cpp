#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <mutex>

#include "energy_shaping/laws/detail/swing_law.h"
#include "energy_shaping/laws/detail/swing_up_trials.h"
#include "phs/system/random_state.h"

/// The margin and the pump of a swing-up, and what a run is told of it.
namespace porthos::energy_shaping {
namespace {

/// The mechanism's energy as the law counts it, and whether the law is at its limit.
struct SwingWatch {
  SwingData data;

  template <class T>
  auto evaluator() const {
    return [d = data, plant = SwingPlant<T>(data)](T, std::span<const T> x,
                                                   std::span<T> seen) mutable {
      plant.look(x);
      seen[0] = d->gains.pump > 0 ? plant.others : plant.energy;
      seen[1] = phs::abs(swing_torque(*d, plant, x));
    };
  }
};

/// Sums over states with the driven joint at rest and the energy E*, each weighted by the time that
/// a motion spends there, 1/√T.
struct FallSums {
  double h = 0, square = 0, friction = 0;  ///< of |h|, h² and the power of friction
};

FallSums sums_of_falls(const SwingData& data, const std::vector<double>& upright, double wanted) {
  const auto& model = *data->plant;
  const size_t n = upright.size() / 2;
  auto with_pump = std::make_shared<JointSwingUp::Data>(*data);
  with_pump->gains.pump = 1;  // for the plant to see h
  SwingPlant<double> plant(with_pump);
  SwingPositions positions(*data, upright);
  auto x = upright;
  std::vector<double> v(n);
  FallSums sums;
  for (int i = 0; i < 4000; ++i) {
    std::fill(x.begin() + long(n), x.end(), 0.0);
    positions.draw(x);
    plant.look(x);
    const double kinetic = wanted - plant.energy;
    for (size_t k = 0; k < n; ++k) v[k] = k == data->joint ? 0 : positions.uniform();
    if (!(kinetic > 0)) continue;
    const auto scaled = [&](double factor) {
      for (double& rate : v) rate *= factor;
      return model.state(std::span(x).first(n), v);
    };
    plant.look(scaled(1));
    const double of_unit = plant.energy - (wanted - kinetic);
    plant.look(scaled(std::sqrt(kinetic / of_unit)));
    const double weight = 1 / std::sqrt(kinetic);
    sums.h += weight * std::fabs(plant.coupling);
    sums.square += weight * plant.coupling * plant.coupling;
    for (const auto& j : model.mechanism().joint_properties())
      if (size_t(j.v) != data->joint)
        sums.friction += weight * j.damping * v[size_t(j.v)] * v[size_t(j.v)];
  }
  return sums;
}

}  // namespace

void JointSwingUp::look_for_the_lowest(const std::vector<double>& upright) {
  SwingPlant<double> plant(data_);
  SwingPositions positions(*data_, upright);
  auto x = upright;
  for (int i = 0; i < 4000; ++i) {
    positions.draw(x);
    plant.look(x);
    const double depth = data_->wanted - plant.energy;
    if (depth <= data_->depth) continue;
    data_->depth = depth;
    const double h_over_v = plant.inertia - 1 / plant.mobility;  // M_ao M_oo⁻¹ M_oa
    data_->soft = 0.1 * depth * std::sqrt(2 * depth * std::fmax(h_over_v, 0));
  }
  if (data_->gains.pump == 0) return;
  if (!(data_->depth > 0))
    throw InvalidArgument("the upright of a swing-up is the lowest place, expected a higher one");
  if (!(data_->soft > 0))
    throw InvalidArgument("the driven joint of a swing-up does not couple to the others");
}

void JointSwingUp::choose_margin(const std::vector<double>& upright) {
  const SwingUpGains& g = data_->gains;
  const bool needed = g.pump > 0 || data_->friction > 0;
  const FallSums sums = needed ? sums_of_falls(data_, upright, data_->wanted) : FallSums{};
  if (g.limit < HUGE_VAL) {
    SwingPlant<double> plant(data_);
    plant.look(upright);
    const double most = g.limit * plant.mobility,
                 against = sums.h > 0 ? 10 * sums.friction / sums.h : 0;
    data_->first_pump = std::stod(fmt::format("{:.2g}", std::clamp(against, most / 20, most / 2)));
    certificate_.report("acceleration by the limit", most,
                        fmt::format("limit (M⁻¹)_aa at the upright [rad/s² | m/s²]: begin with a "
                                    "pump of {:g}",
                                    data_->first_pump));
  }
  const char* text = "aimed at above E*; without friction E settles there, not at E* [J]";
  data_->margin = g.margin.value_or(0);
  if (g.pump > 0) {
    if (data_->friction > 0)
      certificate_.at_least("pump over friction", g.pump * sums.h / sums.friction, 1,
                            "largest power of the pump over that of friction, means of 4000 states "
                            "with E*");
    if (!g.margin) {
      // five: the driven joint's way back and its motion take a part of what the pump gives
      data_->margin = 5 * data_->soft * sums.friction / (g.pump * sums.square);
      text =
          "aimed at above E*: five times that at which the pump pays for the model's friction "
          "in the mean [J]";
    }
  }
  if (data_->margin > 0) certificate_.report("energy margin", data_->margin, text);
  data_->wanted += data_->margin;
}

/// The plant under the pump, without its limit, moves as it says.
void JointSwingUp::check_pump(const std::vector<double>& upright) {
  const auto& model = *data_->plant;
  const auto& d = model.description();
  const size_t n = upright.size() / 2, joint = data_->joint;
  auto unlimited = std::make_shared<Data>(*data_);
  unlimited->gains.limit = HUGE_VAL;
  auto law = SwingLaw{unlimited}.evaluator<double>();
  SwingPlant<double> plant(unlimited);
  SwingPlant<phs::Dual> moving(unlimited);
  const auto f = model.instantiate<double>();
  std::vector<double> u(size_t(d.nu)), dx(2 * n), v(n);
  std::vector<phs::Dual> s(2 * n);
  std::mt19937_64 generator(2);
  SumsOfZero of_joint, of_others;
  for (int i = 0; i < 500; ++i) {
    auto x = phs::random_state(d, 1.0, generator);
    std::copy_n(x.begin() + long(n), n, v.begin());  // as rates
    v[joint] = 0;
    x = model.state(std::span<const double>(x).first(n), v);
    law(0.0, std::span<const double>(x), std::span<double>(u));
    f->field(0.0, x, u, dx);
    for (size_t j = 0; j < 2 * n; ++j) s[j] = phs::Dual(x[j], dx[j]);
    moving.look(s);
    plant.look(x);
    double friction = 0;
    for (const auto& j : model.mechanism().joint_properties())
      if (size_t(j.v) != joint) friction += j.damping * v[size_t(j.v)] * v[size_t(j.v)];
    const double w = pumped<double>(*unlimited, plant, x);
    of_joint.add({moving.rate.d, -w}, x);
    of_others.add({moving.others.d, plant.coupling * w, friction}, x);
  }
  const auto one = of_joint.worst(), other = of_others.worst();
  const auto& worst = one.value > other.value ? one : other;
  certificate_.at_most("E' = -h w - friction", worst.value, 1e-8,
                       "of the other joints under the pump without a limit, at 500 states with the "
                       "driven joint at rest, relative; that E arrives is not proved",
                       worst.where);
}

Progress JointSwingUp::progress(const std::optional<SwingUpRun>& run) const {
  const auto watch = std::make_shared<const SharedLaw<SwingWatch>>(SwingWatch{data_}, 2);
  const auto at = [watch, d = data_](std::span<const double> x) {
    std::array<double, 2> seen{};
    (*watch)(0.0, x.first(size_t(d->plant->description().nx)), 0, std::span<double>(seen));
    return Progress::At{seen[0], seen[1] >= d->gains.limit};
  };
  const auto cause = [d = data_](double settled, double limited) {
    std::string text =
        fmt::format("its energy was {:.4g} J in the mean of the last half, {:.4g} J of the upright",
                    settled, d->wanted - d->margin);
    if (d->margin > 0) text += fmt::format(" and an energy_margin of {:.3g} J", d->margin);
    text += " wanted";
    if (d->friction > 0)
      text += fmt::format("; friction without actuator is {:g} N m s/rad", d->friction);
    if (limited > 0)
      text += fmt::format("; its limit acted at {:.2g} % of the samples", 100 * limited);
    return text;
  };
  const auto remedy = [d = data_](double settled, double limited) -> std::string {
    const double missing = d->wanted - d->margin - settled;
    if (limited > 0.5) return "a larger limit";
    const bool pumps = d->gains.pump > 0;
    if (missing > 0.02 * d->depth && !pumps)
      return (d->first_pump > 0 ? fmt::format("pump = {:g} and bandwidth = 1", d->first_pump)
                                : "pump and bandwidth") +
             " in place of its gains";
    if (missing > 0.02 * d->depth && d->friction > 0)
      return fmt::format("energy_margin = {:.2g}", d->margin + missing);
    if (missing > 0.02 * d->depth) return "a larger pump or energy_margin, or a higher rate";
    if (missing < -0.1 * d->depth && d->margin > 0) return "a smaller energy_margin";
    if (missing < -0.1 * d->depth && pumps) return "a smaller pump";
    return pumps ? "another pump or bandwidth" : "another bandwidth or damping";
  };
  if (!run) return {at, cause, remedy};
  struct Once {
    std::once_flag flag;
    std::string words;
  };
  return {
      at, cause, remedy,
      [*this, own = *run, once = std::make_shared<Once>()](const LevelSet& basin, double leave) {
        std::call_once(once->flag, [&] {
          once->words = SwingUpTrials(data_, actuator_, upright_, own, basin, leave).words();
        });
        return once->words;
      }};
}

}  // namespace porthos::energy_shaping
