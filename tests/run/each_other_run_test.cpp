// Links of a scene among themselves, by every kind of contact, and what is refused.
#include <fmt/format.h>

#include "scene/session/memory_run.h"
#include "tests/run/shipped.h"

namespace porthos::test::each_other_run_test {
namespace {

/// Three balls of 1 kg on a line, the first at 1 m/s towards the others; law: keys of the contact.
scene::Scene row(const TemporaryFolder& folder, const std::string& links, const std::string& law,
                 const std::string& method, double step) {
  write_bytes(folder / "model.urdf",
              R"(<robot name="ball"><link name="one"><inertial><mass value="1"/><inertia ixx="4e-3"
iyy="4e-3" izz="4e-3" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>)");
  std::string text =
      "[model]\nurdf = \"model.urdf\"\nbase = \"free\"\n[initial]\nbase = { "
      "linear_velocity = [1, 0, 0] }\n";
  for (const auto& [name, x] : {std::pair{"two", 0.5}, {"three", 1.0}})
    text += fmt::format(
        "[[body]]\nname = \"{}\"\nmass = 1\ninertia = [4e-3, 4e-3, 4e-3, 0, 0, 0]\n"
        "position = [{}, 0, 0]\n",
        name, x);
  text += fmt::format(
      "[[contact]]\nname = \"c\"\nlinks = [{}]\nagainst = [\"each other\"]\n"
      "shape = {{ kind = \"sphere\", radius = 0.1 }}\n{}"
      "[integrator]\nmethod = \"{}\"\nstep = {}\n[run]\nduration = 1.5\n",
      links, law, method, step);
  write_bytes(folder / "scene.toml", text);
  return scene::read_scene((folder / "scene.toml").string());
}
constexpr const char* all = "\"one\", \"two\", \"three\"";

/// The first two stop one after another and the third goes on, 0.5 - 0.2 m after each other. Bound:
/// a gap that closes at 1 m/s in a step of moreau stays open by up to h/2 (docs/contact.md), at
/// either impact; a touch of the soft law lasts π √(m/2k), in which the motion goes on by half of
/// it; the events are exact. Control: a third ball that is not named is passed through.
TEST(EachOtherRun, ARowOfBallsPassesTheMotionOn) {
  const double k = 1e6, touch = M_PI * std::sqrt(0.5 / k);
  const struct {
    const char *law, *method;
    double step, bound;
  } kinds[] = {{"law = \"rigid\"\nrestitution = 1\n", "moreau", 0.0015, 2 * 0.00075 + 1e-12},
               {"law = \"rigid\"\nrestitution = 1\n", "gauss16", 0.01, 1e-13},
               {"law = \"power\"\nstiffness = 1e6\n", "gauss16", 5e-4, 2 * touch}};
  for (const auto& each : kinds) {
    const auto end = [&](const char* links) {
      TemporaryFolder folder;
      const auto s = row(folder, links, each.law, each.method, each.step);
      const auto r = scene::run_in_memory(s, scene::assemble(s), {});
      EXPECT_EQ(r.outcome, integrators::Outcome::ok);
      return r.final_state.x;
    };
    const auto x = end(all), control = end("\"one\", \"two\"");
    const double centre = 0.5 + 1.5 / 3;  // from which places are counted
    const double off[] = {x[0] + centre - 0.3, x[7] + centre - 0.8, x[14] + centre - 1.9};
    double worst = 0;
    for (const double one : off) worst = std::max(worst, std::fabs(one));
    fmt::print("  {} {}: {:.1e} m off   bound {:.1e}; not named: {:.2f} m beyond\n", each.method,
               each.law[7], worst, each.bound, control[7] - control[14]);
    EXPECT_LE(worst, each.bound);
    EXPECT_NEAR(control[14], 1 - centre, 1e-15);
    EXPECT_GT(control[7], control[14] + 0.6);
  }
}

TEST(EachOtherRun, RefusalsSayWhereAndWhat) {
  const auto refusal = [](const std::vector<Change>& changes) {
    return refusal_of_scene([&](const TemporaryFolder& folder) {
      const std::string law = "law = \"rigid\"\nrestitution = 1\n";
      (void)row(folder, all, law, "moreau", 0.01);
      std::string text = read_bytes(folder / "scene.toml");
      for (const auto& [from, to] : changes) text.replace(text.find(from), from.size(), to);
      write_bytes(folder / "scene.toml", text);
      return scene::read_scene((folder / "scene.toml").string());
    });
  };
  const auto refused = [&](const std::vector<Change>& changes, const std::string& expected) {
    const std::string text = refusal(changes);
    EXPECT_TRUE(text.find("scene.toml:") != text.npos && says(text, expected)) << text;
  };
  refused(
      {{"\"each other\"]", "\"two\"]\nagainst_shape = { kind = \"sphere\", radius = 0.1 }"}},
      "contact 'c': 'two' is on both sides, expected against = [\"each other\"] for links among "
      "themselves");
  refused({{all, "\"one\""}},
          "contact 'c': no two of its links can touch each other, expected two that no joint "
          "connects");
  refused({{all, "\"one\", \"each other\""}}, "has \"each other\", expected it in against");
  refused({{"\"sphere\", radius = 0.1", "\"box\", size = [1, 1, 1]"}},
          "contact 'c': the boxes on 'one' and 'two' have sharp edges, whose normals are not "
          "unique: expected a shape with a radius for one of them");
  refused({{"\"sphere\", radius = 0.1", "\"cylinder\", radius = 0.1, length = 1"}},
          "contact 'c': there is no distance in closed form between a cylinder on 'one' and a "
          "cylinder on 'two'");
}

/// The example: its balls come to rest in the box and only lose. A resumed run has the same bits.
TEST(EachOtherRun, ABoxOfBalls) {
  TemporaryFolder folder;
  const auto s = shipped(folder, "box_of_balls", 0.4);
  const auto r = scene::run_in_memory(s, scene::assemble(s), {});
  EXPECT_TRUE(r.passed());
  EXPECT_GT(r.impacts[0].count, 48);
  TemporaryFolder other;
  expect_same_bits_when_resumed(other, shipped(other, "box_of_balls", 0.3), {75, 100});
}

}  // namespace
}  // namespace porthos::test::each_other_run_test
