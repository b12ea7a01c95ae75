// Scenes with [[controller]]: each type reaches its target, its power is in the ledger, its
// certificate in the summary; resumed, through events and in orbit; and what is refused.
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "integrators/core/integrator.h"
#include "scene/session/memory_run.h"
#include "tests/run/shipped.h"

namespace porthos::test::controller_scene_test {
namespace {

constexpr const char* head =
    "[environment]\ngravity = \"uniform\"\nvector = [0, 0, -9.81]\n[integrator]\nmethod = "
    "\"gauss8\"\nstep = 0.005\n[run]\nduration = 20\n";

/// Two rods under gravity; `start` after [initial].
scene::Scene arm(const TemporaryFolder& folder, const std::string& start, const std::string& more,
                 const std::string& body = head) {
  const fs::path example = fs::path(PORTHOS_SOURCE_DIR) / "examples/double_pendulum";
  write_bytes(folder / "arm.urdf", read_bytes(example / "double_pendulum.urdf"));
  write_bytes(folder / "scene.toml", "[model]\nurdf = \"arm.urdf\"\nbase = \"fixed\"\n[initial]\n" +
                                         start + "\n" + body + more);
  return scene::read_scene((folder / "scene.toml").string());
}
const std::string bent = "joints.shoulder = { position = 0.5 }\njoints.elbow = { position = 0.6 }";

scene::RunReport run_of(const scene::Scene& s) {
  return scene::run_in_memory(s, scene::assemble(s), {});
}
double at_end(const scene::Scene& s, const scene::RunReport& r, const std::string& joint) {
  const auto a = scene::assemble(s);
  for (const auto& c : a.mechanism->coordinates())
    if (c.name == joint) return r.final_state.x[size_t(c.q)];
  return NAN;
}
std::string refusal(const std::string& start, const std::string& more,
                    const std::string& body = head) {
  TemporaryFolder folder;
  try {
    (void)scene::assemble(arm(folder, start, more, body));
  } catch (const InvalidArgument& e) {
    return e.what();
  }
  return "";
}
std::string controller(const std::string& type, const std::string& keys) {
  return "[[controller]]\ntype = \"" + type + "\"\nname = \"law\"\n" + keys + "\n";
}
const std::string springs =
    "joints.shoulder = { target = 1, stiffness = 20, damping = 20 }\n"
    "joints.elbow = { target = -0.4, stiffness = 20, damping = 10 }\n";

}  // namespace

TEST(ControllerScene, TheShippedSlewPassesItsVerdictAndArrives) {
  TemporaryFolder folder;
  const auto s = shipped(folder, "slew");
  const auto r = run_of(s);
  EXPECT_TRUE(r.passed());
  const auto certificate = scene::assemble(s).certificates.at(0);
  EXPECT_TRUE(certificate.text().ends_with("  all conditions hold\n")) << "wheels are to turn";
  EXPECT_TRUE(says(certificate.item("directions without stiffness").text, "wheel_x"));
  EXPECT_NEAR(std::fabs(at_end(s, r, "base.attitude")), 1, 1e-14);  // measured 2e-16
  EXPECT_NEAR(at_end(s, r, "shoulder"), 1, 1e-12);                  // 0
  EXPECT_NEAR(at_end(s, r, "elbow"), -0.5, 1e-12);                  // 0
  EXPECT_GT(std::fabs(entry_of(r.ports, "attitude.wheel_x.torque")), 100);
  EXPECT_GT(std::fabs(entry_of(r.ports, "attitude.wheel_x.torque.hold")), 1e-6);
  // Negative control: without the controller it goes on turning.
  const auto text = read_bytes(folder / "scene.toml");
  const auto from = text.find("[[controller]]"), to = text.find("[integrator]");
  write_bytes(folder / "scene.toml", text.substr(0, from) + text.substr(to));
  const auto loose = scene::read_scene((folder / "scene.toml").string());
  EXPECT_LT(std::fabs(at_end(loose, run_of(loose), "base.attitude")), 0.99);
}

/// A law that is held too long is refused before it throws the craft about. Control: a rate with
/// which it would do.
TEST(ControllerScene, AnAttitudeLawThatIsHeldTooLongIsRefused) {
  TemporaryFolder folder;
  const auto at = [&](const char* rate) {
    const auto s = shipped(folder, "slew", 20,
                           {{"rate = 10.0", std::string("rate = ") + rate},
                            {"damping = [90.0, 90.0, 90.0]", "damping = [3000.0, 90.0, 90.0]"}});
    return run_of(s);
  };
  std::string why;
  try {
    (void)at("2.0");
  } catch (const InvalidArgument& e) {
    why = e.what();
  }
  EXPECT_TRUE(says(why, "sampled fails: "));
  EXPECT_TRUE(says(why, "at rate = 2 Hz the damping 3000 N m s/rad about x acts on "));
  EXPECT_TRUE(says(why, "Hz or more"));
  const auto held = at("10.0");
  EXPECT_EQ(held.outcome, integrators::Outcome::ok);
}

TEST(ControllerScene, APotentialHoldsJointsAgainstGravityInEachWay) {
  for (const auto& [gravity, arrives] :
       {std::pair{"compensate", true}, {"constant", true}, {"keep", false}}) {
    TemporaryFolder folder;
    const std::string keys = springs + "gravity = \"" + gravity + "\"\n";
    if (!arrives) {  // 1 rad is no minimum of gravity and spring together
      EXPECT_NE(refusal(bent, controller("potential", keys)).find("rest point"), std::string::npos);
      continue;
    }
    const auto s = arm(folder, bent, controller("potential", keys));
    const auto r = run_of(s);
    EXPECT_TRUE(r.passed()) << gravity;
    EXPECT_NEAR(at_end(s, r, "shoulder"), 1, 1e-6) << gravity;
    EXPECT_NEAR(at_end(s, r, "elbow"), -0.4, 1e-6) << gravity;
  }
}

// What a rod moves about its hinge is I + m/4; about the shoulder both, at the elbow's target.
TEST(ControllerScene, ABandwidthMakesTheGains) {
  const double rod = 0.08343333333333333 + 0.25, both = 2 * rod + 1 + std::cos(-0.4);
  TemporaryFolder folder;
  const std::string wanted =
      "joints.shoulder = { target = 1, bandwidth = 4, damping_ratio = 0.7 }\n"
      "joints.elbow = { target = -0.4, bandwidth = 5 }\n";
  const auto s = arm(folder, bent, controller("potential", wanted));
  const auto a = scene::assemble(s);
  const auto& c = a.certificates.at(0);
  EXPECT_NEAR(c.item("stiffness of shoulder").value, 16 * both, 1e-13);
  EXPECT_NEAR(c.item("stiffness of shoulder").numbers.at(0), 2 * 0.7 * 4 * both, 1e-13);
  EXPECT_NEAR(c.item("stiffness of elbow").value, 25 * rod, 1e-14);
  EXPECT_NEAR(c.item("stiffness of elbow").numbers.at(0), 2 * 5 * rod, 1e-14);
  const auto r = run_of(s);
  EXPECT_TRUE(r.passed());
  EXPECT_NEAR(at_end(s, r, "shoulder"), 1, 1e-12);
  const auto stated = fmt::format(
      "joints.shoulder = {{ target = 1, stiffness = {}, damping = {} }}\n"
      "joints.elbow = {{ target = -0.4, stiffness = {}, damping = {} }}\n",
      16 * both, 2 * 0.7 * 4 * both, 25 * rod, 2 * 5 * rod);
  const auto same = arm(folder, bent, controller("potential", stated));
  EXPECT_NEAR(at_end(same, run_of(same), "elbow"), at_end(s, r, "elbow"), 1e-13);

  const std::string motion =
      "law = \"computed_torque\"\nover = 3\njoints.shoulder = { target = 2, bandwidth = 6 }\n"
      "joints.elbow = { target = -1, bandwidth = 6, damping_ratio = 2 }\n";
  const auto t = scene::assemble(arm(folder, bent, controller("tracking", motion)));
  EXPECT_EQ(t.certificates.at(0).item("stiffness of elbow").value, 36);
  EXPECT_EQ(t.certificates.at(0).item("stiffness of elbow").numbers.at(0), 24);

  const auto says = [](const std::string& keys, const std::string& part) {
    const auto text = refusal(bent, controller("potential", keys));
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  says("joints.elbow = { target = 0, bandwidth = 5, stiffness = 1 }",
       "stiffness is given besides bandwidth, expected one of both");
  says("joints.elbow = { target = 0, damping_ratio = 5 }",
       "damping_ratio is given without bandwidth, expected both");
}

TEST(ControllerScene, ATargetThatIsNotStatedIsTheStart) {
  TemporaryFolder folder;
  const auto end = [&](const std::string& shoulder, const std::string& elbow) {
    const auto keys = fmt::format(
        "joints.shoulder = {{ {}stiffness = 300, damping = 9 }}\n"
        "joints.elbow = {{ {}stiffness = 300, damping = 9 }}\n",
        shoulder, elbow);
    return run_of(arm(folder, bent, controller("potential", keys))).final_state.x;
  };
  EXPECT_EQ(end("", ""), end("target = 0.5, ", "target = 0.6, "));
  EXPECT_NE(end("", ""), end("target = 0.5, ", "target = 0.7, "));  // control
}

/// The lower rod hangs where shoulder and elbow are opposite; it starts beside that rest. Controls:
/// without its target its rest is its start, where it leans; and it makes no spring and no damper.
TEST(ControllerScene, AJointWithoutActuatorHasARestBesideItsStart) {
  const std::string driven =
      "gravity = \"constant\"\njoints.shoulder = { target = 0.5, stiffness = 60, damping = 9 }\n";
  TemporaryFolder folder;
  const auto s = arm(folder, bent,
                     controller("potential", driven + "joints.elbow = { target = -0.5, actuated = "
                                                      "false }\n"));
  const auto r = run_of(s);
  EXPECT_TRUE(r.passed());
  EXPECT_NEAR(at_end(s, r, "shoulder"), 0.5, 0.02);
  EXPECT_NEAR(at_end(s, r, "elbow"), -0.5, 0.2);  // still swings; it began 1.1 away
  const auto told = [&](const std::string& elbow) {
    return refusal(bent, controller("potential", driven + elbow));
  };
  for (const char* start : {"", "joints.elbow.actuated = false\n"})
    EXPECT_TRUE(says(told(start),
                     "choose a rest at which it hangs (that of a scene's joint is its start unless "
                     "it is named, with a target and actuated = false)"));
  for (const std::string key : {"stiffness", "damping", "bandwidth", "limit"})
    EXPECT_TRUE(says(told("joints.elbow = { target = -0.5, actuated = false, " + key + " = 1 }"),
                     key + " is given with actuated = false, expected a target alone"));
  EXPECT_TRUE(says(told("joints.knee.actuated = false"), "no joint 'knee'"));
}

TEST(ControllerScene, AHandIsHeldWhereTheSceneWantsIt) {
  TemporaryFolder folder;
  const auto s = arm(
      folder, bent,
      controller("potential",
                 "joints.shoulder.damping = 9\njoints.elbow.damping = 9\nposes.lower = { point = "
                 "[0, 0, -1], stiffness = 60, position = [-0.9, 0, -0.8] }"));
  const auto r = run_of(s);
  const double a = at_end(s, r, "shoulder"), b = at_end(s, r, "elbow");
  EXPECT_NEAR(-std::sin(a) - std::sin(a + b), -0.9, 1e-9);  // rods of 1 m about y
  EXPECT_NEAR(-std::cos(a) - std::cos(a + b), -0.8, 1e-9);
}

/// An elbow without actuator and gravity. Controls: with gravity kept, a spring there, or one more
/// controller at it.
TEST(ControllerScene, AJointThatNothingHoldsIsTold) {
  const auto told = [](const std::string& gravity, const std::string& more) {
    TemporaryFolder folder;
    const auto s = arm(
        folder, "joints.elbow.position = 0",
        controller("potential", "joints.shoulder = { target = 0, stiffness = 20 }\n" + gravity) +
            more,
        gravity.empty() ? "[integrator]\nmethod = \"gauss8\"\nstep = 0.005\n"
                          "[run]\nduration = 1\n"
                        : head);
    std::string all;
    for (const auto& remark : scene::assemble(s).remarks) all += remark;
    return all;
  };
  EXPECT_TRUE(says(told("", ""),
                   "scene.toml:11:1: nothing holds joint 'elbow': no actuator, spring "
                   "or gravity acts there, so it drifts"));
  EXPECT_EQ(told("gravity = \"keep\"\n", ""), "");
  EXPECT_EQ(told("",
                 "[[element]]\ntype = \"spring\"\nname = \"own\"\njoint = \"elbow\"\n"
                 "stiffness = 1\n"),
            "");
  EXPECT_EQ(told("",
                 "[[controller]]\ntype = \"potential\"\nname = \"other\"\n"
                 "joints.elbow = { target = 0, stiffness = 1 }\n"),
            "");
}

/// The springs of poses have the same rest; the rods turn about y.
TEST(ControllerScene, AnAttitudeHalfATurnFromTheStartIsTold) {
  TemporaryFolder folder;
  const auto told = [&](double elbow) {
    const auto s =
        arm(folder, fmt::format("joints.shoulder.position = 1\njoints.elbow.position = {}", elbow),
            controller("potential", springs + "poses.lower = { attitude_stiffness = [1, 2, 3], "
                                              "attitude_wxyz = [1, 0, 0, 0] }\n"));
    std::string all;
    for (const auto& remark : scene::assemble(s).remarks) all += remark;
    return all;
  };
  EXPECT_TRUE(says(told(M_PI - 1.05),
                   "scene.toml:15:1: the attitude of 'lower' is a half turn from the start, where "
                   "its torque is zero: it begins late or never"));
  EXPECT_EQ(told(M_PI - 1.1), "") << "control: 174 degrees";
}

TEST(ControllerScene, BothTrackingLawsFollowAMotion) {
  for (const std::string law : {"pd_plus", "computed_torque"}) {
    TemporaryFolder folder;
    const std::string gains = "kp = 30, kd = 15";
    const auto s = arm(
        folder, bent,
        controller("tracking", "law = \"" + law + "\"\nover = 3\njoints.shoulder = { target = 2, " +
                                   gains + " }\njoints.elbow = { target = -1, " + gains + " }\n"));
    const auto r = run_of(s);
    EXPECT_TRUE(r.passed()) << law;
    EXPECT_NEAR(at_end(s, r, "shoulder"), 2, 1e-12) << law;  // measured 0
    EXPECT_NEAR(at_end(s, r, "elbow"), -1, 1e-12) << law;    // 2e-16
  }
}

TEST(ControllerScene, AnLqrBalancesAnAcrobotWhichFallsWithoutIt) {
  TemporaryFolder folder;
  const std::string near_top = "joints.shoulder = { position = 3.12 }",
                    law = controller("lqr",
                                     "joints.shoulder = { target = 3.141592653589793, position = "
                                     "10, speed = 1, actuated = false }\njoints.elbow = { target = "
                                     "0, position = 10, speed = 1, effort = 0.1 }");
  const auto s = arm(folder, near_top, law);
  const auto r = run_of(s);
  EXPECT_TRUE(r.passed());
  const double pi = std::acos(-1.0), from_top = at_end(s, r, "shoulder") - pi;
  EXPECT_NEAR(std::remainder(from_top, 2 * pi), 0, 1e-12);  // measured 2e-15
  EXPECT_NEAR(at_end(s, r, "elbow"), 0, 1e-12);             // 7e-15
  // Its potential energy is that of the top: what was supplied is what it rose, ½ g (1 - cos) 4 m.
  EXPECT_NEAR(entry_of(r.ports, "law"), 9.81 * 2 * (1 + std::cos(3.12)), 1e-12);
  EXPECT_NE(refusal(near_top, controller("lqr",
                                         "joints.shoulder = { target = 1, position = 1, actuated = "
                                         "false }\njoints.elbow.target = 0"))
                .find("force without actuator"),
            std::string::npos);
}

/// A cart-pole that stands at 0.6 rad from upright, under IDA-PBC.
scene::Scene cart_pole(const TemporaryFolder& folder, const std::string& keys) {
  const fs::path example = fs::path(PORTHOS_SOURCE_DIR) / "examples/cart_pole_plan";
  write_bytes(folder / "arm.urdf", read_bytes(example / "cart_pole.urdf"));
  write_bytes(
      folder / "scene.toml",
      "[model]\nurdf = \"arm.urdf\"\nbase = \"fixed\"\n[initial]\njoints.hinge = { position "
      "= 2.54 }\n" +
          std::string(head) + controller("ida_pbc", keys));
  return scene::read_scene((folder / "scene.toml").string());
}

TEST(ControllerScene, IdaPbcBringsACartPoleUprightAndTheCartToItsPlace) {
  const std::string keys =
      "design = \"cart_pole\"\ndrives = \"slide\"\njoints.slide = { target = 1.0 }\n"
      "joints.hinge = { target = 3.141592653589793 }\n"
      "gains = { k = 1.0, m22 = 0.1, P = 1.0, kv = 3.0 }\n";
  for (const std::string rate : {"", "rate = 200\n"}) {
    TemporaryFolder folder;
    const auto s = cart_pole(folder, keys + rate);
    const auto r = run_of(s);
    EXPECT_TRUE(r.passed());
    EXPECT_NEAR(at_end(s, r, "hinge"), std::acos(-1.0), 1e-4) << rate;  // measured 3e-5
    EXPECT_NEAR(at_end(s, r, "slide"), 1, 0.02) << rate;                // 0.01
    const auto certificate = scene::assemble(s).certificates.at(0);
    ASSERT_EQ(certificate.has("sampled"), !rate.empty());
    if (!rate.empty()) {
      const auto& sampled = certificate.item("sampled");
      EXPECT_TRUE(sampled.value > 0.9 && sampled.value < 1) << sampled.value;
      EXPECT_NE(sampled.text.find("below 1 small motions die out"), std::string::npos);
    }
  }
  const auto refused = [&](const std::string& from, const std::string& to,
                           const std::string& part) {
    TemporaryFolder folder;
    std::string text = keys, told;
    text.replace(text.find(from), from.size(), to);
    try {
      (void)scene::assemble(cart_pole(folder, text));
    } catch (const InvalidArgument& e) {
      told = e.what();
    }
    EXPECT_NE(told.find(part), std::string::npos) << told;
    EXPECT_NE(told.find("scene.toml:"), std::string::npos) << told;
  };
  refused("gains", "rate = 2.0\ngains", "sampled fails: ");
  refused("\"cart_pole\"", "\"pendubot\"", "design is \"pendubot\", expected");
  refused("\"cart_pole\"", "\"vtol\"", "drives is no key of design = \"vtol\"");
  refused("kv = 3.0", "kv = 3.0, ku = 1.0", "is no gain of design = \"cart_pole\"");
  refused("m22 = 0.1, ", "", "m22");
  refused("P = 1.0", "P = -1.0", "k, m22, P > 0");
  refused("3.141592653589793", "0.0",
          "'hinge' hangs at its target, expected the upright; likely cause: the target of 'hinge'");
  refused(
      "target = 1.0", "target = 1.0, limit = 2.0",
      "unknown key 'limit' in joints.slide, expected it in [[controller]] itself (known: target)");
  refused("target = 1.0", "target = 1.0, limt = 2.0", "nearest known one is 'target'");
  refused("\"slide\"", "\"hinge\"", "likely cause: drives = \"hinge\", which may be \"slide\"");
}

TEST(ControllerScene, TheCertificateIsInTheSummaryAndAResumedRunHasTheSameBits) {
  TemporaryFolder folder;
  const auto s = arm(folder, bent, controller("potential", springs + "rate = 100\n"));
  const auto a = scene::assemble(s);
  const auto whole = scene::run(s, a, into(folder / "whole"));
  auto half = into(folder / "half");
  for (const std::int64_t at : {1003, 2222}) {  // 1003 is between two samples
    half.stop_at = at;
    EXPECT_TRUE(scene::run(s, a, half).interrupted);
    half.resume = true;
  }
  const auto rest = scene::run(s, a, into(folder / "half", true));
  EXPECT_EQ(whole.final_state, rest.final_state);
  EXPECT_EQ(whole.held, rest.held);
  const auto j = nlohmann::json::parse(read_bytes(folder / "whole/summary.json"));
  ASSERT_EQ(j["certificates"].size(), 1u);
  EXPECT_TRUE(j["certificates"][0]["holds"]);
}

TEST(ControllerScene, RefusalsSayWhereAndWhat) {
  const auto says = [](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
    EXPECT_NE(text.find("scene.toml:"), std::string::npos) << text;
  };
  says(refusal(bent, controller("potential", "joints.knee.damping = 1")),
       "no joint 'knee' of one degree of freedom");
  says(refusal(bent, controller("potential", "gravity = \"keep\"")), "names no actuated joint");
  says(refusal(bent, controller("potential", "joints.elbow = { target = 0, stiffness = 9 }")),
       "force without actuator");  // gravity at the shoulder, which has no actuator
  says(refusal(bent, controller("tracking", "over = 1\njoints.elbow = { kp = 1, kd = 1 }")),
       "no gains for joint 'shoulder'");
  says(refusal(bent, controller("lqr", "joints.elbow.actuated = false")), "no actuated joint");
  says(refusal(bent, controller("potential", springs) + controller("potential", springs)),
       "that of another controller");
  says(refusal(bent, controller("wheels", springs)), "type is \"wheels\", expected");
  says(refusal(bent, controller("wheel_attitude",
                                "link = \"upper\"\nwheels = [\"elbow\"]\nstiffness = [1, 1, 1]\n"
                                "damping = [1, 1, 1]")),
       "free base");
}

}  // namespace porthos::test::controller_scene_test
