#include "scene/run/growth_words.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace porthos::scene {
namespace {

/// What is told beside the figures of an error.
struct Told {
  double steps = 0, length = 0;
  const char* unit = "s";       ///< of the length
  std::string of_bounded = {};  ///< where an error above rounding that stays bounded comes from
  std::string what_to_do = {};  ///< about one that grows
  std::string of_jump = {};     ///< what a jump tells
};

const char* words(GrowthUnknown why) {
  switch (why) {
    case GrowthUnknown::few_records:
      return "has too few records to tell how it grows, expected 33 or more";
    case GrowthUnknown::few_swings:
      return "has too few swings to tell how it grows, expected a longer run";
    case GrowthUnknown::scatter:
      return "scatters too much from record to record to tell how it grows";
    case GrowthUnknown::unequal_rows:
      return "is known at unequal intervals, which do not tell how it grows";
    default:
      return "does not tell how it grows";
  }
}

std::string words(const EnergyReport& e, const Told& told) {
  constexpr double unit = std::numeric_limits<double>::epsilon();
  const double error = e.max_rel_error, g = e.growth_exponent;
  if (!std::isfinite(error)) return "is not a finite number";
  if (error < unit) return "is below one rounding of a double";

  const bool rounding = error <= 4 * unit * std::sqrt(std::max(1.0, told.steps));
  const bool drifts = e.drift_is_significant;
  const std::string calm = rounding ? "is no more than rounding may leave; it " : "";
  const std::string rate = fmt::format("by {:.2g} per {}", e.drift_per_s, told.unit);
  if (std::isfinite(e.jump_s))
    return fmt::format("{}jumps by {:.2g} at about {} and {}{}", calm, e.jump,
                       told.unit == std::string("s") ? fmt::format("{:.4g} s", e.jump_s)
                                                     : fmt::format("{} {}", told.unit, e.jump_s),
                       e.jump_then, rounding ? "" : told.of_jump);
  if (e.slows)
    return fmt::format("{}drifts ever more slowly, like t^{:.2f}, {} in the mean", calm, g, rate);
  const std::string swings = fmt::format("swings, and its swings grow {:.2g}-fold", e.swing_growth);
  if (!std::isfinite(g)) {
    if (drifts) return calm + "drifts " + rate;
    if (e.swings_grow() && !rounding) return swings;
    return words(e.unknown);
  }
  const std::string exponent = fmt::format(" (growth exponent {:.2f})", g);
  if (g >= 0.75)
    return calm + "drifts, like t or faster" + exponent + ", " +
           (drifts ? rate : "by an amount that is not significant");
  if (drifts && rounding) return calm + "drifts " + rate + exponent;
  if (drifts)
    return "drifts " + rate + exponent +
           (std::fabs(e.drift_per_s) * told.length > 0.5 * error
                ? "; the exponent is that of the swings on it"
                : ", which is hidden in the scatter of single records");
  if (e.swings_grow() && !rounding) return swings + exponent;
  if (rounding) return (g < 0.25 ? "stays bounded" : "grows like rounding, √t") + exponent;
  const bool walks = g > 0.35 && g < 0.65;
  return g < 0.25 ? "stays bounded" + exponent + ", above rounding" + told.of_bounded
                  : (walks ? "grows like a random walk, √t" : "grows") + exponent +
                        ", by more than rounding" + told.what_to_do;
}

/// About a growth that is no rounding: what the method explains, else what to ask.
std::string what_to_do(const RunReport& r) {
  for (const auto& d : integrators::catalogue())
    if (d.name == r.method && d.symplectic == integrators::Claim::fails &&
        d.energy_exact == integrators::Claim::fails)
      return ": " + r.method + " is not symplectic and does not keep the energy";
  const std::string question = ": does it with a shorter step (porthos compare)?";
  return r.own_slopes ? question +
                            " Do the slopes of energies of your own agree with them "
                            "(porthos verify)?"
                      : question;
}

/// What a jump tells, beside the limit of the energy error; 0: none.
std::string of_jump(const RunReport& r, double limit) {
  constexpr double far = 100;
  const double below = limit / std::fabs(r.energy.jump);
  if (below >= far) return fmt::format(", {:.2g} times below the limit", below);
  return r.method == "recorded" ? "" : ": the motion is not resolved there";
}

}  // namespace

void set_growth(EnergyReport& e, const ErrorStatistics& s, double interval, double scale) {
  e.growth_exponent = s.growth_exponent();
  e.drift_is_significant = s.drift_is_significant();
  e.swing_growth = s.swing_growth();
  e.slows = s.slows();
  e.unknown = s.unknown();
  constexpr const char* then[] = {"", "stays there", "comes back", "has others beside it"};
  const auto jump = s.jump();
  const bool jumps = jump.kind != ErrorStatistics::Jump::none;
  e.jump_s = jumps ? jump.records * interval : std::nan("");
  e.jump = jumps ? jump.size / scale : std::nan("");
  e.jump_then = then[jump.kind];
}

bool only_start(const RunReport& r) { return r.records + r.looks < 2; }

bool energy_overflowed(const RunReport& r) {
  return r.outcome == integrators::Outcome::not_finite && r.energy.max_rel_error >= 0.5;
}

std::string growth_words(const RunReport& r) {
  if (only_start(r)) return "is not known: nothing but the start was seen";
  if (energy_overflowed(r)) return "is as large as the energy itself, which overflowed";
  const bool recorded = r.method == "recorded";
  const auto judged = std::ranges::find(r.checks, "energy", &Check::name);
  const bool fails = judged != r.checks.end() && !judged->pass;
  return words(
      r.energy,
      {.steps = double(r.steps),
       .length = r.simulated_s,
       .of_bounded = recorded ? ": the digits of the file, or its method"
                     : fails
                         ? ": the truncation of the method, expected a shorter step or a method of "
                           "higher order"
                         : ": the truncation of the method",
       .what_to_do = recorded || r.energy.kinks ? "" : what_to_do(r),
       .of_jump = of_jump(r, judged != r.checks.end() ? judged->limit : 0)});
}

std::string growth_words(const ErrorStatistics& s) {
  if (s.count() == 0) return words(GrowthUnknown::few_records);
  EnergyReport e;
  e.max_rel_error = s.max_abs();
  set_growth(e, s, 1);
  const double steps = std::max(1.0, double(s.count()) - 1);
  e.drift_per_s = s.drift() / steps;
  return words(e, {.steps = steps, .length = steps, .unit = "record"});
}

}  // namespace porthos::scene
