#pragma once
#include <algorithm>
#include <cmath>
#include <span>
#include <string_view>
#include <vector>

#include "phs/error.h"
#include "phs/system/archive.h"
#include "phs/system/description.h"

namespace porthos::phs {

/// Whether a storage is a kinetic energy, which is zero at rest: "kinetic", "links.kinetic",
/// "shaped kinetic".
inline bool is_kinetic(std::string_view storage) {
  constexpr std::string_view kinetic = "kinetic";
  if (!storage.ends_with(kinetic)) return false;
  storage.remove_suffix(kinetic.size());
  return storage.empty() || storage.back() == '.' || storage.back() == ' ';
}

/// The scale of a run's relative energy error: the largest kinetic energy plus the range of every
/// other stored energy. It depends neither on the zero of a potential nor on the origin of the
/// world frame.
///
/// Without a storage called kinetic, the zero of each energy is unknown: every energy then counts
/// with its largest magnitude. The scale is at least 1e-14 of the magnitudes of the energies,
/// because doubles cannot resolve smaller ranges.
class EnergyScale {
 public:
  explicit EnergyScale(const Description& d) : low_(d.storages.size()), high_(d.storages.size()) {
    for (const auto& name : d.storages) kinetic_.push_back(is_kinetic(name));
    some_kinetic_ = std::find(kinetic_.begin(), kinetic_.end(), true) != kinetic_.end();
  }

  /// Takes a state's stored energies in [J].
  void see(std::span<const double> stored) {
    kinetic_J_ = std::max(kinetic_J_, kinetic_of(stored));
    for (std::size_t k = 0; k < low_.size(); ++k) {
      const double low = lowest(k, stored), high = highest(k, stored);
      low_[k] = low;
      high_[k] = high;
    }
    seen_ = true;
  }

  /// [J]
  double value() const { return value_with({}); }
  /// The scale if one more state had been seen.
  double value_with(std::span<const double> stored) const {
    double sum = std::max(kinetic_J_, kinetic_of(stored));
    for (std::size_t k = 0; k < low_.size(); ++k)
      if (!kinetic_[k]) sum += part(k, stored);
    return std::max(sum, 1e-14 * size(stored));
  }
  /// The contribution of storage k, if it is not kinetic.
  double part(std::size_t k, std::span<const double> stored = {}) const {
    return some_kinetic_ ? highest(k, stored) - lowest(k, stored) : largest(k, stored);
  }
  bool has_kinetic() const { return some_kinetic_; }
  double kinetic_J() const { return kinetic_J_; }  ///< the largest
  /// Sum of the largest magnitudes of all energies, with the zeros of potentials as they are.
  /// Rounding errors are relative to it.
  double size(std::span<const double> stored = {}) const {
    double sum = 0;
    for (std::size_t k = 0; k < low_.size(); ++k) sum += largest(k, stored);
    return sum;
  }

  void carry(Archive& a) {
    a(low_);
    a(high_);
    a(kinetic_J_);
    a(seen_);
  }

 private:
  using Energies = std::span<const double>;
  double kinetic_of(Energies stored) const {
    double sum = 0;
    for (std::size_t k = 0; k < stored.size(); ++k)
      if (kinetic_[k]) sum += stored[k];
    return sum;
  }
  double lowest(std::size_t k, Energies s) const {
    return s.empty() ? low_[k] : seen_ ? std::min(low_[k], s[k]) : s[k];
  }
  double highest(std::size_t k, Energies s) const {
    return s.empty() ? high_[k] : seen_ ? std::max(high_[k], s[k]) : s[k];
  }
  double largest(std::size_t k, Energies s) const {
    return std::max(std::fabs(lowest(k, s)), std::fabs(highest(k, s)));
  }

  std::vector<double> low_, high_;  ///< per storage
  std::vector<bool> kinetic_;
  double kinetic_J_ = 0;
  bool some_kinetic_ = false, seen_ = false;
};

}  // namespace porthos::phs
