// The fast slender spinner of MuJoCo's issue 3553 (google-deepmind/mujoco): a massless free root,
// all the inertia in a child fixed to it, one principal moment 26 times smaller than the others, dt
// = 1e-3 s; a semi-implicit engine blew up at step 4294. Here spun about the slender axis at 30 and
// 300 rad/s, and tilted. Must hold: gauss16 keeps energy and angular momentum at round-off over 1e5
// steps (1e6 with PORTHOS_LONG=1). Must fail: rk4 at the same step loses both.
#include "tests/support/energy_run.h"

namespace porthos::spinner_test {
namespace {

TEST(Spinner, SlenderFastLONG) {
  mechanics::MechanismBuilder b("spinner");
  mechanics::BodySpec body;
  body.name = "root";
  body.parent = "world";
  body.joint.type = "free";
  b.add(body);
  body.name = "child";
  body.parent = "root";
  body.joint = {};  // fixed
  body.mass = {0.12, {0, 0, 0}, {1.7231e-4, 0, 0, 6.58e-6, 0, 1.7243e-4}};
  b.add(body);
  const mechanics::MechanicalModel model(std::make_shared<mechanics::Mechanism>(b.build()));
  const auto& m = model.mechanism();
  ASSERT_EQ(m.body_count(), 1) << "bodies on fixed joints share a node";
  EXPECT_EQ(m.total_mass(), 0.12);

  const std::int64_t steps = test::long_runs() ? 1000000 : 100000;
  for (const double spin : {30.0, 300.0}) {
    const phs::State start(model.description(),
                           model.state(m.neutral(), std::vector<double>{2, spin, -1, 0, 0, 0}));
    const auto run = [&](const char* method) {
      return test::energy_run(method, model, start, 1e-3, steps,
                              {.samples = 10000, .invariant = "angular_momentum"});
    };
    const auto ours = run("gauss16"), rk4 = run("rk4");
    std::printf("  spin %g rad/s, %lld steps\n", spin, (long long)steps);
    test::keeps("gauss16 energy", ours.energy, test::random_walk(steps));
    test::keeps("gauss16 energy, growth exponent", ours.exponent, 0.65);
    EXPECT_FALSE(ours.drifts);
    test::keeps("gauss16 angular momentum", ours.invariant, test::random_walk(steps));
    test::breaks("rk4 energy", rk4.energy, 1e-10);
    test::breaks("rk4 angular momentum", rk4.invariant, 1e-10);
  }
}

}  // namespace
}  // namespace porthos::spinner_test
