// [[controller]] type = "motor_side": motors behind springs hold a link under gravity.
#include <fmt/format.h>

#include <cmath>

#include "scene/session/memory_run.h"
#include "tests/run/shipped.h"

namespace porthos::test::motor_side_scene_test {
namespace {

const std::string torque = "drive = \"torque\"\ncommand = { constant = 0 }";

/// A link with 1 kg m² about its hinge and m g l = 2 N m behind a spring of 100 N m/rad and a rotor
/// of 0.1 kg m². 0: hanging.
scene::Scene link(const TemporaryFolder& folder, const std::string& controller,
                  double duration = 20, const std::string& drive = torque,
                  const std::string& k = "100") {
  const double l = 2 / 9.81;
  write_bytes(
      folder / "link.urdf",
      fmt::format("<robot name='link'><link name='base'/><link name='rod'><inertial><origin "
                  "xyz='0 0 {:.17g}'/><mass value='1'/><inertia ixx='1' iyy='{:.17g}' "
                  "izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link><joint name='hinge' "
                  "type='continuous'><parent link='base'/><child link='rod'/><axis xyz='0 1 "
                  "0'/></joint></robot>",
                  -l, 1 - l * l));
  write_bytes(
      folder / "scene.toml",
      fmt::format(
          "[model]\nurdf = \"link.urdf\"\nbase = \"fixed\"\n[environment]\ngravity = \"uniform\"\n"
          "vector = [0, 0, -9.81]\n[[actuator]]\njoint = \"hinge\"\nname = \"spring\"\nfamily = "
          "\"series_elastic\"\nparameters = {{ k = {} }}\n[actuator.theta]\n{}\ninertia = 0.1\n"
          "[integrator]\nmethod = \"gauss8\"\nstep = 0.001\n[run]\n"
          "duration = {}\n{}",
          k, drive, duration, controller));
  return scene::read_scene((folder / "scene.toml").string());
}
std::string law(const std::string& keys, const std::string& more = "") {
  return "[[controller]]\ntype = \"motor_side\"\nname = \"law\"\n" + more +
         "joints.hinge = { target = 0.5, " + keys + " }\n";
}
const std::string gains = "stiffness = 60, damping = 2";

struct End {
  double q, theta, p, p_theta;
};
End end_of(const scene::Scene& s) {
  const auto a = scene::assemble(s);
  const auto r = scene::run_in_memory(s, a, {});
  EXPECT_TRUE(r.passed());
  const auto& x = r.final_state.x;  // q, p, link, theta, p_theta
  return {x[0], x[3], x[1], x[4]};
}

}  // namespace

TEST(MotorSideScene, ALinkComesToItsTargetAsTheReferenceRun) {
  // H_d above its least value after 1 and 5 s: 2.297 and 0.09451 J (reference run of the regulator
  // of Tomei 1991, RK4 of 0.5 ms, with these numbers).
  const double g = 2 * std::sin(0.5), theta_d = 0.5 + g / 100;
  const auto energy = [&](const End& e) {
    const auto V = [&](double q, double theta) {
      return -2 * std::cos(q) + 50 * (theta - q) * (theta - q) - g * theta +
             30 * (theta - theta_d) * (theta - theta_d);
    };
    return V(e.q, e.theta) - V(0.5, theta_d) + 0.5 * e.p * e.p + 5 * e.p_theta * e.p_theta;
  };
  for (const auto& [t, H] : {std::pair{1.0, 2.297}, {5.0, 0.09451}}) {
    TemporaryFolder folder;
    EXPECT_NEAR(energy(end_of(link(folder, law(gains), t))), H, 5e-4 * H) << t;
  }
  TemporaryFolder folder;
  const auto e = end_of(link(folder, law(gains), 40));
  EXPECT_NEAR(e.q, 0.5, 1e-6);
  EXPECT_NEAR(e.theta, theta_d, 1e-6);
  const auto sampled = end_of(link(folder, law(gains, "rate = 200\n"), 40));
  EXPECT_NEAR(sampled.q, 0.5, 1e-5);
  // Negative control: a position drive at the target sags by g/k + g/kp.
  const auto sagging = end_of(link(folder, "", 40,
                                   "drive = \"position\"\nkp = 60\nkd = 2\ncommand = { constant = "
                                   "0.5 }"));
  EXPECT_LT(sagging.q, 0.5 - 0.02);
}

TEST(MotorSideScene, ARateThatIsTooLowIsRefusedWithOneThatHolds) {
  TemporaryFolder folder;
  expect_named_rate_holds(
      [&](double rate) {
        return refusal(
            [&] { scene::assemble(link(folder, law(gains, fmt::format("rate = {}\n", rate)))); });
      },
      4);
  // Beside an element, which the law does not know, it is told.
  const auto a = scene::assemble(link(
      folder, "[[element]]\njoint = \"hinge\"\ntype = \"damper\"\nname = \"d\"\ndamping = 0.1\n" +
                  law(gains, "rate = 4\n")));
  EXPECT_NE(a.certificates.at(0).item("sampled").text.find("without the elements"),
            std::string::npos);
  EXPECT_FALSE(scene::assemble(link(folder, law(gains))).certificates.at(0).has("sampled"))
      << "control: continuous";
}

TEST(MotorSideScene, RefusalsSayWhereAndWhat) {
  const auto says = [](const std::string& controller, const std::string& part,
                       const std::string& drive = torque, const std::string& k = "100") {
    TemporaryFolder folder;
    std::string told;
    try {
      (void)scene::assemble(link(folder, controller, 1, drive, k));
    } catch (const InvalidArgument& e) {
      told = e.what();
    }
    EXPECT_NE(told.find(part), std::string::npos) << told;
    EXPECT_NE(told.find("scene.toml:"), std::string::npos) << told;
  };
  says(law("stiffness = 0, damping = 1"), "above 0");
  says(law(gains), "drive = \"torque\" at theta",
       "drive = \"position\"\nkp = 1\nkd = 1\ncommand = { constant = 0 }");
  // Upright, a soft motor cannot hold: K and Kp in series 1.9 N m/rad against m g l = 2.
  const std::string upright =
      "[[controller]]\ntype = \"motor_side\"\nname = \"law\"\njoints.hinge = { target = "
      "3.141592653589793, stiffness = {}, damping = 2 }\n";
  const auto with = [&](const std::string& kp) {
    std::string text = upright;
    return text.replace(text.find("{}"), 2, kp);
  };
  says(with("1.93"), "Hessian of H_d > 0");
  TemporaryFolder folder;
  EXPECT_NO_THROW((void)scene::assemble(link(folder, with("2.1"), 1)));
}

}  // namespace porthos::test::motor_side_scene_test
