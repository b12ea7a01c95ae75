#include <cmath>
#include <random>
#include <string>

#include "scene/session/info.h"
#include "tests/scene/scene_files.h"

namespace porthos::scene::assembly_test {
namespace {

using SceneAssembly = SceneFiles;

TEST_F(SceneAssembly, AssemblyNamesUnknownJointsAndAnUnwantedBase) {
  const std::string mass = "\ninertia.lower = { mass = 1, inertia = [1, 1, 1, 0, 0, 0] }";
  Lines l;
  l.model += mass;
  l.initial = "joints.elbow.position = 1\n";
  EXPECT_EQ(assembly_error(l),
            "scene.toml:6:8: [initial] joints.elbow: the model has no joint of this name, expected "
            "one of: shoulder, slide");
  l.initial = "base.position = [0, 0, 0]\n";
  EXPECT_EQ(assembly_error(l),
            "scene.toml:6:1: [initial] base is given, but the base is \"fixed\": expected no start "
            "values of the base, or [model] base = \"free\"");
  l.model = "urdf = \"arm.urdf\"\nbase = \"free\"" + mass;
  l.initial = "joints.base.position = 1\n";
  EXPECT_EQ(assembly_error(l),
            "scene.toml:6:8: [initial] joints.base: it is the free base, expected its start in "
            "[initial] base");
  l.model = "urdf = \"arm.urdf\"\nbase = \"free\"";
  l.initial = "\n";
  EXPECT_NE(assembly_error(l).find("arm.urdf:6: link 'lower' has no <inertial>"),
            std::string::npos);
}

// An element makes the mechanism a member of a network, which has a solver like it.
TEST_F(SceneAssembly, AnElementLeavesTheMechanismItsSolver) {
  Lines l;
  l.model += "\ninertia.lower = { mass = 1, inertia = [1, 1, 1, 0, 0, 0] }";
  EXPECT_NE(put_together(l).model->instantiate<double>()->resolvent(), nullptr);
  l.rest = "[[element]]\ntype = \"damper\"\njoint = \"shoulder\"\ndamping = 0.5\n";
  EXPECT_NE(put_together(l).model->instantiate<double>()->resolvent(), nullptr);
}

TEST_F(SceneAssembly, AssemblyPutsStartValuesWhereTheyBelong) {
  const Assembly a = put_together(full_scene);
  const auto& m = *a.mechanism;
  WorldView view(a);
  const auto& x = view(0, a.initial).x;
  const auto v = a.mechanical->rates(x);
  const auto &position = m.coordinate("base.position"), &attitude = m.coordinate("base.attitude");
  EXPECT_EQ(x[size_t(position.q)], 1);
  EXPECT_DOUBLE_EQ(x[size_t(attitude.q + 3)], 0.8);
  // (0, 0.6, 0, 0.8) is half a turn about (0.6, 0, 0.8): R u = 2 n (n·u) - u, and Rᵀ = R.
  const double along = 2 * (0.6 * 4 + 0.8 * 6);
  EXPECT_NEAR(v[size_t(position.v)], 0.6 * along - 4, 1e-12);
  EXPECT_NEAR(v[size_t(position.v + 1)], -5, 1e-12);
  EXPECT_NEAR(v[size_t(position.v + 2)], 0.8 * along - 6, 1e-12);
  EXPECT_NEAR(v[size_t(attitude.v + 2)], 9, 1e-12) << "body rates stay as they are";
  const auto& shoulder = m.coordinate("shoulder");
  EXPECT_EQ(x[size_t(shoulder.q)], 0.3) << "a stated joint is not random";
  EXPECT_NEAR(v[size_t(shoulder.v)], -0.05, 1e-12);

  // std::mt19937_64 is the same everywhere: 7 seeds this very number. Joint by joint: position,
  // then velocity.
  const auto& slide = m.coordinate("slide");
  std::mt19937_64 rng(7);
  rng.discard(2);
  const double unit = double(rng() >> 11) / 9007199254740992.0;
  EXPECT_EQ(x[size_t(slide.q)], 0.5 * (2 * unit - 1));
  EXPECT_NE(x[size_t(slide.q)], 0);
  EXPECT_EQ(put_together(full_scene).initial, a.initial);
}

TEST_F(SceneAssembly, StartAnglesAreWrapped) {
  Lines l;
  l.model += "\ninertia.lower = { mass = 1, inertia = [1, 1, 1, 0, 0, 0] }";
  l.initial = "joints.shoulder.position = 7\n";
  const Assembly a = put_together(l);
  EXPECT_NEAR(a.initial.x[0], 7 - 2 * M_PI, 1e-15);
  EXPECT_EQ(a.initial.turns[0], 1);
}

TEST_F(SceneAssembly, InfoShowsWhatWasAssembled) {
  const Scene s = read(full_scene);
  const std::string text = info_text(s, assemble(s));
  for (const char* part :
       {"Everything\n", "links               3, in 3 moving bodies", "base.attitude",
        "shoulder.torque", "slide.force", "quaternion_norm.base.attitude",
        "on the centre of mass alone, uniform (0, 0.5, -9.81) m/s^2",
        "damping                  absent", "gauss8, 4000 steps of 0.25 s = 1000 s",
        "damping 0.3 read but not simulated", "one state", "ns each"})
    EXPECT_NE(text.find(part), std::string::npos) << part << "\nin\n" << text;
  Scene damped = s;
  damped.urdf.use_damping = true;
  EXPECT_NE(info_text(damped, assemble(damped)).find("active in 1 joint\n"), std::string::npos);
}

}  // namespace
}  // namespace porthos::scene::assembly_test
