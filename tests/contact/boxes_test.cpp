// Boxes that touch boxes and capsules, with soft laws and by time stepping; cylinders that stand.
#include "tests/contact/stepped_run.h"

namespace porthos::contact::boxes_test {
namespace {

using namespace test;

constexpr double g = 9.8125, m = 2, r = 0.02;

Shape box(Vec3d half, Vec3d at = {0, 0, 0}) {
  Shape s;
  s.kind = Kind::box;
  s.half = half;
  s.radius = r;
  s.pose.r = at;
  return s;
}
mechanics::BodySpec body(const char* name, const Vec3d& half) {
  auto spec = body_on(name, "free", m);
  const auto of = [](double y, double z) { return m / 3 * (y * y + z * z); };
  spec.mass.inertia = {of(half.y, half.z), 0, 0, of(half.x, half.z), 0, of(half.x, half.y)};
  return spec;
}
/// A free box, or several of the same size, and a table whose top is at z = 0.
struct Boxes {
  Vec3d half;
  std::shared_ptr<const mechanics::MechanicalModel> bodies;
  std::shared_ptr<const ContactModel> model;

  Boxes(const Vec3d& size, const std::vector<const char*>& names, const Shape& table,
        const Law& law)
      : half(size) {
    std::vector<mechanics::BodySpec> specs;
    std::vector<Surface> a, b;
    for (const char* name : names) {
      specs.push_back(body(name, half));
      a.push_back({name, box(half)});
    }
    b = a;
    b.insert(b.begin(), {"world", table});
    bodies = mechanism_of(specs, g);
    model =
        std::make_shared<ContactModel>(bodies, bodies, std::vector<Contact>{{"touch", a, b, law}});
  }
  /// Places of the boxes, level and at rest.
  Numbers start(const std::vector<Vec3d>& places) const {
    Numbers q = bodies->mechanism().neutral();
    for (size_t i = 0; i < places.size(); ++i)
      for (size_t k = 0; k < 3; ++k) q[7 * i + k] = places[i][int(k)];
    return bodies->state(q, Numbers(6 * places.size(), 0.0));
  }
};
const Shape table = box({1, 1, 0.5}, {0, 0, -0.5});
const Vec3d brick{0.3, 0.2, 0.1};

double at(const phs::State& s, size_t i) { return s.x[i] + s.lo[i]; }

/// Lowered onto a table with loss, a tilted box stands on four corners, each with a quarter of its
/// weight. Control: without loss it goes on bouncing, and keeps its energy.
TEST(Boxes, ABoxStandsOnABox) {
  const double k = 2e4, rest = brick.z - m * g / (4 * k);
  for (const double loss : {0.0, 2.0}) {
    const Boxes one(brick, {"a"}, table, power_law(k, 1, loss));
    Numbers x = one.start({{0.1, -0.2, brick.z + 1e-3}});
    x[3] = std::cos(0.02);
    x[4] = std::sin(0.02);
    ContactRun run(*one.model, x, 1.0 / 256);
    double worst = 0;
    for (int i = 0; i < (loss > 0 ? 2560 : 512) && run.step(); ++i)
      worst = std::max(worst, std::fabs(run.defect()));
    const double off = std::fabs(at(run.state, 2) - rest) + std::fabs(at(run.state, 4));
    std::printf("  loss %g: ledger %.1e J   bound 1e-13, off its rest by %.1e   bound 1e-14\n",
                loss, worst, off);
    EXPECT_EQ(run.outcome, Outcome::ok);
    EXPECT_LE(worst, 1e-13);
    EXPECT_GE(run.least_work, 0);
    if (loss > 0)
      EXPECT_LE(off, 1e-14);
    else
      EXPECT_GT(off, 1e-2);
  }
}

/// Boxes of one size lie flush: of the edges that are parallel none jumps, and corners of both
/// bear, so the upper one sinks by an eighth of its weight.
TEST(Boxes, FlushBoxes) {
  const double k = 2e4, sunk = m * g / (2 * k);
  const Boxes two(brick, {"a", "b"}, table, power_law(k, 1, 2));
  const double lower = brick.z - sunk, upper = 2 * brick.z - m * g / (8 * k);

  ContactRun run(*two.model, two.start({{0, 0, lower}, {0, 0, lower + 2 * brick.z - 1e-4}}),
                 1.0 / 128);
  double worst = 0;
  for (int i = 0; i < 384 && run.step(); ++i) worst = std::max(worst, std::fabs(run.defect()));
  const double off = std::max(std::fabs(at(run.state, 2) - lower),
                              std::fabs(at(run.state, 9) - at(run.state, 2) - upper)),
               moved = std::max(std::fabs(at(run.state, 0)), std::fabs(at(run.state, 7)));
  std::printf("  ledger %.1e J   bound 1e-13; off by %.1e, moved %.1e m   bounds 1e-12\n", worst,
              off, moved);
  EXPECT_EQ(run.outcome, Outcome::ok);
  EXPECT_LE(worst, 1e-13);
  EXPECT_GE(run.least_work, 0);
  EXPECT_LE(off, 1e-12);
  EXPECT_LE(moved, 1e-12);
}

/// A beam with an edge up, and a box that falls on it with an edge down, across: no corner touches.
/// Elastic bounces keep the energy. Control: the corners of the box go below the beam's edge.
TEST(Boxes, EdgesThatCross) {
  const double k = 2e4, core = std::sqrt(2.0) * (brick.z - r) + r;
  Shape beam = box({0.1, 1, 0.1}, {0, 0, -core});
  beam.pose.R = mechanics::rotation_from_rpy(0, 3.14159265358979323846 / 4, 0);
  const Boxes one({0.3, 0.1, 0.1}, {"a"}, beam, power_law(k, 1));
  Numbers x = one.start({{0.01, 0.02, core + 0.01}});
  const double half = 3.14159265358979323846 / 8;
  x[3] = std::cos(half);
  x[4] = std::sin(half);
  ContactRun run(*one.model, x, 1.0 / 512);
  double worst = 0, highest = 0, lowest = HUGE_VAL;
  for (int i = 0; i < 256 && run.step(); ++i) {
    worst = std::max(worst, std::fabs(run.defect()));
    lowest = std::min(lowest, at(run.state, 2) - core);
    if (i > 60) highest = std::max(highest, at(run.state, 2) - core);
  }
  std::printf("  ledger %.1e J   bound 1e-13; from %.2e to %.2e m\n", worst, lowest, highest);
  EXPECT_EQ(run.outcome, Outcome::ok);
  EXPECT_LE(worst, 1e-13);
  EXPECT_LT(lowest, -2e-3);
  EXPECT_GT(lowest, -0.9 * r);
  EXPECT_GT(highest, 1e-3);
}

/// A brick over the end of a table, whose flat part ends where its edge begins to be round, falls
/// where its middle is beyond that: by a soft law and by time stepping.
TEST(Boxes, AnOverhangFallsBeyondItsMiddle) {
  Law soft = power_law(2e4, 1, 2);
  soft.friction = 0.5;
  soft.creep = 1e-3;
  double tilt[2][2];
  for (const int rigid : {0, 1})
    for (const int falls : {0, 1}) {
      const Boxes one(brick, {"a"}, table, rigid ? rough_law(0, 0.5) : soft);
      const Numbers x = one.start({{1 - r + (falls ? 0.01 : -0.01), 0, brick.z}});
      Outcome outcome = Outcome::ok;
      const auto end = [&](auto run) {
        while (run.state.step < (rigid ? 256 : 1024) && run.step()) continue;
        outcome = run.outcome;
        EXPECT_LE(std::fabs(run.defect()), 1e-12);
        return std::fabs(at(run.state, 5));
      };
      tilt[rigid][falls] = rigid ? end(Stepped(*one.model, x, 1.0 / 256))
                                 : end(ContactRun(*one.model, x, 1.0 / 1024));
      EXPECT_EQ(outcome, Outcome::ok);
    }
  std::printf("  soft: tilt %.1e, %.1e; rigid %.1e, %.1e   bounds 1e-2, 3e-2\n", tilt[0][0],
              tilt[0][1], tilt[1][0], tilt[1][1]);
  for (const auto& [stays, falls] : tilt) {
    EXPECT_LE(stays, 1e-2);
    EXPECT_GT(falls, 3e-2);
  }
}

/// Three bricks, flush and as a stair, stay for 10 s by time stepping. Control: without friction a
/// shaken one slides.
TEST(Boxes, AStackStays) {
  for (const double shift : {0.0, 0.1}) {
    const Boxes pile(brick, {"a", "b", "c"}, table, rough_law(0, 0.5));
    const Numbers x =
        pile.start({{0, 0, brick.z}, {shift, 0, 3 * brick.z}, {2 * shift, 0, 5 * brick.z}});
    Stepped run(*pile.model, x, 1.0 / 256);
    run.run(10);
    double moved = 0;
    for (size_t i = 0; i < 21; ++i) moved = std::max(moved, std::fabs(at(run.state, i) - x[i]));
    std::printf(
        "  stair of %g m: moved %.1e   bound 1e-9; ledger %.1e J   bound 1e-12; least loss "
        "of a step %.1e J   bound -1e-9\n",
        shift, moved, run.defect(), run.least_loss);
    EXPECT_LE(moved, 1e-9);
    EXPECT_LE(std::fabs(run.defect()), 1e-12);
    EXPECT_GE(run.least_loss, -1e-9);
  }
}

/// A capsule that lies across the end of a table falls where its middle is beyond the flat part.
TEST(Boxes, ACapsuleLiesOnABox) {
  for (const bool falls : {false, true}) {
    auto spec = body("a", {0.3, 0.05, 0.05});
    const auto bodies = mechanism_of({spec}, g);
    Shape rod;
    rod.kind = Kind::capsule;
    rod.half_length = 0.3;
    rod.radius = 0.05;
    rod.pose.R = mechanics::rotation_from_rpy(0, 3.14159265358979323846 / 2, 0);
    const ContactModel model(bodies, bodies,
                             {{"touch", {{"a", rod}}, {{"world", table}}, rough_law(0, 0.5)}});
    Numbers q = bodies->mechanism().neutral();
    q[0] = 1 - r + (falls ? 0.01 : -0.01);
    q[2] = rod.radius;
    Stepped run(model, bodies->state(q, Numbers(6, 0.0)), 1.0 / 256);
    run.run(2);
    std::printf("  %s: z %.2e, ledger %.1e J   bound 1e-12\n", falls ? "falls" : "stays",
                at(run.state, 2), run.defect());
    EXPECT_LE(std::fabs(run.defect()), 1e-12);
    if (falls)
      EXPECT_LT(at(run.state, 2), -0.5);
    else
      EXPECT_NEAR(at(run.state, 2), rod.radius, 1e-9);
  }
}

/// By time stepping a cylinder stands on a slope below 2 r to its length, and tips above it.
/// Standing, it leans on its lowest point after some steps, and moves no more.
TEST(Boxes, ACylinderTipsWhereItShould) {
  Shape can;
  can.kind = Kind::cylinder;
  can.radius = 0.1;
  can.half_length = 0.15;
  auto spec = body("a", {0.087, 0.087, 0.15});
  for (const double part : {0.0, 0.5, 0.98, 1.02}) {
    const double slope = part * can.radius / can.half_length, c = 1 / std::hypot(1, slope);
    mechanics::MechanismBuilder builder("can");
    builder.add(spec).gravity({-g * slope * c, 0, -g * c});
    const auto bodies = std::make_shared<mechanics::MechanicalModel>(
        std::make_shared<const mechanics::Mechanism>(builder.build()));
    const ContactModel model(bodies, bodies,
                             {{"floor", {{"a", can}}, {{"world", ground()}}, rough_law(0, 1)}});
    Numbers q = bodies->mechanism().neutral();
    q[2] = can.half_length;
    Stepped run(model, bodies->state(q, Numbers(6, 0.0)), 1.0 / 256);
    run.run(2);
    const Numbers at_rest{at(run.state, 0), at(run.state, 1), at(run.state, 2)};
    run.run(8);
    double moved = 0;
    for (size_t i = 0; i < 3; ++i)
      moved = std::max(moved, std::fabs(at(run.state, i) - at_rest[i]));
    const double tilt = std::hypot(at(run.state, 4), at(run.state, 5));
    std::printf(
        "  slope %.2f of the limit: tilt %.1e   bound 1e-3, moved by %.1e m from 2 to 8 s   "
        "bound 1e-10; ledger %.1e J   bound 1e-12\n",
        part, tilt, moved, run.defect());
    EXPECT_LE(std::fabs(run.defect()), 1e-12);
    EXPECT_LE(moved, part < 1 ? 1e-10 : HUGE_VAL);
    EXPECT_LE(tilt, part < 1 ? 1e-3 : HUGE_VAL);
    EXPECT_GT(tilt, part < 1 ? -1 : 0.1);
  }
}

/// What these pairs cannot do is said by name.
TEST(Boxes, SharpEdgesAndTheSmoothLawAreRefused) {
  const auto why = [](double radius, const Law& law) -> std::string {
    Shape top = table;
    top.radius = radius;
    const auto bodies = mechanism_of({body("a", brick)}, g);
    Shape own = box(brick);
    own.radius = radius;
    try {
      ContactModel(bodies, bodies, {{"touch", {{"a", own}}, {{"world", top}}, law}});
    } catch (const InvalidArgument& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_EQ(why(0, rough_law(0, 0.5)),
            "contact 'touch': the boxes on 'a' and 'world' have sharp edges, whose normals are not "
            "unique: expected a shape with a radius for one of them");
  Law smooth;
  smooth.stiffness = 1e4;
  smooth.width = 1e-3;
  EXPECT_EQ(why(r, smooth),
            "contact 'touch': the smooth law pushes at a distance, where gaps of edges, of a box "
            "on 'a' and a box on 'world', have kinks: expected law = \"power\", \"hertz\" or "
            "\"rigid\"");
  EXPECT_EQ(why(r, power_law(1e4, 1)), "");
}

}  // namespace
}  // namespace porthos::contact::boxes_test
