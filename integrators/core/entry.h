#pragma once
#include <functional>
#include <memory>
#include <type_traits>
#include <vector>

#include "integrators/core/integrator.h"
#include "integrators/core/lane_integrator.h"

namespace porthos::integrators {

template <class T>
using Maker = std::function<std::unique_ptr<BasicIntegrator<T>>(
    const Declaration&, const phs::Model&, T h, const Options&)>;

/// Makes a method with one state per SIMD lane; returns null if a system or the options do not
/// allow it.
using LaneMaker = std::function<std::unique_ptr<LaneIntegrator>(
    const Declaration&, const phs::Model&, double h, const Options&)>;

/// A method of the catalogue: its declaration and its maker for each supported scalar.
struct Entry {
  Declaration declaration;
  Maker<double> make_double;
  Maker<phs::Dual> make_dual;
  Maker<phs::Quad> make_quad;
  LaneMaker make_lanes = nullptr;  ///< null: one state at a time

  template <class T>
  const Maker<T>& make() const {
    if constexpr (std::is_same_v<T, double>)
      return make_double;
    else if constexpr (std::is_same_v<T, phs::Dual>)
      return make_dual;
    else
      return make_quad;
  }
};

/// An entry for every scalar, from a maker that is generic in the type of h:
///   entry({.name = "rk4", ...}, PORTHOS_MAKER(make_rk4))
template <class MakerOfAny>
Entry entry(Declaration d, MakerOfAny make) {
  return {std::move(d), make, make, make};
}
/// The same, with one state per lane.
inline Entry with_lanes(Entry e, LaneMaker lanes) {
  e.make_lanes = std::move(lanes);
  return e;
}
/// In any namespace; `function` as it is called there.
#define PORTHOS_MAKER(function)                                                                  \
  [](const ::porthos::integrators::Declaration& declaration, const ::porthos::phs::Model& model, \
     auto h, const ::porthos::integrators::Options& options) {                                   \
    return function(declaration, model, h, options);                                             \
  }
/// An entry for a method that works in double only.
inline Entry double_entry(Declaration d, Maker<double> make) {
  return {std::move(d), std::move(make), nullptr, nullptr, nullptr};
}

using Entries = std::vector<Entry>;

}  // namespace porthos::integrators
