#include "scene/plot/plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "scene/plot/svg.h"
#include "scene/run/run_report.h"

namespace porthos::scene {
namespace {

constexpr int columns = 1500;
constexpr double decades = 1e-6;  // below the largest error: no zero crossing makes the axis longer

std::string seconds_text(double s) {
  return s < 60 ? fmt::format("{:.3g} s", s) : fmt::format("{:.0f} s", s);
}

/// 50000 -> "50 000", with narrow spaces.
std::string grouped(std::int64_t n) {
  const std::string digits = std::to_string(n);
  std::string text;
  for (size_t i = 0; i < digits.size(); ++i) {
    if (i > 0 && (digits.size() - i) % 3 == 0) text += " ";
    text += digits[i];
  }
  return text;
}

}  // namespace

Envelope::Envelope(double first, double last, double from)
    : from_(std::fmax(from, 0)),
      first_(std::fmax(first > 0 ? first : 1, from)),
      last_(last > 0 ? last : first_),
      logarithmic_(last_ > 100 * first_) {}

void Envelope::add(double t, double error) {
  const double v = std::fabs(error);
  if (!std::isfinite(t) || !std::isfinite(v)) return;
  sum_of_squares_ += v * v;
  ++count_;
  if (t < (logarithmic_ ? first_ : from_)) return;
  const double f = logarithmic_ ? std::log(t / first_) / std::log(last_ / first_)
                                : (t - from_) / (last_ - from_);
  const int column = std::clamp(static_cast<int>(f * columns), 0, columns - 1);
  if (column != column_) points_.push_back({t, v, v, 0});
  column_ = column;
  EnvelopePoint& p = points_.back();
  p.low = std::min(p.low, v);
  p.high = std::max(p.high, v);
  p.rms = std::sqrt(sum_of_squares_ / count_);
}

TracePanel residual_panel(const Envelope& envelope, std::optional<double> limit) {
  TracePanel p{"residual [relative]", {}, true, envelope.logarithmic()};
  double highest = 0;
  for (const auto& e : envelope.points()) highest = std::max({highest, e.high, e.rms});
  const double from = envelope.from(), first = envelope.first(), last = envelope.last(),
               floor = decades * highest;
  TraceLine band{"|error|, least to largest"}, rms{"rms so far"}, guide{"∝ √t (random walk)"};
  band.stroke = Stroke::band;
  guide.stroke = Stroke::guide;
  for (const auto& e : envelope.points()) {
    if (e.high > floor) {
      band.t.push_back(e.t);
      band.value.push_back(e.high);
      band.low.push_back(std::max(e.low, floor));
    }
    rms.t.push_back(e.t);
    rms.value.push_back(e.rms > floor ? e.rms : std::nan(""));
  }
  if (!(highest > 0)) band.name = "exactly 0";
  p.lines = {band, rms};
  if (highest > 0)
    for (int i = 1; i <= 100; ++i) {
      const double f = i / 100.0;
      const double t =
          envelope.logarithmic() ? first * std::pow(last / first, f) : from + (last - from) * f;
      const double v = rms.value.back() * std::sqrt(t / last);
      guide.t.push_back(t);
      guide.value.push_back(v > floor ? v : std::nan(""));
    }
  p.lines.push_back(std::move(guide));
  if (limit && *limit > 0) {
    // One far above the errors would flatten them.
    const bool fits = *limit<1e6 * highest&& * limit> 1e-4 * highest;
    TraceLine line{"limit " + scientific(*limit) + (fits ? "" : ", off the plot")};
    if (fits) {
      line.t = {first, last};
      line.value = {*limit, *limit};
    }
    line.stroke = Stroke::limit;
    p.lines.push_back(std::move(line));
  }
  return p;
}

std::string plot_subtitle(const RunReport& r) {
  if (r.method == "recorded")
    return fmt::format("recorded  ·  {}  ·  verdict: {}", rows_words(r), to_string(r.verdict()));
  const bool fixed = r.step_control == integrators::StepControl::fixed;
  return fmt::format("{}  ·  {}step {} s  ·  {} steps  ·  {} CPU  ·  verdict: {}", r.method,
                     fixed ? "" : fmt::format("{} ", to_string(r.step_control)),
                     number_text(r.step_s), grouped(r.steps), seconds_text(r.cpu_s),
                     to_string(r.verdict()));
}

}  // namespace porthos::scene
