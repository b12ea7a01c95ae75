// When a fixed-point iteration ends: foreseen from its contraction, or watched down to its noise.
#include "integrators/core/stagnation.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <vector>

namespace porthos::integrators::stagnation_test {
namespace {

using enum Stagnation::Verdict;
constexpr double u = unit_roundoff<double>;

struct End {
  int sweeps;
  double left;  ///< error that the evaluation after the last sweep leaves, exactly
};
/// Moves that shrink by the ratios in turn, the last of them again and again, seen with a noise of
/// so many roundings.
End end_of(const std::vector<double>& ratios, bool plain = true, double noise = 2,
           double first = 1e-7) {
  auto stagnation = Stagnation::of<double>();
  stagnation.restart();
  double move = first, ratio = 0;
  for (int k = 1; k < 100; ++k) {
    const double seen = std::max(move, (1 + 0.05 * k) * noise * u);
    const auto verdict = stagnation.after(
        {.changed = true, .improved = move > u, .change = seen, .own = plain ? seen : HUGE_VAL});
    ratio = ratios[std::min(size_t(k), ratios.size()) - 1];
    if (verdict != go_on) return {k, move * ratio * ratio / (1 - ratio)};
    move *= ratio;
  }
  return {100, move};
}

TEST(Stagnation, ForeseesTheEndOfASteadyContraction) {
  for (const double ratio : {1e-3, 0.01, 0.03, 0.1, 0.2}) {
    const End foreseen = end_of({ratio}), watched = end_of({ratio}, false);
    std::printf("  ratio %-5g: %d sweeps leave %.1e u (2^-9 u), watched %d\n", ratio,
                foreseen.sweeps, foreseen.left / u, watched.sweeps);
    EXPECT_LE(foreseen.left, 0x1p-9 * u);
    EXPECT_LE(foreseen.sweeps, watched.sweeps);
  }
  EXPECT_LE(end_of({0.03}).sweeps + 2, end_of({0.03}, false).sweeps);
}

// Positions and momenta that contract by turns: the two sweeps together tell.
TEST(Stagnation, TwoRatiosInTurnAreOneContraction) {
  std::vector<double> turns;
  for (int k = 0; k < 40; ++k) turns.push_back(k % 2 ? 0.004 : 0.1);
  const End e = end_of(turns);
  std::printf("  0.1 and 0.004 in turn: %d sweeps leave %.1e u (2^-6 u)\n", e.sweeps, e.left / u);
  EXPECT_LE(e.left, 0x1p-6 * u);
}

// The controls: a ratio measured in noise, or before the moves are small, would end too early.
TEST(Stagnation, ForeseesNothingFromSlowOrDistantMoves) {
  for (const double ratio : {0.6, 0.9}) {
    const int with = end_of({ratio}).sweeps, without = end_of({ratio}, false).sweeps;
    EXPECT_EQ(with, without) << ratio;
  }
  EXPECT_EQ(end_of({0.01}, true, 1000).sweeps, end_of({0.01}, false, 1000).sweeps);
  // Of moves that begin small no two ratios can be measured.
  EXPECT_EQ(end_of({0.03}, true, 2, 1e-14).sweeps, end_of({0.03}, false, 2, 1e-14).sweeps);
  // A last move that is far from what the ratio promises is another mode's, which is slower.
  auto stagnation = Stagnation::of<double>();
  stagnation.restart();
  for (const double move : {1e-7, 1e-10, 1e-13, 14 * u})
    EXPECT_EQ(stagnation.after({.changed = true, .improved = true, .change = move, .own = move}),
              go_on);
  // one jump towards the solution, then a slow contraction: judged by what was measured later
  const End e = end_of({1e-2, 1e-2, 0.3, 0.3, 0.3});
  std::printf("  slower near the end: %d sweeps leave %.1e u (2^-5 u)\n", e.sweeps, e.left / u);
  EXPECT_LE(e.left, 0x1p-5 * u);
}

}  // namespace
}  // namespace porthos::integrators::stagnation_test
