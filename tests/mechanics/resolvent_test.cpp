// (I - z J)⁻¹ of the recursion against the Jacobian by duals, on random trees with every joint
// type.
#include <gtest/gtest.h>

#include "mechanics/mechanical_model.h"
#include "tests/support/random_tree.h"

namespace porthos::mechanics::resolvent_test {
namespace {

using phs::Complex4;
using phs::Dual;

/// ‖(I - z J) d - r‖ / ‖r‖ over the lanes, J by duals; J times `wrong` for the control.
double defect(const phs::Model& model, const std::vector<double>& x, const Complex4& z,
              const std::vector<Complex4>& d, const std::vector<Complex4>& r, double wrong = 1) {
  const auto system = model.instantiate<Dual>();
  const size_t n = x.size();
  std::vector<Complex4> left = d;
  std::vector<Dual> xd(x.begin(), x.end()), f(n);
  for (size_t k = 0; k < n; ++k) {
    xd[k].d = 1;
    system->field(0.0, xd, {}, f);
    xd[k].d = 0;
    for (size_t i = 0; i < n; ++i) left[i] -= (wrong * f[i].d) * (z * d[k]);
  }
  double worst = 0, size = 0;
  for (size_t i = 0; i < n; ++i) {
    for (int lane = 0; lane < 4; ++lane) {
      const double e = std::sqrt((left[i] - r[i]).norm2()[lane]);
      worst = e > worst || e != e ? e : worst;
      size = std::max(size, std::sqrt(r[i].norm2()[lane]));
    }
  }
  return worst / size;
}

/// z of four lanes, complex and real.
Complex4 steps() {
  Complex4 z;
  for (int lane = 0; lane < 4; ++lane) {
    z.re.set(lane, lane == 3 ? 0 : 0.02 * (lane + 1));
    z.im.set(lane, 0.03 * lane * (lane < 3));
  }
  return z;
}
std::vector<Complex4> right_side(test::RandomTree& random, size_t n) {
  std::vector<Complex4> r(n);
  for (auto& y : r)
    for (int lane = 0; lane < 4; ++lane) {
      y.re.set(lane, random.uniform(-1, 1));
      y.im.set(lane, random.uniform(-1, 1));
    }
  return r;
}

TEST(Resolvent, SolvesWithTheExactJacobianOfAnyTree) {
  for (const bool gravity : {true, false}) {
    double worst = 0, control = 1;
    for (int seed = 1; seed <= 30; ++seed) {
      test::RandomTree random{std::uint64_t(seed)};
      random.rotor = seed % 2;
      const auto types = joint_type_names();
      const auto mechanism = random.tree(7, seed % 3 ? types[size_t(seed) % types.size()] : "free",
                                         "", gravity ? Vec3d{1, 2, -9.81} : Vec3d{0, 0, 0});
      if (mechanism->nv() == 0) continue;
      const MechanicalModel model(mechanism);
      auto x = model.state(random.q(*mechanism), random.numbers(mechanism->nv()));
      for (auto& y : x) y += 1e-2 * random.uniform(-1, 1);  // off the unit sphere, ξ·π ≠ 0
      const Complex4 z = steps();
      const auto r = right_side(random, x.size());
      const auto system = model.instantiate<double>();
      const auto resolvent = system->resolvent();
      ASSERT_NE(resolvent, nullptr);
      auto d = r;
      resolvent->factor(0, x, z);
      resolvent->solve(d);
      const double e = defect(model, x, z, d, r);
      EXPECT_LE(e, 1e-9) << "seed " << seed << ", " << mechanism->nodes().size() << " nodes";
      worst = std::max(worst, e);
      control = std::min(control, defect(model, x, z, d, r, 1.01));
    }
    std::printf("  %s: worst residual %.1e   bound 1e-9;  J wrong by a hundredth: %.1e, at least\n",
                gravity ? "gravity" : "no gravity", worst, control);
    EXPECT_GT(control, 1e-5);
  }
}

// With rotors; the solver of the same tree without them must fail.
TEST(Resolvent, KnowsTheRotors) {
  double worst = 0, control = 1;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    test::RandomTree random(seed), again(seed);
    random.rotor = 3;
    const auto mechanism = random.tree(6, seed % 2 ? "free" : "revolute", "revolute");
    const MechanicalModel model(mechanism), plain(again.tree(6, seed % 2 ? "free" : "revolute",  //
                                                             "revolute"));
    const auto x = model.state(random.q(*mechanism), random.numbers(mechanism->nv()));
    const Complex4 z = steps();
    const auto r = right_side(random, x.size());
    const auto error = [&](const MechanicalModel& solver) {
      const auto system = solver.instantiate<double>();
      const auto resolvent = system->resolvent();
      auto d = r;
      resolvent->factor(0, x, z);
      resolvent->solve(d);
      return defect(model, x, z, d, r);
    };
    worst = std::max(worst, error(model));
    control = std::min(control, error(plain));
  }
  std::printf("  worst residual %.1e   bound 1e-12;  without rotors: %.1e, at least\n", worst,
              control);
  EXPECT_LE(worst, 1e-12);
  EXPECT_GT(control, 1e-3);
}

}  // namespace
}  // namespace porthos::mechanics::resolvent_test
