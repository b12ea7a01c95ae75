#include "phs/functions/block_potential.h"

#include <array>
#include <cmath>

#include "phs/error.h"

namespace porthos::phs {
namespace {

/// A potential of n numbers from two generic callables.
template <int n, class Energy, class Slope>
BlockPotentialPtr block_potential(Energy energy, Slope slope) {
  class Callable final : public BlockPotential {
   public:
    Callable(Energy e, Slope s) : energy_(std::move(e)), slope_(std::move(s)) {}
    int size() const override { return n; }
#define PORTHOS_EVALUATE(T)                                            \
  T energy(std::span<const T> z) const override { return energy_(z); } \
  void slope(std::span<const T> z, std::span<T> out) const override { slope_(z, out); }
    PORTHOS_FOR_EACH_SCALAR(PORTHOS_EVALUATE)
#undef PORTHOS_EVALUATE

   private:
    Energy energy_;
    Slope slope_;
  };
  return std::make_shared<Callable>(std::move(energy), std::move(slope));
}

void require_stiffness(double k) {
  if (!(k >= 0) || !std::isfinite(k))
    throw InvalidArgument("the stiffness is " + number(k, 6) +
                          ", expected a finite number, 0 or more");
}

/// d = ρ - c ξ and c = ρ·ξ / |ξ|².
template <class T>
struct FromRest {
  std::array<T, 4> d;
  T c;
  FromRest(std::span<const T> xi, const std::array<double, 4>& rho) {
    T along(0.0), square(0.0);
    for (size_t i = 0; i < 4; ++i) {
      along = along + T(rho[i]) * xi[i];
      square = square + xi[i] * xi[i];
    }
    c = along / square;
    for (size_t i = 0; i < 4; ++i) d[i] = T(rho[i]) - c * xi[i];
  }
};

}  // namespace

BlockPotentialPtr attitude_spring(double stiffness, std::span<const double, 4> rest) {
  require_stiffness(stiffness);
  const double length = std::hypot(std::hypot(rest[0], rest[1]), std::hypot(rest[2], rest[3]));
  if (!(length > 0) || !std::isfinite(length))
    throw InvalidArgument("the rest attitude has length " + number(length, 6) +
                          ", expected a quaternion");
  std::array<double, 4> rho;
  for (size_t i = 0; i < 4; ++i) rho[i] = rest[i] / length;
  return block_potential<4>(
      [k = stiffness, rho](auto xi) {
        using T = std::remove_const_t<typename decltype(xi)::element_type>;
        const FromRest<T> from(xi, rho);
        T square(0.0);
        for (const T& d : from.d) square = square + d * d;
        return T(2 * k) * square;
      },
      [k = stiffness, rho](auto xi, auto out) {
        using T = typename decltype(out)::element_type;
        const FromRest<T> from(xi, rho);
        for (size_t i = 0; i < 4; ++i) out[i] = T(-4 * k) * from.c * from.d[i];
      });
}

BlockPotentialPtr place_spring(double stiffness, std::span<const double, 3> rest) {
  require_stiffness(stiffness);
  const std::array<double, 3> r0{rest[0], rest[1], rest[2]};
  return block_potential<3>(
      [k = stiffness, r0](auto r) {
        using T = std::remove_const_t<typename decltype(r)::element_type>;
        T square(0.0);
        for (size_t i = 0; i < 3; ++i) square = square + (r[i] - T(r0[i])) * (r[i] - T(r0[i]));
        return T(0.5 * k) * square;
      },
      [k = stiffness, r0](auto r, auto out) {
        using T = typename decltype(out)::element_type;
        for (size_t i = 0; i < 3; ++i) out[i] = T(k) * (r[i] - T(r0[i]));
      });
}

}  // namespace porthos::phs
