// [[controller]] type = "ida_pbc", design = "vtol": a planar vehicle with an engine below its
// centre of mass, against the design's own run, and what is refused.
#include <fmt/format.h>

#include <cmath>

#include "energy_shaping/matching/vtol_on_model.h"
#include "scene/session/memory_run.h"
#include "tests/run/shipped.h"

namespace porthos::test::vtol_scene_test {
namespace {

/// 2 kg, 0.8 kg m², the engine 0.8 m below the centre of mass: ε = J/(m h) = 0.5 m.
struct Vehicle {
  double across = 1, up = 1, turn = 1;  ///< signs of the joints' axes
  double side = 0, below = 0.8, friction = 0;
  double duration = 7.5;
  std::string more = {};
};
scene::Scene read(const TemporaryFolder& folder, const Vehicle& v) {
  const auto joint = [](const std::string& name, const std::string& type, const std::string& from,
                        const std::string& to, const std::string& axis, double friction = 0) {
    return fmt::format(
        "<joint name='{}' type='{}'><parent link='{}'/><child link='{}'/><axis xyz='{}'/><limit "
        "effort='9' velocity='9' lower='-99' upper='99'/><dynamics damping='{}'/></joint>",
        name, type, from, to, axis, friction);
  };
  write_bytes(
      folder / "vehicle.urdf",
      "<robot name='vehicle'><link name='ground'/><link name='slider'/><link name='lift'/><link "
      "name='hull'><inertial><mass value='2'/><inertia ixx='1' iyy='0.8' izz='1' ixy='0' ixz='0' "
      "iyz='0'/></inertial></link>" +
          joint("x", "prismatic", "ground", "slider", fmt::format("{} 0 0", v.across)) +
          joint("z", "prismatic", "slider", "lift", fmt::format("0 0 {}", v.up)) +
          joint("tilt", "continuous", "lift", "hull", fmt::format("0 {} 0", -v.turn), v.friction) +
          "</robot>");
  write_bytes(
      folder / "scene.toml",
      fmt::format(
          "[model]\nurdf = \"vehicle.urdf\"\nbase = \"fixed\"\nlinks_without_inertia = "
          "\"massless\"\n[environment]\ngravity = \"uniform\"\nvector = [0, 0, -9.8]\n"
          "[initial]\njoints.x = {{ position = {} }}\njoints.z = {{ position = {} }}\njoints.tilt "
          "= "
          "{{ position = {} }}\n[integrator]\nmethod = \"gauss8\"\nstep = 0.01\n[run]\nduration = "
          "{}\n[[controller]]\ntype = \"ida_pbc\"\nname = \"hover\"\ndesign = \"vtol\"\nengine = "
          "{{ "
          "link = \"hull\", point = [{}, 0, {}] }}\njoints.x.target = 0\njoints.z.target = 0\n"
          "joints.tilt.target = 0\ngains = {{ k1 = 2, k2 = 3, k3 = 12, P = 0.1, kv = 10 }}\n{}",
          v.across * 5, v.up * 5, v.turn * 0.5, v.duration, v.side, -v.below, v.more));
  return scene::read_scene((folder / "scene.toml").string());
}

}  // namespace

TEST(VtolScene, AVehicleMovesAsTheReferenceRunOfTheDesign) {
  const auto loop = energy_shaping::vtol({});
  const auto H = loop->instantiate<double>();
  for (const auto& [across, up, turn] :
       {std::array{1.0, 1.0, 1.0}, {-1.0, 1.0, -1.0}, {1.0, -1.0, -1.0}}) {
    TemporaryFolder folder;
    const auto s = read(folder, {.across = across, .up = up, .turn = turn});
    const auto a = scene::assemble(s);
    const auto r = scene::run_in_memory(s, a, {});
    EXPECT_TRUE(r.passed());
    const auto& c = a.certificates.at(0);
    const double off = c.item("moves as the design's plant").value;
    std::printf("  model against design: %.2g\n", off);
    EXPECT_LT(off, 1e-12);
    EXPECT_NEAR(c.item("epsilon").value, 0.5, 1e-15);
    // H_d of the design after 7.5 s: -19.286061 (RK4 of 10 ms, Acosta et al. 2005). The momenta of
    // the design are the rates; the masses here are 2, 2 and 0.8.
    const auto& x = r.final_state.x;
    const std::vector<double> z{x[0] * across,     x[1] * up,     x[2] * turn,
                                x[3] * across / 2, x[4] * up / 2, x[5] * turn / 0.8};
    EXPECT_NEAR(H->hamiltonian(z), -19.286061, 2e-6);
  }
}

TEST(VtolScene, TheJointsGetTheForceOfTheEngine) {
  TemporaryFolder folder;
  const auto a = scene::assemble(read(folder, {}));
  const energy_shaping::VtolOnModel made(a.mechanical, {"hull", {0, 0, -0.8}}, {0, 0, 0},
                                         {.k1 = 2, .k2 = 3, .k3 = 12, .P = 0.1, .kv = 10});
  const auto laws = made.port_laws();
  ASSERT_EQ(laws.size(), 3u);
  const std::vector<double> x{5, 5, 0.5, 0, 0, 0};
  double f[3];
  for (size_t k = 0; k < 3; ++k)
    (*laws[k].law)(0.0, std::span<const double>(x), std::span<const double>(),
                   std::span<double>(&f[k], 1));
  EXPECT_NEAR(f[0], 2 * -28.0626, 2e-4);          // m u of the reference run
  EXPECT_NEAR(f[1], 2 * (-22.1334 + 9.8), 2e-4);  // m (u + g)
  // The lever from the centre of mass, tilted by 0.5 rad.
  EXPECT_NEAR(f[2], 0.8 * (std::sin(0.5) * f[1] + std::cos(0.5) * f[0]), 1e-12 * std::fabs(f[0]));
}

TEST(VtolScene, ASampledOneHoversAndATankBoundsIt) {
  TemporaryFolder folder;
  const auto s = read(folder, {.duration = 60, .more = "rate = 50\ntank = { level = 500 }\n"});
  const auto r = scene::run_in_memory(s, scene::assemble(s), {});
  EXPECT_TRUE(r.passed());
  keeps("tilt after a minute [rad]", std::fabs(r.final_state.x[2]), 0.05);
  keeps("height off after a minute [m]", std::fabs(r.final_state.x[1]), 0.05);
}

TEST(VtolScene, RefusalsSayWhereAndWhat) {
  const auto says = [](const Vehicle& v, const std::string& part) {
    TemporaryFolder folder;
    std::string told;
    try {
      (void)scene::assemble(read(folder, v));
    } catch (const InvalidArgument& e) {
      told = e.what();
    }
    EXPECT_NE(told.find(part), std::string::npos) << told;
    EXPECT_NE(told.find("scene.toml:"), std::string::npos) << told;
  };
  says({.below = -0.8}, "expected it below");
  says({.below = 4}, "k1/epsilon > k2");  // ε = 0.1 m
  says({.side = 0.1}, "moves as the design's plant");
  says({.friction = 0.1}, "moves as the design's plant");
  says({.more = "limit = 9\n"}, "limit is no key of design = \"vtol\", expected engine");
}

}  // namespace porthos::test::vtol_scene_test
