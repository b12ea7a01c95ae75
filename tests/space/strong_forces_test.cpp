#include <cmath>

#include "space/orbit.h"
#include "space/split_scheme.h"
#include "tests/support/bounds.h"

// Would Encke's method gain anything? Where forces on the orbit are strong and steps large, what
// does the split of Kepler flow and kicks lose to rounding, and what to the step? A step is
// symmetric (drag included: its kick is an implicit midpoint), so there and back again is the
// identity, and what is left of it is rounding.
namespace porthos::space::strong_forces_test {
namespace {

using test::breaks;
using test::keeps;

struct Leg {
  const OrbitMotion& motion;
  const SplitScheme& scheme;
  bool low_words = true;
  void fly(std::array<double, 6>& x, std::array<double, 6>& lo, double h, int steps) const {
    OrbitWorks works;
    for (int k = 0; k < steps; ++k) {
      OrbitPoint p = load_point(x, lo);
      for (size_t i = 0; i < scheme.kick.size(); ++i) {
        if (scheme.kick[i] != 0) motion.kick(p, 0, scheme.kick[i] * h, {0, 0, 0}, works);
        if (i < scheme.drift.size()) motion.drift(p, scheme.drift[i] * h);
      }
      store_point(p, x, lo);
      if (!low_words) lo.fill(0);
    }
  }
};

TEST(StrongForces, CostTheStepNotTheRounding) {
  Environment oblate;
  oblate.planet.J = earth_zonals();
  Environment thick;  // tens of kilometres lower after a day
  thick.planet.rotation_rate = 7.292e-5;
  thick.atmosphere = Atmosphere{4e-10, 400e3, 60e3, 20};
  for (const auto& [name, env] : {std::pair{"J2 to J6", oblate}, {"strong drag", thick}})
    for (const double h : {10.0, 60.0, 300.0}) {
      const OrbitMotion motion(env, 1000);
      const Leg leg{motion, split_scheme("lobatto4")},
          plain{motion, split_scheme("lobatto4"), false};
      const auto start = from_elements(env.planet.mu, 6778e3, 0.002, 0.9, 0.1, 0.2, 0.3);
      const int steps = int(86400 / h);
      const auto at = [](const std::array<double, 6>& x, const std::array<double, 6>& lo) {
        return load_point(x, lo).r;
      };
      const auto both_ways = [&](const Leg& l) {
        std::array<double, 6> x{}, lo{};
        store_point({Vec3<OrbitReal>(start.r), Vec3<OrbitReal>(start.v)}, x, lo);
        l.fly(x, lo, h, steps);
        l.fly(x, lo, -h, steps);
        return double(mechanics::norm(at(x, lo) - Vec3<OrbitReal>(start.r)));
      };
      const auto end = [&](double step) {
        std::array<double, 6> x{}, lo{};
        store_point({Vec3<OrbitReal>(start.r), Vec3<OrbitReal>(start.v)}, x, lo);
        leg.fly(x, lo, step, int(86400 / step));
        return at(x, lo);
      };
      const double rounding = both_ways(leg), in_double = both_ways(plain);
      const double step = double(mechanics::norm(end(h) - end(h / 2)));
      std::printf("  %-12s %3.0f s: rounding %.1e m (state in doubles %.1e m), step %.1e m\n", name,
                  h, rounding, in_double, step);
      keeps("a day there and back, over the error of the step", rounding / step, 1e-2);
      keeps("a day there and back [m]", rounding, 2e-8);
      if (h < 20) breaks("the same with the state in doubles [m]", in_double, 2e-8);
    }
}

}  // namespace
}  // namespace porthos::space::strong_forces_test
