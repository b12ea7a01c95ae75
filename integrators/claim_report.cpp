#include <algorithm>
#include <cmath>
#include <cstdio>

#include "integrators/claims.h"

namespace porthos::integrators {
namespace {

/// Of a claim that was measured and does not hold: what was found, how, and what was expected.
std::string refutation(const ClaimResult& c) {
  char text[200];
  const char* how = c.how.c_str();
  if (c.claim == "order")
    std::snprintf(text, sizeof text, "order: declared %g, measured %.2f %s, expected at least %g",
                  c.bound + 0.5, c.measured, how, c.bound);
  else
    std::snprintf(text, sizeof text,
                  "%s: declared, measured an error of %.1e %s, expected at most %.0e",
                  c.claim.c_str(), c.measured, how, c.bound);
  return text;
}

}  // namespace

bool ClaimResult::holds() const {
  if (!declared || !(why_not.empty() || std::isnan(measured))) return true;
  return claim == "order" ? measured >= bound : measured <= bound;  // false of NaN
}
bool ClaimReport::holds() const {
  return std::ranges::all_of(claims, [](const auto& c) { return c.holds(); });
}

std::string ClaimReport::text() const {
  char line[160];
  std::snprintf(line, sizeof line, ", step %g s\n", step);
  std::string all = method + " on " + system + line;
  std::snprintf(line, sizeof line, "%-22s %-10s %-10s %-10s %s\n", "claim", "declared", "measured",
                "bound", "verdict");
  all += line;
  for (const auto& c : claims) {
    const bool order = c.claim == "order";
    const char* verdict = !c.holds() ? "FAILS" : c.declared ? "holds" : "not declared";
    char measured[24] = "-", bound[24] = "-";
    if (c.why_not.empty()) {
      std::snprintf(measured, sizeof measured, order ? "%.2f" : "%.1e", c.measured);
      std::snprintf(bound, sizeof bound, order ? ">= %g" : "%.0e", c.bound);
    }
    std::snprintf(line, sizeof line, "%-22s %-10s %-10s %-10s ", c.claim.c_str(),
                  c.declared ? "yes" : "no", measured, bound);
    all += line + (c.why_not.empty() ? verdict : "not measured: " + c.why_not) + "\n";
  }
  for (const auto& c : claims)
    if (!c.holds() && c.why_not.empty()) all += refutation(c) + "\n";
  return all;
}

}  // namespace porthos::integrators
