#pragma once
#include <cstddef>
#include <span>
#include <vector>

#include "phs/system/system.h"

namespace porthos::integrators {

/// ∇C = a + A x for each component of the linear and quadratic invariants C that a model declares.
/// The constants a and A are computed once, by dual numbers, for methods that need ∇C at every
/// sweep.
class InvariantGradients {
 public:
  explicit InvariantGradients(const phs::Model& model);
  size_t count() const { return a_.size(); }

  /// ∇C_i at x. Sizes: that of the state.
  template <class T>
  void operator()(size_t i, std::span<const T> x, std::span<T> gradient) const {
    for (size_t k = 0; k < x.size(); ++k) gradient[k] = T(a_[i][k]);
    for (const auto& e : A_[i]) gradient[e.row] += T(e.value) * x[e.column];
  }

 private:
  struct Entry {
    size_t row, column;
    double value;
  };
  std::vector<std::vector<double>> a_;
  std::vector<std::vector<Entry>> A_;
};

}  // namespace porthos::integrators
