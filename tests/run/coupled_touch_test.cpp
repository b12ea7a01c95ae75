// Mechanisms with a constraint that bears nothing until something touches.
#include <fmt/format.h>

#include "scene/session/memory_run.h"
#include "tests/run/shipped.h"

namespace porthos::test::coupled_touch_test {
namespace {

/// Two slides, coupled one to one, that drift to a stop in free fall.
scene::Scene slides(const TemporaryFolder& folder, const std::string& method, double step) {
  std::string urdf = "<robot name='t'><link name='base'/>";
  for (const char* name : {"s", "f"})
    urdf += fmt::format(
        "<link name='{0}l'><inertial><mass value='{1}'/><inertia ixx='1e-3' iyy='1e-3' izz='1e-3' "
        "ixy='0' ixz='0' iyz='0'/></inertial></link><joint name='{0}' type='prismatic'><parent "
        "link='base'/><child link='{0}l'/><axis xyz='1 0 0'/><limit lower='0' upper='1' "
        "effort='9' velocity='9'/></joint>",
        name, name[0] == 's' ? 0.5 : 1.2);
  write_bytes(folder / "two.urdf", urdf + "</robot>");
  write_bytes(folder / "scene.toml",
              fmt::format("[model]\nurdf = \"two.urdf\"\nbase = \"fixed\"\n[initial]\njoints.s = "
                          "{{ position = 0.4, velocity = -1 }}\n[[coupling]]\nname = \"gear\"\n"
                          "factors = {{ s = 1, f = -1 }}\n[[element]]\ntype = \"joint_stop\"\n"
                          "joint = \"s\"\nlaw = \"power\"\nstiffness = 20000\n[integrator]\n"
                          "method = \"{}\"\nstep = {}\n[run]\nduration = 1\nrecord_every = 0.01\n",
                          method, step));
  return scene::read_scene((folder / "scene.toml").string());
}

/// The stop begins to push in a step whose reactions begin with it. Control: a method of order 2.
TEST(CoupledTouch, AReactionThatBeginsWithTheTouchIsFound) {
  const auto energy = [](const std::string& method, double step) {
    TemporaryFolder folder;
    const auto s = slides(folder, method, step);
    return value_of(scene::run_in_memory(s, scene::assemble(s), {}), "energy");
  };
  for (const double step : {0.002, 0.001, 0.0005, 0.0002}) {
    keeps(fmt::format("spark16, steps of {} s", step), energy("spark16", step), 1e-14);
    keeps(fmt::format("pgauss16, steps of {} s", step), energy("pgauss16", step), 1e-14);
  }
  keeps("spark4, steps of 0.0002 s", energy("spark4", 0.0002), 1e-6);
  breaks("rattle, steps of 0.001 s", energy("rattle", 0.001), 1e-6);
}

}  // namespace
}  // namespace porthos::test::coupled_touch_test
