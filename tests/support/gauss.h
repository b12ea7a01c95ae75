#pragma once
#include <cstdint>
#include <vector>

#include "integrators/methods/collocation.h"

/// Gauss methods that only tests need: a reference in 113 bits, and one made wrong.
namespace porthos::integrators {

/// Steps of size h with s stages from x, fixed-point iterations to stagnation. Angles are not
/// wrapped.
/// @throws InvalidArgument if the iteration does not converge
inline std::vector<phs::Quad> gauss_reference(const phs::Model& model, std::vector<phs::Quad> x,
                                              phs::Quad h, std::int64_t steps, int s = 12) {
  const auto method = make_collocation<phs::Quad>({.name = "reference"}, gauss_table<phs::Quad>(s),
                                                  model, h, {.max_sweeps = 400});
  phs::BasicState<phs::Quad> state(model.description(), std::move(x));
  for (std::int64_t i = 0; i < steps; ++i)
    if (method->step(state) != Outcome::ok)
      throw InvalidArgument("the 113-bit reference run does not converge at this step");
  for (size_t k = 0; k < state.x.size(); ++k) state.x[k] += state.lo[k];
  return state.x;
}

/// The table with the *upper* triangle rounded and the lower set to 1 - upper, the wrong way round:
/// the negative control of the drift tests.
inline CollocationTable<double> gauss_table_wrong_triangle(int s) {
  auto t = gauss_table<double>(s);
  const auto exact = gauss_table<phs::Quad>(s);
  for (int i = 0; i < s; ++i)
    for (int j = 0; j < i; ++j) {
      const double upper = double(exact.mu[size_t(j * s + i)]);
      t.mu[size_t(j * s + i)] = upper;
      t.mu[size_t(i * s + j)] = 1 - upper;
    }
  return t;
}

}  // namespace porthos::integrators
