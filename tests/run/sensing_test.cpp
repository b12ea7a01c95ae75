// Sampled controllers behind sensors: delay, resolution and noise against closed forms.
#include <algorithm>
#include <cmath>
#include <complex>

#include "scene/session/extension.h"
#include "scene/session/memory_run.h"
#include "tests/run/foreign_law.h"
#include "tests/run/shipped.h"

namespace porthos::test::sensing_test {
namespace {

constexpr double pi = 3.14159265358979323846;

/// A rod on a fixed axis without gravity, its inertia about the axis 0.5 kg m², sampled at 20 Hz by
/// a controller with the type and the keys `law`.
scene::Scene rod(const TemporaryFolder& folder, const std::string& law, double duration,
                 const std::string& more = "") {
  write_bytes(folder / "rod.urdf",
              "<robot name='rod'><link name='foot'/><link name='rod'><inertial><origin xyz='0.5 0 "
              "0'/><mass value='1'/><inertia ixx='0.2' iyy='0.2' izz='0.25' ixy='0' ixz='0' "
              "iyz='0'/></inertial></link><joint name='j' type='continuous'><parent link='foot'/>"
              "<child link='rod'/><axis xyz='0 0 1'/></joint></robot>");
  write_bytes(
      folder / "scene.toml",
      fmt::format("[model]\nurdf = \"rod.urdf\"\nbase = \"fixed\"\n[initial]\njoints.j = {{ "
                  "position = 0.3, velocity = 1 }}\n[integrator]\nmethod = "
                  "\"gauss4\"\nstep = 0.05\n[run]\nduration = {}\n[[controller]]\nname = "
                  "\"law\"\nrate = 20\n{}\n{}",
                  duration, law, more));
  return scene::read_scene((folder / "scene.toml").string());
}
std::string damper(double damping, const std::string& keys) {
  return fmt::format("type = \"potential\"\njoints.j = {{ damping = {:.17g} }}\n{}\n", damping,
                     keys);
}
scene::RunReport run_of(const scene::Scene& s) {
  return scene::run_in_memory(s, scene::assemble(s), {});
}

/// The torques that a controller gives at `count` instants in the state of the start.
std::vector<double> torques(const scene::Scene& s, int count) {
  const auto a = scene::assemble(s);
  const auto system = a.model->instantiate<double>();
  auto memory = a.model->holds()[0]->fresh;
  std::vector<double> all;
  for (int k = 0; k < count; ++k) {
    system->sample(0, k / 20.0, a.initial.x, memory);
    all.push_back(memory[0]);
  }
  return all;
}
struct Moments {
  double mean, deviation, lag;  ///< lag: correlation of neighbours
};
Moments moments(const std::vector<double>& x) {
  const double n = double(x.size());
  double sum = 0, squares = 0, products = 0;
  for (const double v : x) sum += v / n;
  for (size_t k = 0; k < x.size(); ++k) {
    squares += (x[k] - sum) * (x[k] - sum);
    if (k > 0) products += (x[k] - sum) * (x[k - 1] - sum);
  }
  return {sum, std::sqrt(squares / n), products / squares};
}

}  // namespace

TEST(Sensing, ADelayedDamperLosesItsStabilityWhereTheDiscreteLoopDoes) {
  // v' = v - a v of d periods before, a = damping · period / inertia: z^(d + 1) - z^d + a = 0 has
  // all roots inside the circle for 0 < a < 2 sin(π / (4 d + 2)).
  for (int d = 0; d < 4; ++d) {
    const double critical = 2 * std::sin(pi / (4 * d + 2));
    for (const double part : {0.98, 1.02}) {
      TemporaryFolder folder;
      const double damping = part * critical * 0.5 * 20;
      const auto s = rod(folder, damper(damping, fmt::format("delay = {}", d)), 50);
      std::vector<double> v{1};  // the recursion
      for (int k = 0; k < 1000; ++k)
        v.push_back(v[size_t(k)] - (k >= d ? part * critical * v[size_t(k - d)] : 0));
      double last = 0;
      for (size_t k = v.size() - 40; k < v.size(); ++k) last = std::max(last, std::fabs(v[k]));
      EXPECT_EQ(last < 0.1, part < 1) << d << ": " << last;  // measured at most 0.020
      EXPECT_EQ(last > 10, part > 1) << d << ": " << last;   // at least 62
      if (part > 1) {
        EXPECT_TRUE(says(refusal([&] { scene::assemble(s); }), "sampled fails: ")) << d;
        continue;
      }
      const double speed = run_of(s).final_state.x[1] / 0.5;  // p / I
      EXPECT_NEAR(speed, v.back(), 1e-10 * *std::max_element(v.begin(), v.end())) << d;
    }
  }
}

/// Largest |z| of a spring k and a damper d on the rod, held: the plant is a double integrator.
double held(double k, double d, double rate) {
  const double T = 1 / rate, I = 0.5;
  const double half = 1 - (k * T * T / 2 + d * T) / (2 * I),
               det = 1 - (d * T - k * T * T / 2) / I;  // z² - 2 half z + det
  const auto root = std::sqrt(std::complex<double>(half * half - det));
  return std::max(std::abs(half + root), std::abs(half - root));
}

TEST(Sensing, ALawThatIsHeldForTooLongIsRefusedByItsLargestZ) {
  TemporaryFolder folder;
  const auto assembled = [&](const std::string& law, double rate, const std::string& more = "") {
    auto s = rod(folder, law, 1, more);
    s.controllers[0].rate = rate;
    return scene::assemble(s);
  };
  double off = 0, wrong = 0;
  for (const double k : {0.0, 3.0, 40.0})
    for (const double rate : {15.0, 20.0, 300.0}) {
      const auto joint = fmt::format("joints.j = {{ stiffness = {}, damping = 5 }}\n", k);
      const double z = held(k, 5, rate);
      const auto found = [&](const std::string& law) {
        return assembled(law, rate).certificates[0].item("sampled").value;
      };
      if (k == 0) {  // 1 - d T / I, beside the place, which is free
        off = std::max(off, std::fabs(found(damper(5, "")) - std::fabs(1 - 10 / rate)));
        continue;
      }
      off = std::max(off, std::fabs(found("type = \"potential\"\n" + joint) - z));
      wrong = std::max(wrong, std::fabs(z - held(k, 4.9, rate)));
      const auto tracking =
          fmt::format("type = \"tracking\"\njoints.j = {{ kp = {}, kd = 5 }}\n", k);
      off = std::max(off, std::fabs(found(tracking) - z));
    }
  keeps("largest |z| off its closed form", off, 1e-12);
  breaks("that of a damper 2 % softer", wrong, 1e-3);
  // A damper of 25 N m s/rad needs d / (2 I) = 25 Hz.
  for (const std::string& law :
       {damper(25, ""), std::string("type = \"tracking\"\njoints.j = { kp = 1e-3, kd = 25 }\n")}) {
    const auto why = refusal([&] { assembled(law, 20); });
    EXPECT_TRUE(says(why, "scene.toml:11:1: ")) << "with file and line";
    EXPECT_TRUE(says(why,
                     "sampled fails: 1.5, expected at most 1 (largest |z| of the linearised "
                     "loop at rate = 20 Hz, whose torques are held: a rate of "));
    EXPECT_LE(why.size() - why.find("scene.toml"), 220u);
    const double named = std::stod(why.substr(why.find("a rate of ") + 10));
    keeps("the rate that is named, off 25 Hz", std::fabs(named - 25), 0.11);
    EXPECT_EQ(refusal([&] { assembled(law, named); }), "") << "control: it would do";
    EXPECT_NE(refusal([&] { assembled(law, 0.98 * named); }), "");
    EXPECT_EQ(refusal([&] { assembled(law, 0); }), "") << "control: continuous";
  }
  // What the design does not know may hold the loop: it is told.
  const std::string element = "[[element]]\ntype = \"spring\"\njoint = \"j\"\nstiffness = 1\n";
  const auto beside = assembled(damper(25, ""), 20, element);
  ASSERT_EQ(beside.remarks.size(), 1u);
  EXPECT_TRUE(says(beside.remarks[0],
                   "'law' would be unstable without the scene's elements and "
                   "actuators: 1.5 is the largest |z|"));
  EXPECT_TRUE(assembled(damper(5, ""), 20, element).remarks.empty()) << "control";
}

TEST(Sensing, NoiseHasItsDeviationAndIsWhite) {
  constexpr int n = 100000;
  const auto of = [&](const std::string& keys) {
    TemporaryFolder folder;
    return moments(torques(rod(folder, keys, 1), n));
  };
  // The estimate of the deviation has an error of 1 / √(2 n) = 0.0022, those of mean and
  // correlation of 1 / √n = 0.0032.
  const auto rate = of(damper(2, "noise = { rate = 0.01 }"));
  EXPECT_NEAR(rate.deviation / 0.02, 1, 0.01);
  EXPECT_NEAR(rate.mean, -2, 0.02 * 0.015);  // of the true rate 1
  EXPECT_NEAR(rate.lag, 0, 0.015);
  const std::string spring =
      "type = \"potential\"\njoints.j = { stiffness = 3, target = 0, damping = 0.1 }\n";
  const auto position = of(spring + "noise = { position = 0.01, seed = 5 }");
  EXPECT_NEAR(position.deviation / 0.03, 1, 0.01);
  EXPECT_NEAR(position.mean, -1, 0.03 * 0.015);  // 0.9 of the spring
  EXPECT_NEAR(position.lag, 0, 0.015);
  std::printf(
      "  deviation of rate %.4f, of position %.4f of the stated one; correlation of "
      "neighbours %.4f, %.4f\n",
      rate.deviation / 0.02, position.deviation / 0.03, rate.lag, position.lag);
  // Negative controls: another deviation is noticed, and none without noise.
  EXPECT_GT(std::fabs(of(damper(2, "noise = { rate = 0.0103 }")).deviation / 0.02 - 1), 0.01);
  EXPECT_LT(of(damper(2, "")).deviation, 1e-11);  // rounding of the mean: 4e-12
}

TEST(Sensing, AttitudesThatALawDoesNotSeeHaveNoNoise) {
  TemporaryFolder folder;
  const auto s = rod(folder, damper(2, "noise = { attitude = 0.01 }"), 1);
  EXPECT_TRUE(says(refusal([&] { scene::assemble(s); }),
                   "'law' has noise of an attitude and measures none"));
}

TEST(Sensing, NoiseBelongsToItsSeedItsControllerItsJointAndItsInstant) {
  TemporaryFolder folder;
  const auto with = [&](const std::string& keys) {
    return torques(rod(folder, damper(2, keys), 1), 5);
  };
  const auto first = with("noise = { rate = 0.01 }");
  EXPECT_EQ(first, with("noise = { rate = 0.01, seed = 1 }"));
  EXPECT_NE(first, with("noise = { rate = 0.01, seed = 2 }"));
  auto s = rod(folder, damper(2, "noise = { rate = 0.01 }"), 1);
  s.of_case = 1;
  EXPECT_NE(first, torques(s, 5));
  s.of_case = 0;
  s.controllers[0].name = "other";
  EXPECT_NE(first, torques(s, 5));
  // The instant alone counts, not what was sampled before.
  const auto a = scene::assemble(rod(folder, damper(2, "noise = { rate = 0.01 }"), 1));
  auto memory = a.model->holds()[0]->fresh;
  a.model->instantiate<double>()->sample(0, 3 / 20.0, a.initial.x, memory);
  EXPECT_EQ(memory[0], first[3]);
}

TEST(Sensing, WhatIsMeasuredAndGivenLiesOnItsGrid) {
  TemporaryFolder folder;
  const auto on_grid = [](double x, double resolution) {
    return std::fabs(x / resolution - std::round(x / resolution)) < 1e-9;
  };
  write_bytes(folder / "law.py",
              "class Law:\n    def __init__(self, joints): pass\n    def __call__(self, t, q, v):\n"
              "        return q[0]\n");
  if (have_python()) {
    const std::string law = "type = \"python\"\npython = \"law.py:Law\"\njoints = [\"j\"]\n";
    for (const bool fine : {true, false}) {
      const auto tau = torques(
          rod(folder, law + "noise.position = 0.05\n" + (fine ? "resolution.position = 0.007" : ""),
              1),
          100);
      int on = 0;
      for (const double q : tau) on += on_grid(q, 0.007);
      EXPECT_EQ(on == 100, fine) << on;
    }
    // The nearest multiple: 0.3 is 42.86 of 0.007.
    EXPECT_NEAR(torques(rod(folder, law + "resolution.position = 0.007", 1), 1)[0], 43 * 0.007,
                1e-15);
  }
  // Of a law of the library, which sees momenta: the rate 1 is 14 of 0.07, less 0.02.
  EXPECT_NEAR(torques(rod(folder, damper(2, "resolution.rate = 0.07"), 1), 1)[0], -2 * 14 * 0.07,
              1e-14);
  EXPECT_NEAR(torques(rod(folder, damper(2, "resolution.torque = 0.3"), 1), 1)[0], -7 * 0.3, 1e-15);
  EXPECT_NEAR(torques(rod(folder, damper(2, ""), 1), 1)[0], -2, 1e-15);
}

TEST(Sensing, AWorkThatIsHeldIsInTheRowAndARunGoesOnWithTheSameBits) {
  const std::string keys =
      "delay = 2\nnoise = { rate = 0.01, position = 0.02 }\n"
      "resolution = { torque = 0.01, rate = 0.001 }";
  TemporaryFolder folder;
  const auto s = rod(folder, damper(2, keys), 4, "[verify]\nenergy = 1e-13\n");
  const auto whole = run_into(s, folder / "whole");
  EXPECT_TRUE(whole.passed());
  const double before = 0.5 * 0.5, after = 0.5 * std::pow(whole.final_state.x[1], 2) / 0.5;
  EXPECT_NEAR(entry_of(whole.ports, "law"), after - before, 1e-14);
  EXPECT_TRUE(std::isnan(entry_of(whole.ports, "law.hold")));
  EXPECT_TRUE(run_into(s, folder / "parts", 33).interrupted);
  run_into(s, folder / "parts", -1, true);
  EXPECT_TRUE(read_bytes(folder / "whole/run.h5") == read_bytes(folder / "parts/run.h5"));
  auto half = s;
  half.duration = 1.5;
  run_into(half, folder / "extended");
  auto longer = s;
  scene::extend_to(longer, (folder / "extended").string(), 4);
  scene::reopen((folder / "extended").string(), longer, scene::assemble(longer));
  run_into(longer, folder / "extended", -1, true);
  EXPECT_TRUE(read_bytes(folder / "whole/run.h5") == read_bytes(folder / "extended/run.h5"));
  // Negative control: another seed has other bytes.
  run_into(rod(folder, damper(2, "delay = 2\nnoise = { rate = 0.01, seed = 2 }"), 4),
           folder / "other");
  EXPECT_FALSE(read_bytes(folder / "whole/run.h5") == read_bytes(folder / "other/run.h5"));
}

TEST(Sensing, KeysWithoutASenseAreRefused) {
  TemporaryFolder folder;
  const auto said = [&](const std::string& law) { return refused([&] { rod(folder, law, 1); }); };
  EXPECT_NE(said(damper(2, "delay = -1")).find("expected a whole number"), std::string::npos);
  EXPECT_NE(said(damper(2, "noise.rate = -1")).find("0 or more"), std::string::npos);
  const auto text = read_bytes(folder / "scene.toml");
  auto continuous = text;
  continuous.replace(continuous.find("rate = 20\n"), 10, "");
  continuous.replace(continuous.find("noise.rate = -1"), 15, "noise.rate = 1");
  write_bytes(folder / "scene.toml", continuous);
  EXPECT_NE(refused([&] {
              scene::read_scene((folder / "scene.toml").string());
            }).find("noise is given without a rate"),
            std::string::npos);
}

}  // namespace porthos::test::sensing_test
