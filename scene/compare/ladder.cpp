#include "scene/compare/ladder.h"

#include <algorithm>
#include <cmath>

#include "integrators/catalogue.h"

namespace porthos::scene {
namespace {

constexpr std::int64_t first_digit = 4, last_digit = 13;  // tolerances 1e-4 … 1e-13
constexpr double outputs = 256;                           // of a run with a tolerance
constexpr double fewest_steps = 8;                        // in a trial
constexpr size_t most_rungs = 40;
constexpr double round_off = 1e-11;  // below this an error may be rounding
constexpr double useless = 0.1;      // an error that needs no coarser trial

/// Steps shrink by the factor that reduces the error thirtyfold, at most by half.
double ratio_of(int order) {
  return order > 0 ? std::clamp(std::pow(30.0, 1.0 / order), 1.2, 2.0) : 2.0;
}

}  // namespace

Ladder::Ladder(const integrators::Declaration& method, double time, double duration, double guess)
    : method_(method),
      tolerance_(integrators::works_to_tolerance(method)),
      time_(time),
      duration_(duration),
      ratio_(ratio_of(method.order)),
      n_(tolerance_ ? first_digit : std::max<std::int64_t>(1, std::llround(time / guess))),
      fewest_(std::max<std::int64_t>(1, std::llround(fewest_steps * time / duration))) {
  n_ = std::max(n_, tolerance_ ? first_digit : fewest_);
}

std::optional<Setting> Ladder::next() const {
  if (phase_ == Phase::done) return {};
  if (!tolerance_) return Setting{method_.name, time_ / double(n_), 0};
  const double parts = std::max(1.0, std::round(outputs * time_ / duration_));
  return Setting{method_.name, time_ / parts, std::pow(10.0, -double(n_))};
}

double Ladder::predicted_s() const {
  const Rung* near = nullptr;
  for (const Rung& r : rungs_)
    if (r.cpu_s > 0 && r.good && (!near || std::llabs(r.n - n_) < std::llabs(near->n - n_)))
      near = &r;
  if (!near) return spent_;
  return near->cpu_s *
         (tolerance_ ? std::pow(1.5, double(n_ - near->n)) : double(n_) / double(near->n));
}

std::int64_t Ladder::below(std::int64_t n) const {
  return tolerance_ ? n : std::min<std::int64_t>(n - 1, std::llround(double(n) / ratio_));
}
std::int64_t Ladder::above(std::int64_t n) const {
  return tolerance_ ? n + 1 : std::max<std::int64_t>(n + 1, std::llround(double(n) * ratio_));
}

void Ladder::take(const Trial& t, double error) {
  const Rung r{n_, error, t.report.cpu_s, t.complete() && error < 1};
  rungs_.push_back(r);
  spent_ += t.spent_s;
  if (rungs_.size() >= most_rungs || (t.broken_off && phase_ != Phase::coarser)) return end();
  if (phase_ == Phase::coarser)
    coarser(r);
  else
    finer(r);
  if (phase_ == Phase::finer && tolerance_ && n_ > last_digit) end();
}

void Ladder::coarser(const Rung& r) {
  const std::int64_t n = below(r.n);
  if (r.good && r.error < useless && n >= fewest_) return seek(Phase::coarser, n);
  std::int64_t finest = r.n;
  for (const Rung& other : rungs_) finest = std::max(finest, other.n);
  seek(Phase::finer, above(finest));
}

void Ladder::finer(const Rung& r) {
  if (!r.good && ++bad_ > 20) return end();
  no_better_ = r.good && r.error > 0.5 * best_ && best_ < round_off ? no_better_ + 1 : 0;
  if (r.good) best_ = std::min(best_, r.error);
  if (no_better_ >= (best_ < 1e-14 ? 1 : 2) || best_ == 0) return end();
  // The first trial decides: if it was good, coarser steps are worth trying.
  const bool good_start = phase_ == Phase::first && r.good && !tolerance_;
  if (good_start && r.error < useless && below(r.n) >= fewest_)
    return seek(Phase::coarser, below(r.n));
  seek(Phase::finer, above(r.n));
  // A step that breaks down is far too long: halve it.
  if (!r.good && !tolerance_) n_ = std::max(n_, 2 * r.n);
}

}  // namespace porthos::scene
