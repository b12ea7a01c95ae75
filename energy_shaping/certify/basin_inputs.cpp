#include "energy_shaping/certify/detail/basin_inputs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "energy_shaping/certify/detail/certify_runs.h"
#include "energy_shaping/certify/detail/region.h"

namespace porthos::energy_shaping {
namespace {

using Vec = std::vector<double>;

/// Where limits act: the least H_d - H_d(rest) at which an input asks for more, among states on
/// straight ways from the rest point.
class LimitReached {
 public:
  LimitReached(const ClosedLoop& loop, const Vec& limits)
      : loop_(loop),
        limits_(limits),
        law_(loop.loop<double>()),
        u_(size_t(loop.plant().description().nu)),
        x_(loop.rest()),
        rest_(law_->hamiltonian(x_)) {}
  void along(const Vec& end) {
    for (int i = 1; i <= 20; ++i) {
      for (size_t k = 0; k < x_.size(); ++k)
        x_[k] = loop_.rest()[k] + i / 20.0 * (end[k] - loop_.rest()[k]);
      law_->law(0.0, x_, u_);
      for (size_t j = 0; j < limits_.size(); ++j)
        if (std::fabs(u_[size_t(loop_.actuated()[j])]) > limits_[j]) {
          least_ = std::min(least_, law_->hamiltonian(x_) - rest_);
          return;
        }
    }
  }
  double level() const { return rest_ + least_; }  ///< H_d, infinite where none was reached
  std::string text(double depth) const {
    if (limits_.empty()) return "";
    return least_ < depth ? fmt::format(
                                "; of the states sampled it acts from c - H_d(rest) = {:.3g} up, "
                                "of others from less",
                                least_)
                          : "; it does not act below c";
  }

 private:
  const ClosedLoop& loop_;
  const Vec& limits_;
  std::unique_ptr<LoopSystem<double>> law_;
  Vec u_, x_;
  double rest_, least_ = HUGE_VAL;
};

/// The states of H_d = c on straight ways from the rest point, of a loop without quaternions. The
/// unit of a way in each coordinate and momentum is what by itself reaches c or the border.
class LevelWays {
 public:
  LevelWays(const ClosedLoop& loop, const Region& region, const Basin& basin)
      : rest_(loop.rest()),
        region_(region),
        level_(basin.level),
        law_(loop.loop<double>()),
        n_(region.lower.size()),
        x_(rest_),
        unit_(2 * n_, 1.0) {
    Vec way(2 * n_, 0.0);
    for (size_t i = 0; i < way.size(); ++i) {
      if (i < n_) unit_[i] = region_.upper[i] - region_.lower[i];
      if (i >= n_) {  // T = c - H_d(rest), if T is quadratic
        x_ = rest_;
        x_[i] += 1;
        const double T = law_->hamiltonian(x_) - (level_ - basin.depth);
        if (T > 0 && T < HUGE_VAL) unit_[i] = std::sqrt(basin.depth / T);
      }
      way[i] = 1;
      const double far = edge(way, true);
      if (far > 0) unit_[i] *= far;
      way[i] = 0;
    }
  }
  Vec any(std::mt19937_64& generator) const { return near(Vec(2 * n_, 0.0), 1, generator); }
  /// A way near another, by a part `size` of its length.
  Vec near(Vec way, double size, std::mt19937_64& generator) const {
    std::normal_distribution<double> normal(0, size / std::sqrt(double(way.size())));
    double square = 0;
    for (double& w : way) {
      w += normal(generator);
      square += w * w;
    }
    for (double& w : way) w /= std::sqrt(square);
    return way;
  }
  /// @return whether there is a state on the way, within the region
  bool state(const Vec& way, Vec& x) {
    const double far = edge(way, false);
    go(way, far);
    x = x_;
    return far > 0;
  }

 private:
  void go(const Vec& way, double part) {
    for (size_t i = 0; i < way.size(); ++i) x_[i] = rest_[i] + part * unit_[i] * way[i];
  }
  /// How far H_d stays below c; 0 where the way leaves the region before, or how far it goes there.
  double edge(const Vec& way, bool to_border) {
    double border = HUGE_VAL;
    for (size_t i = 0; i < n_; ++i)
      if (way[i] != 0)
        border = std::min(border, ((way[i] > 0 ? region_.upper[i] : region_.lower[i]) - rest_[i]) /
                                      (unit_[i] * way[i]));
    constexpr double part = 1.0 / 16;
    double low = 0, high = part;
    const auto below = [&](double here) {
      go(way, here);
      return law_->hamiltonian(x_) < level_;
    };
    for (; high < border && high < 4 && below(high); high += part) low = high;
    if (high >= border && below(border)) return to_border ? border : 0;
    if (high >= 4) return 0;
    high = std::min(high, border);
    for (int k = 0; k < 40; ++k) {
      const double middle = 0.5 * (low + high);
      (below(middle) ? low : high) = middle;
    }
    return low;
  }

  const Vec& rest_;
  const Region& region_;
  double level_;
  std::unique_ptr<LoopSystem<double>> law_;
  size_t n_;
  Vec x_, unit_;
};

/// The largest of each input found so far.
struct LargestInput {
  double size = 0;
  Vec way = {}, x = {};
};

}  // namespace

double inputs_on_basin(const ClosedLoop& loop, const Region& region, const Basin& basin,
                       const Vec& limits, Certificate& c) {
  const auto law = loop.loop<double>();
  std::mt19937_64 generator(region.seed + 2);
  LevelWays set(loop, region, basin);
  LimitReached reached(loop, limits);
  Vec u(size_t(loop.plant().description().nu)), x;
  std::vector<LargestInput> peaks(loop.actuated().size());
  int states = 0;
  const auto look = [&](const Vec& way) {
    if (!set.state(way, x)) return false;
    ++states;
    law->law(0.0, x, u);
    bool larger = false;
    for (size_t j = 0; j < peaks.size(); ++j) {
      const double size = std::fabs(u[size_t(loop.actuated()[j])]);
      if (!(size > peaks[j].size)) continue;
      peaks[j] = {size, way, x};
      larger = true;
    }
    if (!limits.empty()) reached.along(x);
    return larger;
  };
  const int samples = std::max(region.samples, 1000);
  for (int i = 0; i < samples; ++i) look(set.any(generator));
  const int sampled = states;
  for (size_t j = 0; j < peaks.size(); ++j) {
    double size = 0.3;
    for (int k = 0; k < 1000 && peaks[j].size > 0; ++k)
      size = look(set.near(peaks[j].way, size, generator)) ? std::min(0.3, 1.5 * size)
                                                           : std::max(1e-4, 0.96 * size);
  }
  Vec sizes;
  const LargestInput* most = nullptr;
  for (const LargestInput& each : peaks) {
    sizes.push_back(each.size);
    if (!most || each.size > most->size) most = &each;
  }
  const std::string share = share_of_limits(sizes, limits);
  c.report("input on the basin", most ? most->size : 0,
           fmt::format("largest |u| on H_d = c, climbed to from {} states{}{}", sampled,
                       share.empty() ? "" : "; ", share) +
               reached.text(basin.depth),
           {}, most ? most->x : Vec{});
  return reached.level();
}

}  // namespace porthos::energy_shaping
