#include "phs/functions/spline.h"

#include <string>

#include "phs/error.h"

namespace porthos::phs {

Spline::Spline(std::vector<double> x, const std::vector<double>& y, Outside outside,
               const char* what) {
  const size_t n = x.size();
  const auto refuse = [&](const std::string& why) {
    throw InvalidArgument(std::string(what) + ": " + why);
  };
  if (n != y.size())
    refuse(std::to_string(n) + " places and " + std::to_string(y.size()) +
           " values, expected as many of both");
  if (n < 2) refuse("has " + std::to_string(n) + " points, expected 2 or more");
  for (size_t i = 0; i < n; ++i) {
    if (!std::isfinite(x[i]) || !std::isfinite(y[i]))
      refuse("point " + std::to_string(i + 1) + " is not finite");
    if (i > 0 && !(x[i] > x[i - 1]))
      refuse("point " + std::to_string(i + 1) + " stands at " + std::to_string(x[i]) +
             ", expected more than " + std::to_string(x[i - 1]));
  }
  // Second derivatives M by the tridiagonal system of continuity, M = 0 at the ends.
  std::vector<double> M(n, 0.0), upper(n, 0.0);
  for (size_t i = 1; i + 1 < n; ++i) {
    const double h0 = x[i] - x[i - 1], h1 = x[i + 1] - x[i];
    const double right = 6 * ((y[i + 1] - y[i]) / h1 - (y[i] - y[i - 1]) / h0);
    const double pivot = 2 * (h0 + h1) - h0 * upper[i - 1];
    upper[i] = h1 / pivot;
    M[i] = (right - h0 * M[i - 1]) / pivot;
  }
  for (size_t i = n - 1; i-- > 1;) M[i] -= upper[i] * M[i + 1];

  const auto slope_at = [&](size_t i, bool left_of_piece) {
    const size_t j = left_of_piece ? i : i - 1;  // piece j, from x_j to x_j+1
    const double h = x[j + 1] - x[j], secant = (y[j + 1] - y[j]) / h;
    return left_of_piece ? secant - h * (2 * M[j] + M[j + 1]) / 6
                         : secant + h * (M[j] + 2 * M[j + 1]) / 6;
  };
  const bool line = outside == Outside::linear;
  pieces_.push_back({x[0], y[0], line ? slope_at(0, true) : 0, 0, 0, 0});
  double sum = 0;
  for (size_t j = 0; j + 1 < n; ++j) {
    const double h = x[j + 1] - x[j];
    const Piece p{x[j], y[j], slope_at(j, true), M[j] / 2, (M[j + 1] - M[j]) / (6 * h), sum};
    pieces_.push_back(p);
    sum += h * (p.y + h * (p.b / 2 + h * (p.c / 3 + h * p.d / 4)));
  }
  pieces_.push_back({x[n - 1], y[n - 1], line ? slope_at(n - 1, false) : 0, 0, 0, sum});
}

}  // namespace porthos::phs
