#pragma once
#include <vector>

#include "integrators/control/switching.h"
#include "integrators/control/zero-inl.h"

namespace porthos::integrators {

/// Where in a part of a step a switch passes 0, by its values at samples of the dense output.
class SwitchSearch {
 public:
  using State = phs::State;
  struct Point {
    double at = 0, g = 0;
  };
  struct Found {
    size_t index = 0;
    Point a, b;
    /// It leaves 0 at the start of the part: the zero of g/at is its return.
    bool returns = false;
  };

  /// method: the one whose steps are searched
  SwitchSearch(std::unique_ptr<Switches> all, const Integrator& method, const SwitchOptions& how,
               const phs::Description& d)
      : switches(std::move(all)),
        now(switches->count()),
        sign(now.size()),
        samples(size_t(how.samples) + 2, now),
        method_(method),
        x_(size_t(d.nx)),
        inside_(x_.size()),
        angles_(size_t(d.angle_count())),
        rate_(now),
        rate_at_peak_(now),
        sample_rates_(samples) {
    peaks_.reserve(now.size() * samples.size());
    for (size_t k = 0; k < now.size(); ++k) jumps = jumps || switches->jumps(k);
  }
  int last() const { return int(samples.size()) - 1; }

  void values(double t, std::span<const double> x, std::span<const double> lo,
              const std::vector<std::int64_t>& turns, std::vector<double>& g) {
    for (size_t i = 0; i < x_.size(); ++i) x_[i] = lo.empty() ? x[i] : x[i] + lo[i];
    for (size_t k = 0; k < angles_.size(); ++k) angles_[k] = phs::two_pi_hi * double(turns[k]);
    switches->at(t, x_, angles_, g);
  }
  void begin_part(const State& s, double t) {
    values(t, s.x, s.lo, s.turns, now);
    if (jumps) switches->rates(x_, angles_, rate_);
  }
  /// Values at the sample points of a part that began at t and ended at `after`; those without
  /// dense output are NaN.
  void sample(const State& start, const State& after, double t, double rest) {
    const int last = this->last();
    values(t, start.x, start.lo, start.turns, samples[0]);
    values(t + rest, after.x, after.lo, after.turns, samples[size_t(last)]);
    for (int i = 1; i < last; ++i) {
      auto& g = samples[size_t(i)];
      if (method_.interpolate(after, double(i) / last, inside_))
        values(t + rest * i / last, inside_, {}, after.turns, g);
      else
        std::fill(g.begin(), g.end(), NAN);
    }
    if (jumps) sample_peaks(after, t, rest);
  }
  /// Between two samples of the same sign a value that jumps may come to 0 and go back: where its
  /// rate changes from rising to falling, the second sample is moved to its peak.
  void sample_peaks(const State& after, double t, double rest) {
    peaks_.clear();
    const int last = this->last();
    const auto rates_at = [&](double at, std::vector<double>& rate) {
      if (!method_.interpolate(after, at, inside_)) return false;
      values(t + at * rest, inside_, {}, after.turns, now);
      switches->rates(x_, angles_, rate);
      return true;
    };
    for (int i = 0; i <= last; ++i)
      if (!rates_at(double(i) / last, sample_rates_[size_t(i)])) return;
    for (size_t k = 0; k < now.size(); ++k)
      for (int i = 1; i <= last; ++i) {
        const double rises = sample_rates_[size_t(i) - 1][k] * rest,
                     falls = sample_rates_[size_t(i)][k] * rest;
        if (!switches->jumps(k) || !(rises > 0 && falls < 0) || !(samples[size_t(i)][k] < 0))
          continue;
        Point a{double(i - 1) / last, rises}, b{double(i) / last, falls};
        const double at = guess_zero(a, b, [&](double x) {
          return rates_at(x, rate_at_peak_) ? rate_at_peak_[k] * rest : double(NAN);
        });
        if (!(at > a.at && at < b.at) || !rates_at(at, rate_at_peak_) || !(now[k] > 0)) continue;
        peaks_.push_back({k, i, {at, now[k]}});
      }
  }
  /// Whether a switch that jumps begins the part at 0, up to its rounding, and turns away from it.
  bool leaves(size_t k, double rest) const {
    const double fall = rate_[k] * rest;
    return switches->jumps(k) && fall < 0 && std::fabs(samples[0][k]) <= -1e-6 * fall;
  }
  /// The earliest interval between samples in which a switch passes 0, of the one that does so
  /// first by the secants; false if none does. Those that rest where the part begins come last:
  /// across the kink of another the dense output swings about 0. To leave 0 is no passing.
  bool earliest(const State& start, const State& after, double t, double rest, Found& found) {
    sample(start, after, t, rest);
    const int last = this->last();
    double first = HUGE_VAL;
    bool from_rest = false;
    for (size_t k = 0; k < now.size(); ++k) {
      Point a{0, samples[0][k]};
      const bool rested = rests(k, a.g);
      if (rested) sign[k] = 0;
      if (sign_of(a.g) != sign[k]) a.g = 0;  // it has just passed 0 here
      for (int i = 1; i <= last; ++i) {
        Point b{double(i) / last, samples[size_t(i)][k]};
        for (const Peak& peak : peaks_)
          if (peak.index == k && peak.before == i) b = peak.point;
        if (std::isnan(b.g)) continue;
        if (rests(k, b.g)) b.g = 0;
        if (sign[k] == 0) sign[k] = sign_of(b.g);
        if (sign_of(b.g) == sign[k] || b.g == 0) {
          a = b;
          continue;
        }
        const bool returns = a.at == 0 && leaves(k, rest);
        if (returns) {
          a.g = rate_[k] * rest;
          b.g /= b.at;
        }
        const double at = a.g == 0 ? a.at : secant(a, b);
        if (first == HUGE_VAL || (rested == from_rest ? at < first : from_rest)) {
          first = at;
          from_rest = rested;
          found = {k, a, b, returns};
        }
        break;
      }
    }
    return first < HUGE_VAL;
  }
  /// A switch other than `found` that has passed 0 within a part that ends at `at`; false if none
  /// has. The dense output of a step across a kink swings: it hides some zeros and has others that
  /// are none.
  bool overtaken(const State& s, double t, double at, Found& found) {
    values(t, s.x, s.lo, s.turns, now);
    bool some = false;
    double most = 1e-12;
    for (size_t k = 0; k < now.size(); ++k) {
      const double beyond = -sign[k] * now[k], begin = samples[0][k];
      if (k == found.index || !(beyond > most) || sign_of(begin) != sign[k] || rests(k, begin))
        continue;
      most = beyond;
      found = {k, {0, samples[0][k]}, {at, now[k]}, false};
      some = true;
    }
    return some;
  }
  /// A switch that jumps and is at 0 where a part begins, and goes on; none: count().
  size_t at_once() const {
    if (jumps)
      for (size_t k = 0; k < now.size(); ++k)
        if (switches->jumps(k) && now[k] >= 0 && rate_[k] > 0) return k;
    return now.size();
  }

  /// The value of switch k at a fraction of a part by the dense output; NaN without one.
  double inside(size_t k, const State& after, double at, double t, double rest) {
    if (!method_.interpolate(after, at, inside_)) return NAN;
    values(t + at * rest, inside_, {}, after.turns, now);
    return now[k];
  }

  std::unique_ptr<Switches> switches;
  bool jumps = false;                        ///< whether some jump
  std::vector<double> now;                   ///< the values last computed
  std::vector<int> sign;                     ///< of each switch behind the start of the part
  std::vector<std::vector<double>> samples;  ///< by sample and switch

 private:
  /// Whether a value that does not jump is 0 but for rounding [m | rad]. What stays there, such as
  /// a joint at its stop, has random signs.
  bool rests(size_t k, double g) const { return std::fabs(g) < 1e-14 && !switches->jumps(k); }

  /// Of a value, before a sample.
  struct Peak {
    size_t index;
    int before;
    Point point;
  };

  const Integrator& method_;
  std::vector<double> x_, inside_, angles_, rate_, rate_at_peak_;
  std::vector<std::vector<double>> sample_rates_;
  std::vector<Peak> peaks_;
};

}  // namespace porthos::integrators
