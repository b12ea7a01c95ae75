#pragma once
#include <string>
#include <vector>

namespace porthos::ensemble {

/// How a quantity of an ensemble is distributed.
struct Distribution {
  enum class Kind {
    uniform,      ///< in [a, b]
    normal,       ///< mean a, standard deviation b
    log_uniform,  ///< in [a, b], 0 < a, its logarithm uniform
    rotation      ///< a unit quaternion w, x, y, z, uniform over all attitudes
  } kind = Kind::uniform;
  double a = 0, b = 1;

  /// Numbers in [0, 1) it takes.
  int draws() const { return kind == Kind::rotation ? 3 : 1; }
  /// Numbers it gives.
  int size() const { return kind == Kind::rotation ? 4 : 1; }
  /// The value at u, draws() numbers in (0, 1). For a single number: the u-quantile. Writes size()
  /// numbers. Attitudes: Shoemake 1992 (Graphics Gems III), w >= 0.
  void at(const double* u, double* value) const;
  /// Why these numbers make no distribution: "low is 2 and high 1, expected low < high". Empty:
  /// they do.
  std::string trouble() const;
};

}  // namespace porthos::ensemble
