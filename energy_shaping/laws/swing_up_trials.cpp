#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "energy_shaping/laws/detail/swing_up_trials.h"
#include "energy_shaping/loop/runge_kutta.h"

namespace porthos::energy_shaping {
namespace {

constexpr double most_work = 2e6;                    // about 3 s, of a pendulum on an arm
constexpr int few_lost = LevelSet::most_lost / 4;    // a level of which hardly any are lost
constexpr double margins[] = {0, 0.1, 0.2, 0.4};     // added to the law's own, over the depth
constexpr double pump_factors[] = {1, 2, 4, 8, 14};  // of the certificate's, a twentieth

double two_digits(double x) { return std::stod(fmt::format("{:.2g}", x)); }

/// One of two sampled laws holds the inputs of a plant.
struct TriedPlant {
  explicit TriedPlant(const mechanics::MechanicalModel& m)
      : model(m), system(m.instantiate<double>()), u(size_t(m.description().nu)) {}
  void hold(const std::vector<PortLaw>& laws, double t, std::span<const double> x) {
    std::fill(u.begin(), u.end(), 0.0);
    for (const PortLaw& law : laws) {
      const auto& port = find_named(model.description().ports, law.port, "there is no port");
      (*law.law)(t, x, {}, std::span(u).subspan(size_t(port.at), size_t(port.size)));
    }
  }
  const mechanics::MechanicalModel& model;
  std::unique_ptr<phs::System<double>> system;
  std::vector<double> u;
};

}  // namespace

SwingUpTrials::Tried SwingUpTrials::outcome(const Settings& s, const Change& change) {
  auto gains = SwingUpGains::of_bandwidth(s.bandwidth, of_->damping_ratio);
  gains.pump = s.pump;
  gains.margin = s.margin;
  gains.limit = change.limits * of_->gains.limit;
  std::vector<PortLaw> first;
  try {
    first = {JointSwingUp(of_->plant, actuator_, upright_, gains).port_law()};
  } catch (const InvalidArgument&) {
    return {};  // too weak against friction
  }
  TriedPlant plant(*of_->plant);
  auto x = run_.start;
  for (size_t k = 0; k < upright_.size(); ++k) x[k] += change.start;
  RungeKutta<double> kutta(x.size());
  const double period = run_.period / change.faster, duration = change.longer * run_.duration,
               parts = std::ceil(period / run_.step * (1 - 1e-9)), h = period / parts;
  work_ += duration / period * (1 + parts);
  Tried tried;
  bool second = false, within = false;
  for (double t = 0; t < duration * (1 - 1e-9); t += period) {
    const double V = basin_.V(x);
    if (!std::isfinite(V)) return {};
    within = V < s.level;
    second = second ? !(V > leave_ * s.level) : within;
    if (second) tried.at = std::fmin(tried.at, t);
    plant.hold(second ? basin_.laws : first, t, x);
    for (int i = 0; i < int(parts); ++i)
      kutta.step(h, x, [&](const auto& y, auto& dx) { plant.system->field(t, y, plant.u, dx); });
  }
  tried.stays = second && within;
  return tried;
}

/// Also from starts beside, since a motion that just meets the level meets it by chance.
bool SwingUpTrials::works(const Settings& s, double& at) {
  const Tried one = outcome(s, {});
  at = one.at;
  return one.stays && at < 0.9 * run_.duration && outcome(s, {.start = 1e-3}).stays &&
         outcome(s, {.start = -1e-3}).stays;
}

/// 1 does for most plants; that of a pump which is stated comes before it, that of gains after it.
std::vector<double> SwingUpTrials::bandwidths() const {
  const double own = of_->gains.energy == 0 ? std::sqrt(of_->gains.stiffness) : 1;
  if (own == 1 || own == 0) return {1};
  return of_->gains.pump > 0 ? std::vector{own, 1.0} : std::vector{1.0, own};
}

/// The law's own first.
std::vector<double> SwingUpTrials::pumps() const {
  const double own = of_->gains.pump, least = of_->first_pump > 0 ? of_->first_pump : own / 4;
  std::vector<double> all;
  if (own > 0) all.push_back(own);
  for (const double factor : pump_factors)
    if (const double pump = two_digits(factor * least); pump > 0 && pump != own)
      all.push_back(pump);
  return all;
}

/// The largest of which few runs are lost, then that of the run and a lower one. A level costs up
/// to a second, so it is found by halving: what a level loses a higher one loses too.
std::vector<double> SwingUpTrials::levels() const {
  const double own = basin_.level;
  const auto at = [&](int k) { return two_digits(own * std::pow(1.5, k)); };
  int low = 0, high = basin_.lost ? 18 : 1;
  while (high - low > 1) {
    const int middle = (low + high) / 2;
    (basin_.lost(at(middle)) > few_lost ? high : low) = middle;
  }
  const double most = low > 0 ? at(low) : own;
  std::vector<double> all{own, two_digits(own / 4)};
  if (most > own) all.insert(all.begin(), most);
  return all;
}

std::vector<SwingUpTrials::Settings> SwingUpTrials::all_settings(
    const std::vector<double>& at_bandwidths, const std::vector<double>& at_levels) const {
  std::vector<Settings> all;
  for (const double bandwidth : at_bandwidths)
    for (const double level : at_levels)
      for (const double more : margins)
        for (const double pump : pumps()) {
          all.push_back({bandwidth, pump, {}, level});
          if (more > 0) all.back().margin = two_digits(of_->margin + more * of_->depth);
        }
  return all;
}

std::string SwingUpTrials::named(const Settings& s) const {
  std::string text = fmt::format("pump = {:g}, bandwidth = {:g}", s.pump, s.bandwidth);
  if (s.margin) text += fmt::format(", energy_margin = {:g}", *s.margin);
  if (s.level != basin_.level) text += fmt::format(", level = {:g}", s.level);
  return of_->gains.pump > 0 ? text : text + " in place of its gains";
}

std::string SwingUpTrials::words() {
  if (basin_.laws.empty() || pumps().empty()) return "";
  const auto at_levels = levels();
  size_t tried = 0;
  for (const double bandwidth : bandwidths()) {
    work_ = 0;
    for (const Settings& s : all_settings({bandwidth}, at_levels)) {
      if (work_ > most_work) break;
      ++tried;
      if (double at = 0; works(s, at))
        return fmt::format("in runs of the mechanism alone {} hands over at {:.2g} s", named(s),
                           at);
    }
  }
  return of_none(tried, at_levels.front());
}

/// Whether more time, a higher rate, a larger limit or another start would do.
std::string SwingUpTrials::of_none(size_t tried, double level) {
  const auto at_bandwidths = bandwidths();
  const auto at_pumps = pumps();
  const auto [least, most] = std::ranges::minmax(at_pumps);
  const std::string none = fmt::format(
      "in runs of the mechanism alone none of {} settings of pump ({:g} to {:g}), energy_margin "
      "and level hands over and holds with bandwidth = {:g}, the only {} tried",
      tried, least, most, fmt::join(at_bandwidths, " or "),
      at_bandwidths.size() > 1 ? "ones" : "one");
  struct Help {
    const char* words;
    Change change;
  };
  const Help all[] = {{"in three times the duration", {.longer = 3}},
                      {"at four times the rate", {.faster = 4}},
                      {"with three times the pump's limit", {.limits = 3}},
                      {"from 0.3 rad (m) more of each coordinate", {.start = 0.3}},
                      {"from 0.3 rad (m) less of each coordinate", {.start = -0.3}}};
  std::string tried_too;
  for (const Help& help : all) {
    if (help.change.limits > 1 && of_->gains.limit == HUGE_VAL) continue;
    work_ = 0;
    for (const Settings& s : all_settings(at_bandwidths, {level}))
      if (work_ > most_work)
        break;
      else if (outcome(s, help.change).at < HUGE_VAL)
        return fmt::format("{}; {} {} reaches the level", none, help.words, named(s));
    add_to_list(tried_too, help.words);
  }
  return fmt::format("{}, nor {}", none, tried_too) +
         (of_->friction > 0 ? ": friction may take the energy" : "");
}

}  // namespace porthos::energy_shaping
