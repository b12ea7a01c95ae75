// Rigid contacts with Coulomb's friction in runs: sliding, sticking, rolling and what is between,
// against closed forms.
#include <random>

#include "contact/rigid.h"
#include "phs/network/network.h"
#include "tests/contact/rigid_run.h"

namespace porthos::contact::rigid_friction_test {
namespace {

using namespace test;

constexpr double g = 9.8125;

/// A block of 3 kg that moves in the plane x, z: it hangs on a rail along z, which a cart of 1 kg
/// takes along x. Its corner, a ball, touches an incline that rises with x.
struct Incline {
  static constexpr double cart = 1, block = 3, radius = 0.125;
  double angle, mu;
  std::shared_ptr<const mechanics::MechanicalModel> bodies;
  std::shared_ptr<const ContactModel> model;

  Incline(double slope, const Law& law) : angle(std::atan(slope)), mu(law.friction) {
    auto x = body_on("cart", "prismatic", cart), z = body_on("block", "prismatic", block);
    x.joint.axis = {1, 0, 0};
    z.joint.axis = {0, 0, 1};
    z.parent = "cart";
    bodies = mechanism_of({x, z}, g);
    Shape plane = ground();
    const double c = std::cos(angle), s = std::sin(angle);
    plane.pose.R = {{c, 0, s}, {0, 1, 0}, {-s, 0, c}};  // columns
    model = std::make_shared<ContactModel>(
        bodies, bodies,
        std::vector<Contact>{{"floor", {{"block", ball(radius)}}, {{"world", plane}}, law}});
  }
  /// On the incline, at the rate v up it.
  Numbers start(double v) const {
    return bodies->state(Numbers{0, radius / std::cos(angle)},
                         Numbers{v * std::cos(angle), v * std::sin(angle)});
  }
  /// s'' of sliding up (direction 1) or down (-1): the x and z parts of Newton's law with the
  /// normal force N and the friction -direction μ N.
  double acceleration(double direction) const {
    const double c = std::cos(angle), s = std::sin(angle), f = direction * mu;
    return -block * g / (block * s + c * (cart + block) * (c - f * s) / (s + f * c));
  }
  double along(const phs::State& state) const {
    return (state.x[0] + state.lo[0]) / std::cos(angle);
  }
};

/// Sent up an incline, the block stops where and when mu says; one that mu holds stays for 1000 s,
/// the other slides back. Controls: mu off by 1e-10; the soft contact creeps.
TEST(RigidFriction, ABlockOnAnIncline) {
  const double h = 1.0 / 32, slope = 0.5, v = 4;
  const auto sent = [&](double mu, double until) {
    const Incline block(slope, rough_law(0, mu));
    RigidRun run(*block.model, block.start(v), h);
    while (run.state.step * h < until && run.step()) {
    }
    return std::pair{block.along(run.state), std::fabs(run.defect())};
  };
  const Incline holds(slope, rough_law(0, 0.75)), slips(slope, rough_law(0, 0.25));
  const double stop = -v / holds.acceleration(1), distance = 0.5 * v * stop;
  const auto [where, ledger] = sent(0.75, 1);
  const auto [later, after] = sent(0.75, 1000);
  const double control = sent(0.75 + 1e-10, 1).first;
  const double turn = -v / slips.acceleration(1), top = 0.5 * v * turn;
  const double left = 2 - turn, back = top + 0.5 * slips.acceleration(-1) * left * left;
  const auto [slid, slid_ledger] = sent(0.25, 2);
  std::printf(
      "  stops at %.4f s; place off by %.1e m   bound 1e-12 (mu off by 1e-10: %.1e); moved in 999 "
      "s by %.1e m   bound 1e-12; slides back to %.1e m   bound 1e-12; ledgers %.1e, %.1e, %.1e J  "
      " bound 1e-12\n",
      stop, where - distance, control - distance, later - where, slid - back, ledger, after,
      slid_ledger);
  EXPECT_LE(std::fabs(where - distance), 1e-12);
  EXPECT_GT(std::fabs(control - distance), 1e-11);
  EXPECT_LE(std::fabs(later - where), 1e-12);
  EXPECT_LE(std::fabs(slid - back), 1e-12);
  EXPECT_LE(std::max({ledger, after, slid_ledger}), 1e-12);

  Law soft = power_law(1e5, 1, 0.5);
  soft.friction = 0.75;
  soft.creep = 1e-3;
  const Incline creeps(slope, soft);
  ContactRun run(*creeps.model, creeps.start(0), 1.0 / 2048);
  while (run.state.step < 2048 * 2) ASSERT_TRUE(run.step());
  std::printf("  the soft contact creeps by %.1e m in 2 s\n", creeps.along(run.state));
  EXPECT_LT(creeps.along(run.state), -1e-4);
}

/// tan α a little below and above mu, from rest.
TEST(RigidFriction, HoldsUpToMu) {
  for (const double off : {-1e-9, 0.0, 1e-9}) {
    const Incline block(0.5 * (1 + off), rough_law(0.5, 0.5));
    RigidRun run(*block.model, block.start(0), 1.0 / 32);
    while (run.state.step < 32 * 10) ASSERT_TRUE(run.step());
    std::printf("  slope/mu - 1 = %+.0e: moves by %.1e m in 10 s\n", off, block.along(run.state));
    if (off > 0)
      EXPECT_NEAR(block.along(run.state) / (50 * block.acceleration(-1)), 1, 1e-3);
    else
      EXPECT_LE(std::fabs(block.along(run.state)), 1e-13);
  }
}

/// A free ball of 2 kg and radius 1/4 on the plane z = 0, uniform unless `inertia` is given.
struct Ball {
  static constexpr double m = 2, r = 0.25;
  std::shared_ptr<const mechanics::MechanicalModel> body;
  std::shared_ptr<const ContactModel> model;

