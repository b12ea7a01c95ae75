#pragma once
#include <string>
#include <vector>

namespace porthos::ensemble {

/// The probability distribution of a quantity of an ensemble.
struct Distribution {
  enum class Kind {
    uniform,      ///< in [a, b]
    normal,       ///< mean a, standard deviation b
    log_uniform,  ///< in [a, b], 0 < a; its logarithm is uniform
    rotation      ///< a unit quaternion w, x, y, z, uniform over all attitudes
  } kind = Kind::uniform;
  double a = 0, b = 1;

  /// How many numbers in (0, 1) a value requires.
  int draws() const { return kind == Kind::rotation ? 3 : 1; }
  /// How many numbers a value has.
  int size() const { return kind == Kind::rotation ? 4 : 1; }
  /// The value at u, which has draws() numbers in (0, 1). For a single number, it is the
  /// u-quantile. Writes size() numbers to value. Attitudes: Shoemake 1992 (Graphics Gems III), w >=
  /// 0.
  void at(const double* u, double* value) const;
  /// Why the parameters are invalid: "low is 2 and high 1, expected low < high". Empty: they are
  /// valid.
  std::string trouble() const;
};

}  // namespace porthos::ensemble
