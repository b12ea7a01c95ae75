#include "scene/run/growth_words.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace porthos::scene {

std::string growth_words(const RunReport& r) {
  constexpr double unit = std::numeric_limits<double>::epsilon();
  const EnergyReport& e = r.energy;
  const double error = e.max_rel_error, g = e.growth_exponent;
  if (!std::isfinite(error)) return "is not a finite number";
  if (error < unit) return "is below one rounding of a double";

  const bool rounding = error <= 4 * unit * std::sqrt(double(std::max<std::int64_t>(1, r.steps)));
  const bool drifts = e.drift_is_significant && !rounding;
  const std::string drift = fmt::format("drifts by {:.2g} per s", e.drift_per_s);
  const std::string swings = fmt::format("swings, and its swings grow {:.2g}-fold", e.swing_growth);
  if (!std::isfinite(g)) {
    if (drifts) return drift;
    if (e.swings_grow() && !rounding) return swings;
    const bool unequal =
        std::ranges::any_of(r.notes, [](const auto& n) { return n.starts_with(unequal_rows); });
    return unequal ? "is known at unequal intervals, which do not tell how it grows"
                   : "has too few records or swings to tell how it grows";
  }
  const std::string exponent = fmt::format(" (growth exponent {:.2f})", g);
  if (g >= 0.75)
    return "drifts, like t or faster" + exponent +
           (e.drift_is_significant ? fmt::format(", by {:.2g} per s", e.drift_per_s)
                                   : ", by an amount that is not significant");
  if (drifts)
    return drift + exponent +
           (std::fabs(e.drift_per_s) * r.simulated_s > 0.5 * error
                ? "; the exponent is that of the swings on it"
                : ", which is hidden in the scatter of single records");
  if (e.swings_grow() && !rounding) return swings + exponent;
  if (rounding) return (g < 0.25 ? "stays bounded" : "grows like rounding, √t") + exponent;
  if (g < 0.25)
    return "stays bounded" + exponent + ", above rounding: " +
           (r.method == "recorded" ? "the digits of the file, or its method"
                                   : "the truncation of the method");
  return "grows" + exponent +
         ", by more than rounding: part of the motion is resolved less finely than the rest";
}

}  // namespace porthos::scene
