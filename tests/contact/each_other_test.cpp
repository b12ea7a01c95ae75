// Surfaces on both sides of a contact: each two once, without those whose bodies a joint connects.
#include <set>

#include "contact/detail/gaps.h"
#include "contact/detail/near_pairs.h"
#include "tests/contact/rigid_run.h"

namespace porthos::contact::each_other_test {
namespace {

using namespace test;

/// A ball of `radius` at the origin of each body, all on both sides of one contact.
Contact among(const mechanics::Mechanism& m, double radius, const Law& law) {
  std::vector<Surface> balls;
  for (const auto& body : m.bodies()) balls.push_back({body.name, ball(radius)});
  return {"c", balls, balls, law};
}

/// A tree on the world: a - b - c by hinges, d on b by a chain of two hinges, e and f free.
std::shared_ptr<const mechanics::MechanicalModel> tree(
    const mechanics::ConstraintSpec& loops = {}) {
  mechanics::MechanismBuilder b("tree");
  const auto add = [&](const char* name, const char* parent, const char* joint, double x) {
    auto body = body_on(name, joint, 1);
    body.parent = parent;
    body.placement.r = {x, 0, 0};
    if (body.joint.type == "revolute") body.joint.axis = {0, 1, 0};
    b.add(body);
  };
  add("a", "world", "revolute", 0);
  add("b", "a", "revolute", 1);
  add("c", "b", "revolute", 1);
  add("d", "b", "universal", 0.5);
  add("e", "world", "free", 0);
  add("f", "world", "free", 0);
  return std::make_shared<mechanics::MechanicalModel>(
      std::make_shared<const mechanics::Mechanism>(b.build()), std::vector<mechanics::BodyPort>{},
      loops);
}
using Names = std::set<std::pair<std::string, std::string>>;
Names names(const mechanics::Mechanism& m, const ContactModel::Placed& placed) {
  const auto name = [&](size_t seat) {
    for (const auto& body : m.bodies())
      if (body.node == placed.seats[seat].node) return body.name;
    return std::string("world");
  };
  Names all;
  for (const auto& p : placed.pairs) all.insert(std::minmax(name(p.a), name(p.b)));
  EXPECT_EQ(all.size(), placed.pairs.size()) << "one twice";
  return all;
}

/// Among all pairs, and among those that are near, where all are. Controls: named against each
/// other, two that a joint connects are a pair; balls that are smaller are not near.
TEST(EachOther, EveryTwoThatNoJointConnects) {
  const auto bodies = tree();
  const auto& m = bodies->mechanism();
  const ContactModel model(bodies, bodies, {among(m, 5, rough_law(0, 0.5))});
  const Names expected{{"a", "c"}, {"a", "d"}, {"c", "d"}, {"a", "e"}, {"b", "e"}, {"c", "e"},
                       {"d", "e"}, {"a", "f"}, {"b", "f"}, {"c", "f"}, {"d", "f"}, {"e", "f"}};
  const auto all = model.all_rigid();
  EXPECT_EQ(names(m, all), expected);
  const auto near = [&](const ContactModel& of) {
    const auto everything = of.all_rigid();
    Gaps<double> gaps(m, everything, Ends::off);
    gaps.place(m.neutral());
    NearPairs pairs(of);
    pairs.find(gaps.seat, gaps.seat);
    return names(m, pairs.placed());
  };
  EXPECT_EQ(near(model), expected);
  std::printf("  6 bodies: %zu of 15 pairs\n", all.pairs.size());
  const ContactModel two_sides(
      bodies, bodies, {{"c", {{"a", ball(5)}}, {{"b", ball(5)}, {"c", ball(5)}}, rigid_law(0)}});
  EXPECT_EQ(near(two_sides), (Names{{"a", "b"}, {"a", "c"}}));
  const ContactModel small(bodies, bodies, {among(m, 0.1, rigid_law(0))});
  EXPECT_EQ(near(small), (Names{{"a", "e"}, {"a", "f"}, {"e", "f"}}));
}

/// The joint of a loop connects its two bodies, a rod does not: one soft contact of balls that
/// overlap, whose energy is that of the pairs. Control: without the loop there is one pair more.
TEST(EachOther, AJointOfALoopConnects) {
  const auto energy = [&](const mechanics::ConstraintSpec& loops) {
    const auto bodies = tree(loops);
    const std::vector<Surface> both{{"a", ball(1)}, {"c", ball(1)}};
    const ContactModel model(bodies, bodies, {{"c", both, both, power_law(100, 1)}});
    const auto system = model.make_system<double>();
    const auto& m = bodies->mechanism();
    auto q = m.neutral();
    q[1] = M_PI / 2;  // of b: c is at the distance √2 of a
    return system->hamiltonian(bodies->state(q, Numbers(size_t(m.nv()), 0.0)));
  };
  mechanics::ConstraintSpec loop, rod;
  loop.loops.push_back({.name = "l", .type = "spherical", .a = {"a"}, .b = {"c"}});
  rod.rods.push_back({"r", {"a"}, {"c"}, 1});
  const double depth = 2 - std::sqrt(2.0), expected = 0.5 * 100 * depth * depth;
  const double apart = energy({}), by_rod = energy(rod), joined = energy(loop);
  std::printf("  energy %.15g, expected %.15g; with a rod %g, with a loop %g\n", apart, expected,
              by_rod, joined);
  EXPECT_NEAR(apart, expected, 1e-12);
  EXPECT_EQ(by_rod, apart);
  EXPECT_EQ(joined, 0);
}

}  // namespace
}  // namespace porthos::contact::each_other_test
