// Goals on distances and positions, their derivatives, and the planned capture of a target.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "planning/planner.h"
#include "scene/plan/plan.h"
#include "scene/session/memory_run.h"
#include "tests/places.h"
#include "tests/support/bounds.h"

namespace porthos::planning::capture_test {
namespace {

namespace fs = std::filesystem;
using scene::read_scene;
using scene::Scene;

/// A point in the plane by two forces, x = (place, velocity).
std::shared_ptr<Dynamics> point_mass() {
  return function_dynamics(4, 2, [](auto, auto x, auto u, auto dx) {
    dx[0] = x[2];
    dx[1] = x[3];
    dx[2] = u[0] - 0.1 * x[2];
    dx[3] = u[1] - 0.1 * x[3];
  });
}

/// The distance from a point that moves with time.
std::shared_ptr<PathNumber> gap() {
  return path_number(4, [](double t, auto x) {
    using std::sqrt;
    const auto a = x[0] - 2.0 - 0.5 * t, b = x[1] - 1.0;
    return sqrt(a * a + b * b);
  });
}

}  // namespace

TEST(Capture, RatesOfNumbers) {
  const auto rate = rate_of(gap(), point_mass());
  const std::vector<double> x{0.4, 0.3, 0.7, -0.2};
  const double t = 0.6, a = x[0] - 2 - 0.5 * t, b = x[1] - 1, d = std::hypot(a, b);
  test::keeps("against the closed form [m/s]",
              std::fabs(rate->value(t, x) - (a * (x[2] - 0.5) + b * x[3]) / d), 1e-11);
  std::vector<double> g(4), moved(x);
  rate->gradient(t, x, g);
  double off = std::max(std::fabs(g[2] - a / d), std::fabs(g[3] - b / d));
  const double c = (a * (x[2] - 0.5) + b * x[3]) / d;  // ∇²c v = (v - (v·n) n)/d
  off = std::max({off, std::fabs(g[0] - (x[2] - 0.5 - c * a / d) / d),
                  std::fabs(g[1] - (x[3] - c * b / d) / d)});
  test::keeps("gradient against the closed form", off, 1e-11);
  EXPECT_THROW((void)rate_of(nullptr, point_mass()), InvalidArgument);
}

/// A point that shall end on a circle with the least force, and not leave it: it goes straight out
/// and stops. Control: without the goal on the rate it does not stop.
TEST(Capture, APointReachesACircle) {
  const auto reach = [](bool stops) {
    Problem p;
    p.dynamics = function_dynamics(4, 2, [](auto, auto x, auto u, auto dx) {
      dx[0] = x[2];
      dx[1] = x[3];
      dx[2] = u[0];
      dx[3] = u[1];
    });
    p.duration = 2;
    p.intervals = 10;
    p.start = {0.01, 0, 0, 0};
    p.cost.input = {1, 1};
    const auto radius = path_number(4, [](double, auto x) {
      using std::sqrt;
      return sqrt(x[0] * x[0] + x[1] * x[1]);
    });
    p.goals.push_back({{}, -1, 1.31, radius});
    if (stops) p.goals.push_back({{}, -1, 0, rate_of(radius, p.dynamics)});
    return solve(p, straight(p, {1, 0.3, 0, 0}));
  };
  const Plan stopped = reach(true), free = reach(false);
  ASSERT_TRUE(stopped.status == Plan::Status::optimal && free.status == Plan::Status::optimal);
  // 12 θ²/(T³ (1 - 1/N²)) of rest to rest; a free end costs 3 θ²/T³ with torques that are held
  const double expected = 12 * 1.3 * 1.3 / (8 * (1 - 1.0 / 100));
  test::keeps("cost against rest to rest", std::fabs(stopped.cost - expected), 1e-8);
  test::breaks("without the goal on the rate", std::fabs(free.cost - expected), 1);
}

/// The example's plan, its replay, and the capture after it: the latch loses nothing. Control:
/// without goals on rates it does.
TEST(Capture, OfATumblingTarget) {
  const auto folder =
      fs::path(testing::TempDir()) / ("porthos_capture_" + std::to_string(getpid()));
  fs::create_directories(folder);
  const std::string examples = PORTHOS_SOURCE_DIR "/examples/";
  std::ifstream file(examples + "capture_plan/scene.toml");
  std::string text{std::istreambuf_iterator<char>(file), {}};
  const std::string urdf = "../capture/servicer.urdf";
  text.replace(text.find(urdf), urdf.size(), examples + "capture/servicer.urdf");
  const auto caught = [&](const std::string& words, const std::string& name) {
    std::ofstream(folder / (name + ".toml")) << words;
    const Scene s = read_scene((folder / (name + ".toml")).string());
    const auto r = scene::plan(s, scene::assemble(s), (folder / name).string());
    EXPECT_EQ(r.plan.status, Plan::Status::optimal);
    test::keeps("replay against the plan", r.replay, 1e-9);
    std::ofstream(folder / name / "replay.toml", std::ios::app)
        << "\n[[event]]\nat = 40.0\ntype = \"capture\"\nbody = \"target\"\nlink = \"hand\"\n"
           "on_body = [-0.6, 0, 0]\non_link = [0.2, 0, 0]\nreach = 1e-3\nspeed = 1\nrate = 1\n";
    Scene after = read_scene((folder / name / "replay.toml").string());
    scene::apply(after, {.duration = 60});
    return scene::run_in_memory(after, scene::assemble(after), {});
  };
  const auto r = caught(text, "matched");
  EXPECT_TRUE(r.passed());
  EXPECT_EQ(r.phases, 2);
  test::keeps("the latch loses [J]", r.dissipated_J, 1e-20);
  for (size_t at; (at = text.find(", rate = 0.0")) != text.npos;) text.erase(at, 12);
  test::breaks("without goals on rates [J]", caught(text, "met").dissipated_J, 1e-5);
  fs::remove_all(folder);
}

}  // namespace porthos::planning::capture_test
