#include "energy_shaping/laws/handover.h"

#include <fmt/format.h>

#include <cmath>

#include "phs/error.h"

namespace porthos::energy_shaping {
namespace {

struct Two {
  std::string from, to;
  LevelSet basin;
  double leave;
  Progress of;
};

/// One side of a handover. Memory: which law acts, how often they have changed, when first, when
/// last; the least V so far. The energy of the first law is summed over windows of samples, each as
/// long as all before it.
class HandoverGate final : public phs::Gate {
  enum { acts, changes, first, last, least, all, limited, samples, sum, before, sum_before, count };
  static constexpr double the_first = 0, the_second = 1;  // values of m[acts]

 public:
  HandoverGate(std::shared_ptr<const Two> two, bool second)
      : two_(std::move(two)), second_(second) {}

  std::vector<double> fresh() const override {
    std::vector<double> m(count, 0.0);
    m[first] = m[last] = NAN;
    m[least] = HUGE_VAL;
    return m;
  }
  void renew(double t, std::span<const double> x, std::span<double> m) const override {
    const double V = two_->basin.V(x), level = two_->basin.level;
    m[least] = std::fmin(m[least], V);
    const bool was_second = m[acts] == the_second;
    if (!second_ && !was_second && two_->of.at) watch(x, m);
    const bool is_second = was_second ? !(V > two_->leave * level) : V < level;
    if (is_second == was_second) return;
    m[acts] = is_second ? the_second : the_first;
    if (m[changes] == 0) m[first] = t;
    m[changes] += 1;
    m[last] = t;
  }
  bool open(std::span<const double> m) const override { return (m[acts] == the_second) == second_; }
  /// Until the second law acts, also where it has given back. Told once, by the first law.
  bool waits(std::span<const double> m) const override { return !second_ && m[acts] == the_first; }
  std::string story(std::span<const double> m, double since) const override {
    const auto& [from, to, basin, leave, of] = *two_;
    if (second_) return "";
    if (m[changes] == 0)
      return fmt::format(
          "controller '{}' has not handed over to '{}': its V came down to {:.4g}, "
          "expected less than {:.4g}{}",
          from, to, m[least], basin.level, why(m));
    if (m[last] < since * (1 - 1e-12)) return "";
    if (m[changes] == 1)
      return fmt::format("controller '{}' handed over to '{}' at {:.10g} s", from, to, m[first]);
    return fmt::format(
        "controllers '{}' and '{}' handed over {:g} times, first at {:.10g} s, last at {:.10g} s; "
        "'{}' acts at the end{}",
        from, to, m[changes], m[first], m[last], m[acts] == the_second ? to : from,
        m[acts] == the_second ? "" : tried());
  }

 private:
  void watch(std::span<const double> x, std::span<double> m) const {
    const Progress::At now = two_->of.at(x);
    m[all] += 1;
    m[limited] += now.limited;
    m[samples] += 1;
    m[sum] += now.energy;
    if (2 * m[samples] < m[all]) return;
    m[before] = m[samples];
    m[sum_before] = m[sum];
    m[samples] = m[sum] = 0;
  }
  std::string tried() const {
    const auto& settings = two_->of.settings;
    const std::string found = settings ? settings(two_->basin, two_->leave) : "";
    return found.empty() ? found : ": " + found;
  }
  std::string why(std::span<const double> m) const {
    if (m[all] == 0)
      return fmt::format(": another bandwidth or damping of '{}', {}", two_->from,
                         higher_level(m[least]));
    const double settled = (m[sum] + m[sum_before]) / (m[samples] + m[before]),
                 share = m[limited] / m[all];
    const double rise = m[sum] / m[samples] - m[sum_before] / m[before];  // nan: too few samples
    const std::string cause =
        "; " + two_->of.cause(settled, share) +
        (rise > 0.1 * std::fabs(settled) ? "; it still rises, so a longer run may do" : "");
    const std::string found = tried();
    if (!found.empty()) return cause + found;
    return fmt::format("{}: {}, {}", cause, two_->of.remedy(settled, share),
                       higher_level(m[least]));
  }
  /// Whether a level that this motion would have reached would do.
  std::string higher_level(double reached) const {
    const LevelSet& basin = two_->basin;
    if (!basin.lost || !std::isfinite(reached)) return "or a higher level";
    const double level = std::stod(fmt::format("{:.2g}", 1.1 * reached));  // two digits
    const int lost = basin.lost(level);
    return lost <= LevelSet::most_lost
               ? fmt::format("or level = {:g}, from which '{}' loses {} of 100 runs", level,
                             two_->to, lost)
               : fmt::format("as from a level of {:g} '{}' loses {} of 100 runs", level, two_->to,
                             lost);
  }

  std::shared_ptr<const Two> two_;
  bool second_;
};

}  // namespace

Handover::Handover(std::string from, std::string to, LevelSet basin, double leave, Progress of) {
  if (!(basin.level > 0) || !std::isfinite(basin.level))
    throw InvalidArgument(
        fmt::format("'{}' hands over to '{}' where its V is below {:g}, expected a level above 0",
                    from, to, basin.level));
  if (!(leave > 1) || !std::isfinite(leave))
    throw InvalidArgument(
        fmt::format("'{}' takes back from '{}' at {:g} times the level, expected more than 1", from,
                    to, leave));
  const auto two = std::make_shared<const Two>(
      Two{std::move(from), std::move(to), std::move(basin), leave, std::move(of)});
  from_ = std::make_shared<const HandoverGate>(two, false);
  to_ = std::make_shared<const HandoverGate>(two, true);
}

}  // namespace porthos::energy_shaping
