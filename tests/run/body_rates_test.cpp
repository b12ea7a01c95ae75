// Outputs along the axes of their own link, as gyros have them, against Euler's top.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "scene/assemble/law_inputs.h"
#include "scene/session/memory_run.h"
#include "tests/run/shipped.h"

namespace porthos::test::body_rates_test {
namespace {

std::string output(const std::string& quantity, const std::string& name, const std::string& keys) {
  return fmt::format("[[output]]\nquantity = \"{}\"\nname = \"{}\"\nlink = \"top\"\n{}\n", quantity,
                     name, keys);
}
/// A free top of 2, 2 and 3 kg m² with outputs and stops.
scene::Scene top(const TemporaryFolder& folder, const std::string& more, double duration = 8) {
  write_bytes(folder / "top.urdf",
              "<robot name='top'><link name='top'><inertial><mass value='1'/><inertia ixx='2' "
              "iyy='2' izz='3' ixy='0' ixz='0' iyz='0'/></inertial></link></robot>");
  write_bytes(folder / "scene.toml",
              fmt::format("[model]\nurdf = \"top.urdf\"\nbase = \"free\"\n[initial]\n"
                          "base.angular_velocity = [0.1, 0, 0.5]\n[integrator]\nmethod = "
                          "\"gauss8\"\nstep = 0.01\n[run]\nduration = {}\n{}",
                          duration, more));
  return scene::read_scene((folder / "scene.toml").string());
}
const std::string own = "axes = \"link\"",
                  rates = output("angular_velocity", "gyro", own) +
                          output("angular_velocity", "rate", "") +
                          output("velocity", "tip", "at = [1, 0, 0]\n" + own);

}  // namespace

/// The rates are (A cos λt, A sin λt, w3) with λ = (I3 - I1) / I1 w3, the tip's velocity w × e_x.
TEST(BodyRates, AreThoseOfEulersTop) {
  TemporaryFolder folder;
  double off = 0, world = 0;
  for (const double t : {1.0, 3.0, 8.0}) {
    const auto s = top(folder, rates, t);
    const auto a = scene::assemble(s);
    const auto r = scene::run_in_memory(s, a, {});
    const auto end = [&](const std::string& name) {
      return std::ranges::find(r.outputs, name, &scene::OutputRow::name)->end;
    };
    const double w2 = 0.1 * std::sin(0.25 * t), w[3] = {0.1 * std::cos(0.25 * t), w2, 0.5},
                 v[3] = {0, 0.5, -w2};
    double seen[3];  // by a law
    scene::law_inputs(s, a.mechanical, {"gyro"}).at(t, r.final_state.x, seen);
    for (size_t k = 0; k < 3; ++k) {
      const std::string component = std::string(".") + "xyz"[k];
      off = std::max({off, std::fabs(end("gyro" + component) - w[k]), std::fabs(seen[k] - w[k]),
                      std::fabs(end("tip" + component) - v[k])});
      world = std::max(world, std::fabs(end("rate" + component) - w[k]));
    }
  }
  keeps("rates and a velocity in the link's axes, off Euler's top", off, 1e-12);
  breaks("rates in the world's axes", world, 0.05);
}

TEST(BodyRates, StopARun) {
  TemporaryFolder folder;
  const auto off = [&](const std::string& name) {
    const auto s = top(folder, rates + "[[stop]]\noutput = \"" + name + ".x\"\nbelow = 0\n");
    const auto r = scene::run_in_memory(s, scene::assemble(s), {});
    return std::fabs((r.stopped ? r.stopped->at : HUGE_VAL) - 2 * M_PI);
  };
  keeps("off a quarter turn of the rate about the link's x [s]", off("gyro"), 1e-10);
  breaks("about the world's", off("rate"), 0.1);
}

TEST(BodyRates, ALinkAgainstItselfIsRefused) {
  TemporaryFolder folder;
  const auto why = [&](const std::string& keys) {
    return refusal([&] { scene::assemble(top(folder, output("angular_velocity", "w", keys))); });
  };
  const auto said = why("relative_to = \"top\"");
  EXPECT_TRUE(says(said,
                   "scene.toml:15:15: relative_to is 'top', the link itself, against "
                   "which it does not move, expected another; rates about its own axes are "
                   "axes = \"link\""));
  keeps("characters", double(said.size() - said.find("scene.toml")), 220);
  EXPECT_EQ(why("relative_to = \"world\""), "") << "control";
  EXPECT_EQ(why(own), "") << "control";
}

}  // namespace porthos::test::body_rates_test
