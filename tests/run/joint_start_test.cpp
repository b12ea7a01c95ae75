// Starts of joints of several freedoms, from the scene to the motion.
#include <nlohmann/json.hpp>

#include "integrators/core/integrator.h"
#include "mechanics/rotation.h"
#include "tests/places.h"
#include "tests/run/scenes.h"

namespace porthos::test::joint_start_test {
namespace {

using scene::Assembly;
using scene::Scene;

/// The scene's top against the reference solution: attitude as a matrix.
TEST(JointStart, TheTopOfTheExampleIsTheReference) {
  const Scene s =
      scene::read_scene(std::string(PORTHOS_SOURCE_DIR) + "/examples/lagrange_top/scene.toml");
  const Assembly a = scene::assemble(s);
  std::ifstream in(std::string(PORTHOS_SOURCE_DIR) + "/tests/data/reference/c_lagrange_top.json");
  const auto reference = nlohmann::json::parse(in);
  const auto method = scene::make_integrator(s, *a.model, s.step);
  phs::State x = a.initial;
  // Measured: 0, 1.1e-15, 2.0e-14, 1.5e-13.
  const double bounds[] = {4e-16, 1e-14, 1e-13, 5e-13};
  double control = 0;
  for (size_t k = 0; k < 4; ++k) {
    const double t = std::stod(reference["times"][k].get<std::string>());
    while (double(x.step) * s.step < t) ASSERT_EQ(method->step(x), integrators::Outcome::ok);
    const auto R = mechanics::rotation_matrix(mechanics::Quaternion<double>::load(x.x.data()));
    const double ours[] = {R.x.x, R.y.x, R.z.x, R.x.y, R.y.y, R.z.y, R.x.z, R.y.z, R.z.z};
    double error = 0;
    for (size_t i = 0; i < 9; ++i) {
      const double wanted = std::stod(reference["outputs"][k]["group1"][i].get<std::string>());
      error = std::max(error, std::fabs(ours[i] - wanted));
      control = std::max(control, std::fabs(wanted - (i % 4 == 0)));  // the neutral attitude
    }
    std::printf("t = %g s: attitude off by %.1e, at most %.1e expected\n", t, error, bounds[k]);
    EXPECT_LT(error, bounds[k]) << t;
  }
  EXPECT_GT(control, 1);
}

std::string one_joint(const std::string& type) {
  return "<robot name='r'><link name='base'/>" + link("body", 2) + "<joint name='j' type='" + type +
         "'><parent link='base'/><child link='body'/><origin xyz='1 2 3'/></joint></robot>";
}
Assembly with(const std::string& type, const std::string& initial,
              const std::string& model = "base = \"fixed\"\n") {
  const std::string text = "[model]\nurdf = \"r.urdf\"\n" + model + "[initial]\n" + initial +
                           "\n[integrator]\nstep = 0.1\n[run]\nduration = 1\n";
  TemporaryFolder folder;
  write_bytes(folder / "r.urdf", one_joint(type));
  write_bytes(folder / "s.toml", text);
  return scene::assemble(scene::read_scene((folder / "s.toml").string()));
}
std::string refusal(const std::string& type, const std::string& initial,
                    const std::string& model = "base = \"fixed\"\n") {
  try {
    with(type, initial, model);
  } catch (const InvalidArgument& e) {
    const std::string text = e.what();
    return text.substr(text.find("[initial]") == text.npos ? 0 : text.find("[initial]"));
  }
  return "(accepted)";
}
std::vector<double> rates(const Assembly& a) { return a.mechanical->rates(a.initial.x); }

TEST(JointStart, BallAndFreeJoints) {
  const Assembly ball = with(
      "spherical", "joints.j = { attitude_wxyz = [0, 0, 0, 2], angular_velocity = [1, 2, 3] }");
  EXPECT_EQ(ball.initial.x[3], 1);  // normalised
  const auto w = rates(ball);
  for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(w[k], double(k + 1), 1e-14);
  // Half a turn about z: velocities along x and y are the other way in the child's axes.
  const Assembly moving = with("floating",
                               "joints.j = { position = [4, 5, 6], attitude_wxyz = [0, 0, 0, 1], "
                               "linear_velocity = [1, 2, 3] }");
  EXPECT_EQ(moving.initial.x[0], 4);
  const auto v = rates(moving);
  EXPECT_NEAR(v[3], -1, 1e-14);
  EXPECT_NEAR(v[4], -2, 1e-14);
  EXPECT_NEAR(v[5], 3, 1e-14);
}

TEST(JointStart, JointsOfSeveralNumbersAreNamedByCoordinate) {
  const Assembly a = with("cylindrical",
                          "joints.\"j.angle\".position = 0.5\n"
                          "joints.\"j.slide\".velocity = 2");
  EXPECT_EQ(a.initial.x[0], 0.5);
  EXPECT_NEAR(rates(a)[1], 2, 1e-15);
  EXPECT_EQ(with("planar", "joints.\"j.x\".position = 1").initial.x.size(), 6u);
  EXPECT_EQ(
      refusal("cylindrical", "joints.j.position = 1"),
      "[initial] joints.j: it has several degrees of freedom, expected each of them by its name: "
      "j.angle, j.slide");
}

TEST(JointStart, Refusals) {
  EXPECT_EQ(refusal("spherical", "joints.j.position = 1"),
            "[initial] joints.j: it is a joint that turns freely, expected attitude_wxyz and "
            "angular_velocity");
  EXPECT_EQ(refusal("spherical", "joints.j = { position = [1, 0, 0] }"),
            "[initial] joints.j: it is a ball joint, expected no position and no linear_velocity");
  EXPECT_EQ(refusal("revolute", "joints.j.angular_velocity = [0, 0, 1]"),
            "[initial] joints.j: it has one degree of freedom, expected position and velocity");
  EXPECT_EQ(refusal("spherical", "joints.k.angular_velocity = [0, 0, 1]"),
            "[initial] joints.k: the model has no joint of this name, expected one of: j");
  EXPECT_NE(refusal("spherical", "joints.j = { angular_velocity = [0, 0, 1], velocity = 1 }")
                .find("velocity is given to a joint of several degrees of freedom, expected "
                      "linear_velocity "
                      "or angular_velocity"),
            std::string::npos);
}

TEST(JointStart, LockedJoints) {
  const std::string lock =
      "base = \"free\"\nlock = [\"j\"]\ninertia.base = { mass = 1, inertia = "
      "[1, 1, 1, 0, 0, 0] }\n";
  const Assembly a = with("revolute", "joints.j.position = 0.5", lock);
  EXPECT_EQ(a.mechanism->nv(), 6);
  EXPECT_NEAR(a.mechanism->body("body").pose.R.y.z, std::sin(0.5), 1e-15);
  EXPECT_EQ(with("spherical", "joints.j.attitude_wxyz = [1, 1, 0, 0]", lock).mechanism->nv(), 6);
  EXPECT_EQ(with("floating", "joints.j.position = [1, 0, 0]", lock).mechanism->nv(), 6);
  EXPECT_EQ(refusal("revolute", "joints.j.velocity = 1", lock),
            "[initial] joints.j: the joint is locked, expected no velocity");
}

/// The two ways out stand in the refusal, and both are ways out.
TEST(JointStart, AMasslessLinkIsRefusedWithTheWaysOut) {
  std::string fixed = "base = \"fixed\"\n";
  const auto text = [&](const std::string& more) {
    TemporaryFolder folder;
    write_bytes(folder / "r.urdf", "<robot name='r'><link name='base'/>" + link("body", 2) +
                                       "<link name='tip'/>" + joint("j", "base", "body", "1 0 0") +
                                       joint("k", "body", "tip", "1 0 0") + "</robot>");
    write_bytes(folder / "s.toml", "[model]\nurdf = \"r.urdf\"\n" + fixed + more +
                                       "[integrator]\nstep = 0.1\n[run]\nduration = 1\n");
    try {
      scene::assemble(scene::read_scene((folder / "s.toml").string()));
    } catch (const InvalidArgument& e) {
      const std::string what = e.what();
      return what.substr(what.find("r.urdf"));
    }
    return std::string("(accepted)");
  };
  EXPECT_EQ(text(""),
            "r.urdf:1: link 'tip' has no <inertial> and moves on joint 'k', expected mass "
            "properties or the joint locked: [model] lock = [\"k\"] holds the joint where it "
            "starts, or [model.inertia.tip] gives the link mass, or [model] links_without_inertia "
            "= \"massless\" if links with mass follow");
  EXPECT_EQ(text("lock = [\"k\"]\n"), "(accepted)");
  EXPECT_EQ(text("inertia.tip = { mass = 1, inertia = [1, 1, 1, 0, 0, 0] }\n"), "(accepted)");
  EXPECT_NE(text("links_without_inertia = \"massless\"\n").find("joint 'k' moves no inertia"),
            std::string::npos);
  fixed = "base = \"free\"\n";
  EXPECT_TRUE(says(text("lock = [\"k\"]\n"), "[model] base = \"fixed\" if it stands in the world"));
}

}  // namespace
}  // namespace porthos::test::joint_start_test
