// [[output]]s of soft contacts against closed forms and against what the field does to momenta.
#include <fmt/format.h>

#include <cmath>

#include "mechanics/rotation.h"
#include "tests/run/series.h"

namespace porthos::test::contact_outputs_test {
namespace {

constexpr double radius = 0.12, mass = 14, k = 2e5, g = 3.71;

/// A ball that falls, slides and turns on the plane z = 0, with every output of the contact.
scene::Scene ball(const TemporaryFolder& folder, const std::string& law, const std::string& more,
                  double height = 0.2, const std::string& speed = "0.4, -0.2, -1.1") {
  write_bytes(folder / "model.urdf",
              "<robot name='b'><link name='ball'><inertial><mass value='14'/><inertia ixx='0.2' "
              "iyy='0.21' izz='0.22' ixy='0' ixz='0' iyz='0'/></inertial></link></robot>");
  std::string text = fmt::format(
      "[model]\nurdf = \"model.urdf\"\nbase = \"free\"\n[environment]\ngravity = \"uniform\"\n"
      "vector = [0, 0, -{}]\n[initial]\nbase.position = [0, 0, {}]\n"
      "base.attitude_wxyz = [0.9, 0.3, -0.2, 0.1]\nbase.linear_velocity = [{}]\n"
      "base.angular_velocity = [2, -1, 0.5]\n[[contact]]\nname = \"ground\"\nlinks = [\"ball\"]\n"
      "shape = {{ kind = \"sphere\", radius = {} }}\n{}\n",
      g, height, speed, radius, law);
  for (const char* quantity : {"contact_force", "normal_force", "overlap"})
    text += fmt::format("[[output]]\nquantity = \"{0}\"\nname = \"{0}\"\ncontact = \"ground\"\n",
                        quantity);
  for (const char* quantity : {"position", "velocity", "attitude"})
    text +=
        fmt::format("[[output]]\nquantity = \"{0}\"\nname = \"{0}\"\nlink = \"ball\"\n", quantity);
  for (const char* axis : {"x", "y", "z"})
    text += fmt::format(
        "[[output]]\nquantity = \"joint_torque\"\nname = \"along_{0}\"\njoint = "
        "\"base.along_{0}\"\n",
        axis);
  text += more +
          "[integrator]\nmethod = \"gauss8\"\nstep = 0.001\n[run]\nduration = 0.6\n"
          "record_every = 0.001\n";
  write_bytes(folder / "scene.toml", text);
  return scene::read_scene((folder / "scene.toml").string());
}

/// u in the axes to which ξ turns its own.
mechanics::Vec3d turned(const mechanics::Quaternion<double>& xi, const mechanics::Vec3d& u) {
  return (xi * u * xi.conj()).v;
}

const std::string lossy =
    "law = \"power\"\nstiffness = 2e5\nrestitution = 0.5\nspeed = 1\nfriction = 0.4\ncreep = 0.05";

/// The force on the ball is what the field adds to its momentum, in body axes. The normal force is
/// k δ (1 + a δ')₊. Control: without the loss.
TEST(ContactOutputs, AreWhatTheFieldAddsAndTheClosedForm) {
  TemporaryFolder folder;
  const Series s(ball(folder, lossy, ""));
  const auto of = [&](const std::string& name) { return s("output/" + name); };
  const auto normal = of("normal_force"), depth = of("overlap"), F = of("contact_force");
  const auto place = of("position"), rate = of("velocity"), xi = of("attitude");
  const std::vector<double> own[] = {of("along_x"), of("along_y"), of("along_z")};
  const double a = contact::loss_for(0.5, 1);
  double largest = 0, field = 0, law = 0, elastic = 0, deepest = 0, along = 0;
  for (size_t i = 0; i < normal.size(); ++i) {
    const auto vector = [&](const std::vector<double>& of_all) {
      return mechanics::Vec3d{of_all[3 * i], of_all[3 * i + 1], of_all[3 * i + 2]};
    };
    const auto f =
        turned(mechanics::Quaternion<double>::load(&xi[4 * i]), {own[0][i], own[1][i], own[2][i]});
    field = std::fmax(field, norm(f - vector(F)));
    const double d = std::fmax(radius - vector(place).z, 0),
                 hold = k * d * std::fmax(1 - a * vector(rate).z, 0);
    law = std::fmax(law, std::fabs(normal[i] - hold));
    elastic = std::fmax(elastic, std::fabs(normal[i] - k * d));
    deepest = std::fmax(deepest, std::fabs(depth[i] - d));
    along = std::fmax(along, std::fabs(normal[i] - vector(F).z));
    largest = std::fmax(largest, normal[i]);
  }
  ASSERT_GT(largest, 20 * mass * g);
  keeps("force less the field's, of the largest", field / largest, 1e-14);
  keeps("normal force less k δ (1 + a δ'), of the largest", law / largest, 1e-12);
  keeps("z of the force less the normal force, of the largest", along / largest, 1e-14);
  keeps("overlap less r - z [m]", deepest, 1e-15);
  breaks("the same without the loss", elastic / largest, 0.1);
}

/// On the ground the weight is borne, at the overlap m g / k. Control: 1 mm higher.
TEST(ContactOutputs, AtRestAreTheWeight) {
  const auto off = [](double height) {
    TemporaryFolder folder;
    const Series run(ball(folder, "law = \"power\"\nstiffness = 2e5", "", height, "0.1, 0, 0"));
    double worst = 0;
    for (const double f : run("output/normal_force"))
      worst = std::fmax(worst, std::fabs(f / (mass * g) - 1));
    return worst;
  };
  const double rest = radius - mass * g / k;
  keeps("normal force less m g, of it", off(rest), 1e-9);
  breaks("the same from 1 mm higher", off(rest + 1e-3), 0.5);
}

/// A stop by a force that a foot bears.
TEST(ContactOutputs, AStopEndsTheRunAtAForce) {
  TemporaryFolder folder;
  const Series s(ball(folder, lossy,
                      "[[stop]]\noutput = \"normal_force\"\nabove = 500\noutcome = \"fail\"\n"));
  ASSERT_TRUE(s.report.stopped);
  keeps("force there less 500 N, of it", std::fabs(s("output/normal_force").back() / 500 - 1),
        1e-9);
}

/// A soft ground lets the ball sink half its radius: told. Control: a stiff one.
TEST(ContactOutputs, ADeepContactIsTold) {
  const auto notes = [](const std::string& stiffness) {
    TemporaryFolder folder;
    const Series s(ball(folder, "law = \"power\"\nstiffness = " + stiffness, ""));
    std::string all;
    for (const auto& note : s.report.notes)
      if (note.find(" sank ") != note.npos) all += note;
    return all;
  };
  // m v²/2 = k δ²/2 - m g δ
  const std::string said = notes("5000");
  EXPECT_NE(said.find("contact 'ground' sank 0.0"), said.npos) << said;
  EXPECT_NE(said.find("in a shape of half-size 0.12 m: a larger stiffness"), said.npos) << said;
  EXPECT_EQ(notes("2e5"), "");
}

TEST(ContactOutputs, AreRefusedWhereThereIsNoForce) {
  const auto refusal = [](const std::string& law, const std::string& contact) {
    TemporaryFolder folder;
    auto s = ball(folder, law, "");
    for (auto& o : s.outputs)
      if (o.of_contact()) o.of_what = contact;
    return test::refusal([&] { scene::Outputs(s, scene::assemble(s)); });
  };
  EXPECT_NE(refusal("law = \"rigid\"\nrestitution = 0.5", "ground")
                .find("contact 'ground' is rigid and has impulses"),
            std::string::npos);
  EXPECT_NE(refusal(lossy, "floor")
                .find("there is no soft [[contact]] 'floor', expected one of: "
                      "ground"),
            std::string::npos);
}

}  // namespace
}  // namespace porthos::test::contact_outputs_test
