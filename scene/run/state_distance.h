#pragma once
#include <span>
#include <vector>

#include "phs/scalars/scalar.h"
#include "phs/system/state.h"

namespace porthos::scene {

/// Reduces a difference of states to one number: the largest component, with angles in rad,
/// quaternions as they are, positions in units of the largest one seen (at least 1 m), momenta in
/// units of the largest one seen, and quantities without momentum (an orbit, the current of a
/// motor) in units of the largest number of their block (at least 1).
class StateScale {
 public:
  explicit StateScale(const phs::Description& d) : d_(d), weight_(size_t(d.nx), 1.0) {}

  /// Enlarges the units to include a state of the motion.
  void see(std::span<const double> x);
  double weight(size_t k) const { return weight_[k]; }

 private:
  const phs::Description& d_;
  std::vector<double> weight_;
  double largest_position_ = 1, largest_momentum_ = 0;
};

/// A state with its turns added, in extended precision, from a run in double (value + low word).
std::vector<long double> unwrapped(const phs::Description& d, const phs::State& s);

/// Largest weighted component of a - b.
double distance(const StateScale& scale, std::span<const long double> a,
                std::span<const long double> b);

}  // namespace porthos::scene
