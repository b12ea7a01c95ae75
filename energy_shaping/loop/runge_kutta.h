#pragma once
#include <array>
#include <cstddef>
#include <vector>

namespace porthos::energy_shaping {

/// The classical method of order 4 (Kutta 1901) for loops that are only tried: one state, or one
/// per lane.
template <class T>
class RungeKutta {
 public:
  explicit RungeKutta(size_t n) : y_(n) { k_.fill(y_); }

  /// x moves by h. field(x, dx): writes the rates.
  template <class Field>
  void step(double h, std::vector<T>& x, Field field) {
    field(x, k_[0]);
    for (size_t j = 1; j < 4; ++j) {
      const T c(j == 3 ? h : 0.5 * h);
      for (size_t i = 0; i < x.size(); ++i) y_[i] = x[i] + c * k_[j - 1][i];
      field(y_, k_[j]);
    }
    for (size_t i = 0; i < x.size(); ++i)
      x[i] += T(h / 6) * (k_[0][i] + T(2.0) * (k_[1][i] + k_[2][i]) + k_[3][i]);
  }

 private:
  std::vector<T> y_;
  std::array<std::vector<T>, 4> k_;
};

}  // namespace porthos::energy_shaping
