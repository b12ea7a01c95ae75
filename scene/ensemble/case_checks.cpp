#include "scene/ensemble/case_checks.h"

#include <algorithm>

#include "scene/run/stop_values.h"

namespace porthos::scene {

CaseChecks::CaseChecks(const Scene& scene)
    : names_{"energy",
             "linear_momentum",
             "linear_momentum (less impulses)",
             "angular_momentum",
             "angular_momentum (less impulses)",
             "quaternion_norm",
             "constraints",
             "constraint_rates",
             "orbital",
             "coupling",
             "balance",
             "step_halving",
             "momentum_across_events",
             "missed_events",
             "missed_handovers"} {
  constexpr size_t most = 62;  // bits of a number that is not negative, less "another"
  for (const Stop& stop : scene.stops)
    if (stop.is_requirement() && names_.size() < most) {
      requirements_ |= std::int64_t(1) << names_.size();
      names_.push_back(name_of_check(stop));
    }
  names_.push_back("another");
}

std::int64_t CaseChecks::bit_of(const std::string& name) const {
  return std::int64_t(1) << (std::find(names_.begin(), names_.end() - 1, name) - names_.begin());
}

std::int64_t CaseChecks::failed(const RunReport& r) const {
  std::int64_t bits = 0;
  for (const Check& c : r.checks)
    if (!c.pass && c.name != "outcome") bits |= bit_of(c.name);
  return bits;
}

std::int64_t CaseChecks::not_judged(const RunReport& r) const {
  std::int64_t bits = 0;
  for (const NotApplicable& n : r.not_applicable) bits |= bit_of(n.name);
  return bits & requirements_;
}

std::vector<std::string> CaseChecks::names_of(std::int64_t bits) const {
  std::vector<std::string> list;
  for (size_t k = 0; k < names_.size(); ++k)
    if (bits >> k & 1) list.push_back(names_[k]);
  return list;
}

}  // namespace porthos::scene
