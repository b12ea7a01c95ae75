// Andrews' squeezing mechanism, as shipped, against the reference of 26 digits: its motion and the
// forces in the pin where four bodies meet.
#include <cmath>

#include "phs/scalars/trig.h"
#include "scene/run/columns.h"
#include "scene/session/memory_run.h"
#include "tests/run/scenes.h"
#include "tests/support/reference.h"

namespace porthos::test::squeezer_test {
namespace {

using Vec = std::vector<double>;

scene::Scene squeezer() {
  return scene::read_scene(PORTHOS_SOURCE_DIR "/examples/andrews/scene.toml");
}

/// The largest differences from the reference at its times.
struct Differences {
  double angle = 0;                 ///< [rad]
  double force = 0, strongest = 0;  ///< in the pin [N]
  double idle = 0;                  ///< what a plane mechanism does not have: moments and force z
};

Differences differences(const scene::Scene& s) {
  const auto reference = read_json(data_file("reference/i_andrews_squeezer.json"));
  const auto& outputs = reference["outputs"];
  const auto number = [](const auto& text) { return std::stod(text.template get<std::string>()); };
  const scene::Assembly a = scene::assemble(s);
  const phs::Description& d = a.model->description();
  const scene::RecordLayout layout(d, s.extrema);
  std::vector<std::string> joints = scene::turn_names(d);
  Differences worst;
  size_t row = 0;
  scene::run_in_memory(
      s, a, {.record = [&](std::span<const double> record) {
        const auto& out = outputs.at(row);
        const double early = number(out["t"]) - record[layout.time()];
        if (early > 1e-15) return;  // not listed
        EXPECT_NEAR(early, 0, 1e-15);
        ++row;
        std::vector<std::int64_t> turns(joints.size());
        scene::turns_of(layout, record, turns);
        const auto angle = [&](const std::string& name) {
          const size_t i = size_t(std::find(joints.begin(), joints.end(), name) - joints.begin());
          return record[layout.x() + i] + phs::two_pi_hi * double(turns.at(i));
        };
        size_t k = 0;
        for (const char* name : {"beta", "theta", "gamma", "phi", "delta", "omega", "epsilon"})
          worst.angle = std::max(worst.angle, std::fabs(angle(name) - number(out["group0"][k++])));
        // The reference counts the forces of the pins on k3, k4, k6 in the world's axes.
        const double turned = angle("beta") + angle("theta");
        const double c = std::cos(turned), sn = std::sin(turned);
        for (size_t pin = 0; pin < 3; ++pin) {
          const double* w = record.data() + layout.reaction() + 6 * pin;
          const double fx = c * w[3] - sn * w[4], fy = sn * w[3] + c * w[4];
          const double rx = number(out["group1"][7 + 2 * pin]),
                       ry = number(out["group1"][8 + 2 * pin]);
          worst.force = std::max(worst.force, std::hypot(fx - rx, fy - ry));
          worst.strongest = std::max(worst.strongest, std::hypot(rx, ry));
          for (const size_t i : {0, 1, 2, 5}) worst.idle = std::max(worst.idle, std::fabs(w[i]));
        }
      }});
  EXPECT_EQ(row, outputs.size());
  return worst;
}

TEST(Squeezer, MovesAndPullsAsTheReferenceAtEveryListedTime) {
  const auto exact = differences(squeezer());
  std::printf(
      "  angles off by %.1e of 34 rad   bound 1e-13;  forces by %.1e of %.0f N   bound 1e-11;"
      "  across the plane %.1e\n",
      exact.angle, exact.force, exact.strongest, exact.idle);
  EXPECT_LT(exact.angle, 1e-13);
  EXPECT_LT(exact.force, 1e-11);
  EXPECT_GT(exact.strongest, 100);
  EXPECT_LT(exact.idle, 1e-12);
}

/// Control: a spring longer by a micrometre, or a coarse method, is seen.
TEST(Squeezer, TheComparisonSeesAMicrometre) {
  auto s = squeezer();
  for (auto& e : s.elements)
    if (e.latch) e.latch->line.rest += 1e-6;
  EXPECT_GT(differences(s).angle, 1e-4);
  auto coarse = squeezer();
  coarse.method = "spark4";
  EXPECT_GT(differences(coarse).angle, 1e-9);
}

/// Control of the reference and of the rivals: other formulations come to it as their tolerance
/// falls.
TEST(Squeezer, RivalsComeToTheReferenceAsTheirToleranceFalls) {
  for (const std::string name : {"ida_ggl", "index1_cvode_adams", "baumgarte_cvode_adams"}) {
    if (std::none_of(integrators::catalogue().begin(), integrators::catalogue().end(),
                     [&](const auto& d) { return d.name == name; }))
      GTEST_SKIP() << "without SUNDIALS";
    const auto angle = [&](double rtol) {
      auto s = squeezer();
      s.method = name;
      s.rtol = rtol;
      return differences(s).angle;
    };
    const double loose = angle(1e-5), tight = angle(1e-11);
    std::printf("  %-22s rtol 1e-5: angles off by %.1e, 1e-11: %.1e   bound 2e-7\n", name.c_str(),
                loose, tight);
    EXPECT_LT(tight, 2e-7) << name;  // measured 2.9e-8, 6.1e-8, 4.1e-9
    EXPECT_GT(loose, 100 * tight) << name;
  }
}

}  // namespace
}  // namespace porthos::test::squeezer_test
