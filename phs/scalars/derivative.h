#pragma once
#include <cstddef>
#include <span>

#include "phs/scalars/lane.h"

/// Exact derivatives by dual numbers, one direction at a time.
namespace porthos::phs {

/// f'(x) of a function of one number.
template <class T, class F>
T derivative(const F& f, T x) {
  return f(BasicDual<T>(x, T(1.0))).d;
}

/// Calls at(k) for each coordinate k of x, a container of duals seeded along k during the call.
template <class Duals, class F>
void along_each(Duals& x, F at) {
  for (std::size_t k = 0; k < x.size(); ++k) {
    auto& direction = x[k].d;
    using T = std::remove_reference_t<decltype(direction)>;
    direction = T(1.0);
    at(k);
    direction = T(0.0);
  }
}

/// gradient = ∂H/∂x in double or in lanes: evaluates H in duals once per coordinate and lane.
/// `duals` has the size of x.
template <class T, class F>
void gradient_by_duals(const F& H, std::span<const T> x, std::span<Dual> duals,
                       std::span<T> gradient) {
  for (int lane = 0; lane < lanes<T>; ++lane) {
    for (std::size_t k = 0; k < x.size(); ++k) duals[k] = Dual(lane_of(x[k], lane));
    along_each(duals, [&](std::size_t k) {
      set_lane(gradient[k], lane, H(std::span<const Dual>(duals)).d);
    });
  }
}
/// Whether gradient_by_duals supports a scalar. With Dual or the 113-bit float it would lose
/// digits.
template <class T>
inline constexpr bool has_gradient_by_duals = std::is_same_v<T, double> || is_pack<T>;

}  // namespace porthos::phs
