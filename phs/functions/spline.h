#pragma once
#include <vector>

#include "phs/scalars/scalar.h"

namespace porthos::phs {

/// Natural cubic spline through (x_i, y_i): value, slope and curvature are continuous, and the
/// curvature is 0 at both ends. Outside it continues as a straight line (`linear`) or keeps the end
/// value (`held`).
class Spline {
 public:
  enum class Outside { linear, held };
  /// @throws InvalidArgument unless x rises and both are finite and of one length >= 2; `what` is
  ///   their name in the text
  Spline(std::vector<double> x, const std::vector<double>& y, Outside outside, const char* what);

  template <class T>
  T value(const T& x) const {
    if constexpr (is_pack<T>)
      return map_lanes([this](double z) { return value(z); }, x);
    else
      return at(
          x, [](const Piece& p, T d) { return T(p.y) + d * (T(p.b) + d * (T(p.c) + d * T(p.d))); });
  }
  /// ∫ value, from x_0.
  template <class T>
  T integral(const T& x) const {
    if constexpr (is_pack<T>)
      return map_lanes([this](double z) { return integral(z); }, x);
    else
      return at(x, [](const Piece& p, T d) {
        return T(p.before) +
               d * (T(p.y) + d * (T(p.b / 2) + d * (T(p.c) / T(3.0) + d * T(p.d / 4))));
      });
  }

  struct Piece {
    double x, y, b, c, d;  ///< y + b δ + c δ² + d δ³ at x + δ
    double before;         ///< integral up to x
  };
  /// The first and the last piece are the parts outside.
  const std::vector<Piece>& pieces() const { return pieces_; }
  /// The index of the piece that contains x.
  size_t piece_at(double x) const {
    size_t low = 0, high = pieces_.size();
    while (high - low > 1) {
      const size_t mid = (low + high) / 2;
      (x < pieces_[mid].x ? high : low) = mid;
    }
    return low;
  }

 private:
  template <class T, class F>
  T at(const T& x, F f) const {
    const Piece& p = pieces_[piece_at(to_double(x))];
    return f(p, x - T(p.x));
  }
  std::vector<Piece> pieces_;
};

}  // namespace porthos::phs
