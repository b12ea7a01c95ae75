#pragma once
#include "tests/support/gauss.h"
#include "tests/support/robots.h"

/// ETS-VII at eight times its rates, whose joints move by two radians, with a 113-bit reference.
namespace porthos::test::fast_arm {

inline const Robot& robot() {
  static const Robot r = ets_vii(8);
  return r;
}
constexpr double duration = 4;
/// The state after so many seconds, by so many steps.
inline std::vector<phs::Quad> reference_by(int steps) {
  return integrators::gauss_reference(*robot().model,
                                      {robot().start.x.begin(), robot().start.x.end()},
                                      phs::Quad(duration) / steps, steps, 12);
}
inline const std::vector<phs::Quad>& reference() {
  static const auto x = reference_by(64);
  return x;
}

}  // namespace porthos::test::fast_arm
