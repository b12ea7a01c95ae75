// IFToMM's benchmarks with loops against references that know nothing of mechanisms: quadratures
// of energy integrals, and Lagrange's equations of three coordinates.
#include <cmath>
#include <cstdlib>
#include <map>

#include "scene/run/state_distance.h"
#include "tests/run/scenes.h"
#include "tests/support/linkages.h"
#include "tests/support/reference.h"

namespace porthos::test::iftomm_test {
namespace {

using Named = std::map<std::string, std::string>;  // of a coordinate: its name in the reference

/// The largest difference from a reference until `end`, of the coordinates named.
double difference(const std::string& reference, const std::string& method, const phs::Model& model,
                  const phs::State& start, double h, const Named& names, double end) {
  const phs::Description& d = model.description();
  const auto integrator = integrators::make_integrator(method, model, h);
  phs::State s = start;
  double worst = 0;
  int seen = 0;
  const auto data = read_json(data_file("reference/" + reference + ".json"));
  for (const auto& out : data["outputs"]) {
    const auto number = [&](const std::string& key) {
      return std::strtold(out[key].get<std::string>().c_str(), nullptr);
    };
    const double t = double(number("t"));
    if (t > end) break;
    while (s.time(h) < t - h / 2)
      if (integrator->step(s) != integrators::Outcome::ok) return HUGE_VAL;
    EXPECT_NEAR(s.time(h), t, 1e-14);
    const auto x = scene::unwrapped(d, s);
    double most = 0;
    for (const auto& b : d.blocks)
      if (const auto name = names.find(b.name); name != names.end()) {
        most = std::max(most, double(std::fabs(x[size_t(b.at)] - number(name->second))));
        ++seen;
      }
    std::printf("  %s, %5.2f s: off by %.1e\n", reference.c_str(), t, most);
    worst = std::max(worst, most);
  }
  EXPECT_GE(seen, int(names.size()));
  return worst;
}

TEST(Iftomm, BricardAgainstItsEnergyIntegral) {
  auto l = bricard();
  const auto model = l.model();
  const phs::State start(model.description(), l.start());
  const auto error = [&](const std::string& method) {
    return difference("j_bricard", method, model, start, 1. / 64,
                      {{model.description().blocks[0].name, "angle"}}, 16);
  };
  EXPECT_LT(error("spark16"), 1e-13);
  EXPECT_GT(error("spark4"), 1e-9) << "the control";
}

double governor(const std::string& file, const std::string& reference, const Named& names,
                double step, double end, const std::string& method = {}) {
  const auto s =
      scene::read_scene(std::string(PORTHOS_SOURCE_DIR "/examples/governor/") + file + ".toml");
  const auto a = scene::assemble(s);
  return difference(reference, method.empty() ? s.method : method, *a.model, a.initial, step, names,
                    end);
}

const Named rods{{"shaft", "shaft"}, {"right", "rod"}, {"left", "rod"}};

TEST(Iftomm, GovernorWithRigidCouplersAgainstItsIntegrals) {
  EXPECT_LT(governor("scene", "j_governor_rigid", rods, 1. / 128, 10), 1e-12);
  EXPECT_GT(governor("scene", "j_governor_rigid", rods, 1. / 128, 10, "spark4"), 1e-8);
}

/// A05 from its published start, through the transient of the springs.
Named all() {
  Named names = rods;
  names["sleeve"] = "sleeve";
  return names;
}
TEST(Iftomm, StiffGovernorAgainstLagrangesEquations) {
  EXPECT_LT(governor("stiff", "j_governor_a05", all(), 1e-4, 0.5), 1e-12);
  EXPECT_GT(governor("stiff", "j_governor_a05", all(), 1e-4, 0.1, "gauss4"), 1e-9);
}
TEST(Iftomm, StiffGovernorForTenSecondsLONG) {
  if (!std::getenv("PORTHOS_LONG")) GTEST_SKIP();
  EXPECT_LT(governor("stiff", "j_governor_a05", all(), 1e-4, 10), 1e-12);
}

}  // namespace
}  // namespace porthos::test::iftomm_test
