#include "planning/path_number.h"

#include <cmath>

namespace porthos::planning {

void PathNumber::hessian(double t, In x, Out H) {
  const size_t n = x.size();
  std::vector<double> at(x.begin(), x.end()), after(n), before(n);
  for (size_t k = 0; k < n; ++k) {
    const double step = 1e-5 * (1 + std::fabs(x[k]));  // the error is about 1e-10 of the size
    at[k] = x[k] + step;
    gradient(t, at, after);
    at[k] = x[k] - step;
    gradient(t, at, before);
    at[k] = x[k];
    for (size_t i = 0; i < n; ++i) H[k * n + i] = (after[i] - before[i]) / (2 * step);
  }
  for (size_t k = 0; k < n; ++k)
    for (size_t i = 0; i < k; ++i) H[k * n + i] = H[i * n + k] = (H[k * n + i] + H[i * n + k]) / 2;
}

}  // namespace porthos::planning