  explicit Ball(const Law& law, double gravity = g, double tilt = 0) {
    auto spec = body_on("ball", "free", m);
    const double I = 0.4 * m * r * r;
    spec.mass.inertia = {I, 0, 0, I, 0, I};
    body = mechanism_of({spec}, gravity);
    Shape plane = ground();
    const double c = std::cos(tilt), s = std::sin(tilt);
    plane.pose.R = {{c, 0, s}, {0, 1, 0}, {-s, 0, c}};  // columns
    model = std::make_shared<ContactModel>(
        body, body, std::vector<Contact>{{"table", {{"ball", ball(r)}}, {{"world", plane}}, law}});
  }
  Numbers start(const Vec3d& at, const Vec3d& v, const Vec3d& w) const {
    Numbers q = body->mechanism().neutral();
    q[0] = at.x, q[1] = at.y, q[2] = at.z;
    return body->state(q, Numbers{w.x, w.y, w.z, v.x, v.y, v.z});
  }
};
Vec3d velocity(const phs::State& s, double mass) {
  return {s.x[7] / mass, s.x[8] / mass, s.x[9] / mass};
}
Vec3d position(const phs::State& s) {
  return {s.x[0] + s.lo[0], s.x[1] + s.lo[1], s.x[2] + s.lo[2]};
}

/// Billiards: a ball that starts with a slip u rolls after 2|u|/(7 μ g), at the velocity
/// v - (2/7) u, and its centre has gone a parabola. Friction takes (m/7)|u|². Oblique, with spin
/// about all axes. Control: μ off by 1e-8 rolls elsewhere.
TEST(RigidFriction, ABallThatSlidesEndsRolling) {
  const double mu = 0.125, h = 1.0 / 64;
  const Vec3d v0{1.5, 0.5, 0}, w0{3, -2, 5};
  const Vec3d u = v0 + cross(w0, Vec3d{0, 0, -Ball::r});
  const double slip = norm(u), rolls = 2 * slip / (7 * mu * g);
  const Vec3d s = (1 / slip) * u, end = v0 - (2.0 / 7) * u;
  const Vec3d at = rolls * v0 - (0.5 * mu * g * rolls * rolls) * s + (2 - rolls) * end;
  const auto run_of = [&](double friction) {
    const Ball b(rough_law(0, friction));
    RigidRun run(*b.model, b.start({0, 0, Ball::r}, v0, w0), h);
    while (run.state.step * h < 2 && run.step()) {
    }
    return std::tuple{position(run.state), velocity(run.state, Ball::m), run.defect(),
                      double(run.lost), run.state.x[2] - Ball::r};
  };
  const auto [x, v, defect, lost, gap] = run_of(mu);
  const auto control = run_of(mu + 1e-8);
  const Vec3d on{at.x, at.y, Ball::r};
  std::printf(
      "  rolls after %.4f s; place off by %.1e m   bound 1e-12 (mu off by 1e-8: %.1e), velocity by "
      "%.1e m/s   bound 1e-12, loss by %.1e J, ledger %.1e J   bound 1e-12; gap %.1e m\n",
      rolls, norm(x - on), norm(std::get<0>(control) - on), norm(v - end),
      lost - Ball::m / 7 * slip * slip, defect, gap);
  EXPECT_LE(norm(x - on), 1e-12);
  EXPECT_GT(norm(std::get<0>(control) - on), 1e-9);
  EXPECT_LE(norm(v - end), 1e-12);
  EXPECT_NEAR(lost, Ball::m / 7 * slip * slip, 1e-12);
  EXPECT_LE(std::fabs(defect), 1e-12);
}

/// A ball on a slope rolls with (5/7) g sin α if μ >= (2/7) tan α; with less it slides.
TEST(RigidFriction, ABallOnASlopeRollsOrSlides) {
  const double tilt = std::atan(0.5), h = 1.0 / 64, t = 2;
  for (const double mu : {1.001 / 7, 0.999 / 7, 0.05}) {
    const Ball b(rough_law(0, mu), g, tilt);
    const double c = std::cos(tilt), s = std::sin(tilt);
    RigidRun run(*b.model, b.start({-s * Ball::r, 0, c * Ball::r}, {0, 0, 0}, {0, 0, 0}), h);
    while (run.state.step * h < t) ASSERT_TRUE(run.step());
    const Vec3d x = position(run.state);
    const double way = -(x.x + s * Ball::r) * c - (x.z - c * Ball::r) * s;
    const double a = mu > 1.0 / 7 ? 5.0 / 7 * g * s : g * (s - mu * c);
    std::printf("  mu %.4f: %.6f m, off by %.1e m   bound 1e-12; loss %.3f J, ledger %.1e J\n", mu,
                way, way - 0.5 * a * t * t, double(run.lost), run.defect());
    EXPECT_NEAR(way, 0.5 * a * t * t, 1e-12);
    EXPECT_LE(std::fabs(run.defect()), 1e-12);
    EXPECT_EQ(run.lost > 1e-9, mu < 1.0 / 7);
  }
}

/// A ball rolls on a turntable of 1e6 kg m²: its centre goes round a circle with 2/7 of the rate of
/// the table. Control: 1/4 of it.
TEST(RigidFriction, ABallOnATurntable) {
  const double W = 3, h = 1.0 / 64, R = 0.5;
  auto table = body_on("table", "revolute", 1), spec = body_on("ball", "free", Ball::m);
  const double I = 0.4 * Ball::m * Ball::r * Ball::r;
  table.joint.axis = {0, 0, 1};
  table.mass.inertia = {1e12, 0, 0, 1e12, 0, 1e12};
  spec.mass.inertia = {I, 0, 0, I, 0, I};
  const auto bodies = mechanism_of({table, spec}, g);
  const ContactModel model(
      bodies, bodies,
      {{"on", {{"ball", ball(Ball::r)}}, {{"table", ground()}}, rough_law(0, 0.9)}});
  // Rolling at (R, 0) with v = (0, V): ω × (-r z) = table - v there.
  const double V = 2.0 / 7 * W * R, wx = -(W * R - V) / Ball::r * -1;
  Numbers q = bodies->mechanism().neutral();
  q[1] = R;
  q[3] = Ball::r;
  RigidRun run(model, bodies->state(q, Numbers{W, wx, 0, 0, 0, V, 0}), h);
  double off = 0, control = 0;
  while (run.state.step < 64 * 4) {
    ASSERT_TRUE(run.step());
    const double t = double(run.state.step) * h, a = 2.0 / 7 * W * t, wrong = W / 4 * t;
    const double x = run.state.x[1], y = run.state.x[2];
    off = std::max(off, std::hypot(x - R * std::cos(a), y - R * std::sin(a)));
    control = std::max(control, std::hypot(x - R * std::cos(wrong), y - R * std::sin(wrong)));
  }
  std::printf("  circle off by %.1e m   bound 1e-10 (rate W/4: %.2f)\n", off, control);
  EXPECT_LE(off, 1e-10);
  EXPECT_GT(control, 0.01);
}

/// A top whose centre of mass lies below that of its sphere slides and turns over: Jellett's
/// L · (r z - e n) stays, whatever the friction. Control: L · z does not.
TEST(RigidFriction, ATippeTopKeepsJellettsIntegral) {
  const double m = 0.02, r = 0.025, e = 0.2 * r, h = 1e-3, mu = 0.02;
  auto spec = body_on("top", "free", m);
  const double A = 0.4 * m * r * r, C = 0.38 * m * r * r;
  spec.mass.inertia = {A, 0, 0, A, 0, C};
  const auto body = mechanism_of({spec}, g);
  Shape sphere = ball(r);
  sphere.pose.r = {0, 0, e};
  const ContactModel model(body, body,
                           {{"table", {{"top", sphere}}, {{"world", ground()}}, rough_law(0, mu)}});
  const double lean = 1.2;
  Numbers q = body->mechanism().neutral();
  q[3] = std::cos(lean / 2), q[4] = std::sin(lean / 2), q[5] = 0, q[6] = 0;
  q[2] = r - e * std::cos(lean);
  RigidRun run(model, body->state(q, Numbers{0, 0, 150, 0, 0, 0}), h);
  const auto measure = [&] {
    const auto w = body->rates(run.state.x);
    const double *k = run.state.x.data() + 3, a = k[0], b = k[1], c = k[2], d = k[3];
    const Vec3d z{2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d};
    // z of the world in the body's axes
    const Vec3d L{A * w[0], A * w[1], C * w[2]}, to{r * z.x, r * z.y, r * z.z - e};
    return std::array{dot(L, to), dot(L, z), z.z};
  };
  const auto first = measure();
  double off = 0, control = 0, least = 1;
  while (run.state.step < 6000) {
    ASSERT_TRUE(run.step()) << run.state.step << ' ' << run.method->remark();
    const auto now = measure();
    off = std::max(off, std::fabs(now[0] / first[0] - 1));
    control = std::max(control, std::fabs(now[1] / first[1] - 1));
    least = std::min(least, now[2]);
  }
  std::printf(
      "  leans to cos = %.3f; Jellett's integral off by %.1e   bound 1e-10, L z by %.2f; lost %.4f "
      "J, ledger %.1e J   bound 1e-12\n",
      least, off, control, double(run.lost), run.defect());
  EXPECT_LE(off, 1e-10);
  EXPECT_GT(control, 0.1);
  EXPECT_LT(least, 0.4);
  EXPECT_LE(std::fabs(run.defect()), 1e-12);
}

/// A spinning ball bounces: with much friction its point sticks and leaves with no slip,
/// v = v0 - (2/7) u; with little, the slip loses (7/2) μ (1 + e) of the approach. The normal rate
/// is Newton's, since W of a ball has no coupling.
TEST(RigidFriction, ASpinningBallBounces) {
  const double e = 0.75, fall = 1, h = 1.0 / 64;
  const double hits = std::sqrt(2 * fall / g), vn = g * hits;
  for (const double mu : {0.05, 0.8}) {
    const Ball b(rough_law(e, mu));
    const Vec3d v0{2, 1, 0}, w0{0, -10, 4};
    RigidRun run(*b.model, b.start({0, 0, Ball::r + fall}, v0, w0), h);
    while (run.jumps.empty()) ASSERT_TRUE(run.step());
    const Vec3d u = v0 + cross(w0, Vec3d{0, 0, -Ball::r});
    const double slip = norm(u), part = std::min(2.0 / 7, mu * (1 + e) * vn / slip);
    const double t = double(run.state.step) * h - run.jumps[0].t;
    const Vec3d v = velocity(run.state, Ball::m), to = v0 - part * u;
    const double mean = slip - 0.5 * 3.5 * part * slip;
    std::printf(
        "  mu %.2f: velocity off by %.1e m/s   bound 1e-13; loss by %.1e J   bound 1e-13; ledger "
        "%.1e J\n",
        mu, norm(v - Vec3d{to.x, to.y, e * vn - g * t}),
        double(run.lost) - Ball::m * (0.5 * (1 - e * e) * vn * vn + part * slip * mean),
        run.defect());
    EXPECT_LE(norm(v - Vec3d{to.x, to.y, e * vn - g * t}), 1e-13);
    EXPECT_NEAR(double(run.lost), Ball::m * (0.5 * (1 - e * e) * vn * vn + part * slip * mean),
                1e-13);
  }
}

/// 100 bodies with a round nose off their centre of mass fall, bounce, slide and roll: no step
/// gains by friction or impacts, and every ledger closes.
TEST(RigidFriction, DroppedBodiesOnlyLose) {
  std::mt19937_64 random(5);
  const auto between = [&](double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(random);
  };
  double worst = 0, least = 0, lost = 1;
  size_t impacts = 0;
  for (int trial = 0; trial < 100; ++trial) {
    auto spec = body_on("body", "free", 1);
    const double a = between(0.01, 0.02), b = between(0.01, 0.02), c = between(0.012, 0.02);
    spec.mass.inertia = {a, 0, 0, b, 0, c};
    const auto body = mechanism_of({spec}, g);
    Shape nose = ball(0.2);
    nose.pose.r = {between(-0.05, 0.05), between(-0.05, 0.05), between(-0.05, 0.05)};
    const ContactModel model(body, body,
                             {{"g",
                               {{"body", nose}},
                               {{"world", ground()}},
                               rough_law(between(0, 0.9), between(0, 1))}});
    Numbers q = body->mechanism().neutral();
    q[2] = 0.5;
    RigidRun run(model,
                 body->state(q, Numbers{between(-5, 5), between(-5, 5), between(-5, 5),
                                        between(-1, 1), between(-1, 1), 0}),
                 1.0 / 256);
    const double before = double(run.energy());
    while (run.state.step < 256 * 3)
      ASSERT_TRUE(run.step()) << trial << " at " << run.state.step << ' ' << run.method->remark();
    worst = std::max(worst, std::fabs(run.defect()) / before);
    least = std::min(least, run.least_loss);
    lost = std::min(lost, double(run.lost) / before);
    impacts += run.jumps.size();
  }
  std::printf(
      "  100 bodies, %zu impacts; ledgers off by %.1e of the energy   bound 1e-9; least loss of a "
      "step %.1e J   bound 0; each loses %.2f or more\n",
      impacts, worst, least, lost);
  EXPECT_LE(worst, 1e-9);
  EXPECT_GE(least, -1e-15);
  EXPECT_GT(lost, 0.01);
}

/// A block on an incline that a smooth force shakes: it sticks, slides up and down. The methods
/// keep their order over all that.
TEST(RigidFriction, MethodsKeepTheirOrder) {
  const Incline block(0.25, rough_law(0, 0.5));
  phs::Network n("shaken");
  n.add("mechanism", block.model).main("mechanism");
  n.source("shake", "mechanism.cart.force", phs::sine(25, 0.75));
  const auto whole = n.build();
  const auto at_end = [&](const char* method, double h) {
    RigidRun run(*whole, *block.model, block.start(0), h, method);
    while (run.state.step * h < 4) {
      if (run.step()) continue;
      ADD_FAILURE() << method << ' ' << h << ' ' << run.state.step;
      break;
    }
    return std::pair{block.along(run.state), std::fabs(run.defect())};
  };
  const auto [exact, defect] = at_end("gauss16", 1.0 / 64);
  const double known = std::fabs(exact - at_end("gauss16", 1.0 / 100).first);
  std::printf("  at %.4f m, known to %.1e m; ledger %.1e J\n", exact, known, defect);
  EXPECT_LE(known, 1e-13);
  EXPECT_LE(defect, 1e-12);
  expect_orders(
      {{"midpoint", 2, 1.0 / 16, 4}, {"gauss4", 4, 1.0 / 16, 4}, {"gauss6", 6, 1.0 / 8, 4}},
      [&, end = exact](const char* method, double h) { return at_end(method, h).first - end; });
}

/// A ball sent across a slope: its slip u turns downhill as it stops. With the angle θ from there
/// u (b + a cos θ) falls at b² - a², a = g sin α and b = (7/2) μ g cos α. While it slides the
/// methods keep their order; the last steps before it rolls have order 2.
TEST(RigidFriction, ASlipThatTurnsAsItStops) {
  const double tilt = std::atan(0.25), mu = 0.25, start = 2, c = std::cos(tilt), s = std::sin(tilt);
  const double a = g * s, b = 3.5 * mu * g * c, stop = start * b / (b * b - a * a);
  const Ball ball_on(rough_law(0, mu), g, tilt);
  const auto at = [&](const char* method, double h, double t) {
    RigidRun run(*ball_on.model,
                 ball_on.start({-s * Ball::r, 0, c * Ball::r}, {0, start, 0}, {0, 0, 0}), h,
                 method);
    while (run.state.step * h < t && run.step()) {
    }
    EXPECT_EQ(run.outcome, Outcome::ok);
    return run;
  };
  const auto law = [&](const RigidRun& run, double t) {
    const auto w = ball_on.body->rates(run.state.x);
    const double *k = run.state.x.data() + 3, q0 = k[0], q1 = k[1], q2 = k[2], q3 = k[3];
    const Vec3d own{w[0], w[1], w[2]}, axis{q1, q2, q3};
    const Vec3d turned = own + 2.0 * cross(axis, cross(axis, own) + q0 * own);
    const Vec3d u = velocity(run.state, Ball::m) + cross(turned, (-Ball::r) * Vec3d{-s, 0, c});
    (void)q3;
    return (norm(u) * b + a * dot(u, Vec3d{-c, 0, -s})) / (start * b - (b * b - a * a) * t) - 1;
  };
  const double early = 0.125;
  for (const auto& [method, order] : {std::pair{"gauss4", 4}, {"gauss6", 6}}) {
    const double first = std::fabs(law(at(method, 1.0 / 64, early), early)),
                 last = std::fabs(law(at(method, 1.0 / 256, early), early));
    std::printf("  sliding, %s: off by %.1e to %.1e, order %.2f   bound %.1f\n", method, first,
                last, std::log2(first / last) / 2, order - 0.5);
    EXPECT_GE(std::log2(first / last) / 2, order - 0.5);
  }
  const double late = std::fabs(law(at("gauss16", 1.0 / 64, early), early));
  EXPECT_LE(late, 1e-12);
  const double t = 0.5;
  const auto place = [&](double h) { return position(at("gauss16", h, t).state); };
  const Vec3d exact = place(1.0 / 4096);
  const double known = norm(exact - place(1.0 / 3000)), coarse = norm(place(1.0 / 32) - exact),
               fine = norm(place(1.0 / 512) - exact), order = std::log2(coarse / fine) / 4;
  std::printf(
      "  gauss16, h = 1/64: off by %.1e   bound 1e-12 while it slides; it stops at %.4f s; place "
      "after: %.1e m with 1/32 s, %.1e m with 1/512 s (known to %.1e m): order %.2f   bound 1.5\n",
      late, stop, coarse, fine, known, order);
  EXPECT_GE(order, 1.5);
  EXPECT_LE(coarse, 1e-3);
  EXPECT_LE(known, 0.5 * fine);
}

/// A rod of half-length 1 that slides on its end is pressed without limit where
/// 1 + 3 cos² θ - 3 μ sin θ cos θ is not positive: the step ends and says so. Control: μ = 1.
TEST(RigidFriction, PainlevesRodIsNamed) {
  const auto slid = [](double mu) {
    auto x = body_on("x", "prismatic", 1e-9), z = body_on("z", "prismatic", 1e-9),
         rod = body_on("rod", "revolute", 1);
    x.joint.axis = {1, 0, 0};
    z.joint.axis = {0, 0, 1};
    rod.joint.axis = {0, 1, 0};
    z.parent = "x";
    rod.parent = "z";
    rod.mass.inertia = {1.0 / 3, 0, 0, 1.0 / 3, 0, 1.0 / 3};
    const auto bodies = mechanism_of({x, z, rod}, g);
    Shape end = ball(1e-6);
    end.pose.r = {-1, 0, 0};
    const ContactModel model(bodies, bodies,
                             {{"floor", {{"rod", end}}, {{"world", ground()}}, rough_law(0, mu)}});
    const double angle = std::atan(2);  // the end lies behind and below the centre
    RigidRun run(
        model, bodies->state(Numbers{0, std::sin(angle) + 1e-6 - 1e-12, -angle}, Numbers{-4, 0, 0}),
        1.0 / 256);
    while (run.state.step < 16 && run.step()) {
    }
    return std::pair{run.outcome, run.method->remark()};
  };
  const auto [outcome, remark] = slid(1.5);
  const auto control = slid(1);
  std::printf("  mu 1.5: %s (%s); mu 1: %s\n", to_string(outcome), remark.c_str(),
              to_string(control.first));
  EXPECT_EQ(outcome, Outcome::jammed);
  EXPECT_TRUE(remark.starts_with("friction presses 'floor' harder than it can yield")) << remark;
  EXPECT_EQ(control.first, Outcome::ok);
}

/// Of several points with friction the forces would not be unique.
TEST(RigidFriction, IsRefusedInASentence) {
  const auto body = mechanism_of({body_on("box", "free", 2)}, g);
  const auto refusal = [&](const std::vector<Contact>& contacts) -> std::string {
    try {
      ContactModel(body, body, contacts).check_friction_of_events();
    } catch (const InvalidArgument& why) {
      return why.what();
    }
    return "none";
  };
  Shape box;
  box.kind = Kind::box;
  box.half = {0.3, 0.2, 0.1};
  EXPECT_EQ(refusal({{"g", {{"box", box}}, {{"world", ground()}}, rough_law(0, 0.5)}}),
            "contact 'g': a box and a plane touch in 8 points and have friction, expected shapes "
            "that touch in one, for example a sphere, or method = \"moreau\"");
  EXPECT_EQ(refusal({{"g", {{"box", ball(0.1)}}, {{"world", ground()}}, rough_law(0, 0.5)},
                     {"h", {{"box", ball(0.2)}}, {{"world", ground()}}, rough_law(0, 0.5)}}),
            "contact 'h': a link of it has rigid friction at another point, in 'g', expected one "
            "such point on a link, or method = \"moreau\"");
  EXPECT_EQ(refusal({{"g", {{"box", ball(0.1)}}, {{"world", ground()}}, rough_law(0, -1)}}),
            "contact 'g': friction is -1, expected 0 or more");
}

}  // namespace
}  // namespace porthos::contact::rigid_friction_test
