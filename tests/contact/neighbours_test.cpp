// The search for neighbours: exactly the balls that meet, and every pair that can touch in a step.
#include <random>
#include <set>

#include "contact/detail/gaps.h"
#include "contact/detail/near_pairs.h"
#include "tests/contact/rigid_run.h"

namespace porthos::contact::neighbours_test {
namespace {

using namespace test;
using Pairs = std::vector<std::pair<size_t, size_t>>;

/// Balls of sizes over six decades, near each other, far out, and without a bound: those that meet
/// by looking at all pairs. Control: balls smaller by 1 % meet less often.
TEST(Neighbours, ExactlyTheBallsThatMeet) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> any;
  size_t meet = 0, fewer = 0;
  Neighbours neighbours;
  for (int scene = 0; scene < 200; ++scene) {
    std::vector<Bound> balls;
    const double spread = std::exp(2 * any(random)), sizes = scene % 4;
    for (int i = 0; i < 80; ++i) {
      const double far = i % 20 == 7 ? 1e9 : i % 20 == 8 ? 1e30 : 1;
      balls.push_back({far * spread * Vec3d{any(random), any(random), any(random)},
                       i % 40 == 3 ? HUGE_VAL : 0.3 * std::exp(sizes * any(random))});
    }
    balls.push_back({{NAN, 0, 0}, 1});
    const auto found = [&] {
      Pairs all;
      neighbours.find(balls, [&](size_t i, size_t j) { all.push_back({i, j}); });
      std::sort(all.begin(), all.end());
      return all;
    };
    Pairs expected;
    for (size_t i = 0; i < balls.size(); ++i)
      for (size_t j = i + 1; j < balls.size(); ++j)
        if (!(norm(balls[i].centre - balls[j].centre) > balls[i].radius + balls[j].radius) ||
            std::max(norm(balls[i].centre), norm(balls[j].centre)) > 1e20)
          expected.push_back({i, j});
    const auto all = found();
    EXPECT_EQ(std::set(all.begin(), all.end()).size(), all.size()) << "one twice";
    // Balls further out than 1e15 cells count as meeting all.
    for (const auto& each : expected)
      EXPECT_TRUE(std::binary_search(all.begin(), all.end(), each)) << "scene " << scene;
    for (const auto& [i, j] : all)
      EXPECT_TRUE(std::binary_search(expected.begin(), expected.end(), std::pair{i, j}) ||
                  std::max(norm(balls[i].centre), norm(balls[j].centre)) > 1e8);
    meet += all.size();
    for (Bound& each : balls) each.radius *= 0.99;
    fewer += found().size();
  }
  std::printf("  200 scenes: %zu pairs meet (smaller by 1 %%: %zu)\n", meet, fewer);
  EXPECT_LT(fewer, meet);
}

/// Balls, boxes and cylinders that move at random over a plane and a box of the world: every pair
/// that touches at the start or the end, or could if one moved alone, is found, in the order of all
/// pairs. Control: without the motion some are missed.
TEST(Neighbours, EveryPairThatCanTouchInAStep) {
  std::mt19937_64 random(4);
  std::normal_distribution<double> any;
  size_t touching = 0, candidates = 0, total = 0, missed = 0;
  for (int scene = 0; scene < 40; ++scene) {
    const size_t n = 30;
    std::vector<mechanics::BodySpec> specs;
    std::vector<Surface> balls, others;
    for (size_t i = 0; i < n; ++i) {
      specs.push_back(body_on(("b" + std::to_string(i)).c_str(), "free", 1));
      Shape s = ball(0.3 * std::exp(any(random)));
      s.half_length = 0.5;
      s.half = 1.5 * Vec3d{s.radius, s.radius, s.radius};
      s.kind = i % 3 != 0 ? Kind::sphere : i % 2 == 0 ? Kind::box : Kind::cylinder;
      s.pose.r = {0.2 * any(random), 0.2 * any(random), 0};
      (i % 3 != 0 ? balls : others).push_back({specs.back().name, s});
    }
    const auto bodies = mechanism_of(specs);
    Shape table = ball(0.05);
    table.kind = Kind::box;
    table.half = {2, 2, 0.1};
    std::vector<Surface> all = balls;
    all.insert(all.end(), others.begin(), others.end());
    const ContactModel model(bodies, bodies,
                             {{"floor", all, {{"world", ground()}}, rough_law(0, 0.5)},
                              {"balls", balls, balls, rough_law(0, 0.5)},
                              {"mixed", others, balls, rigid_law(0)},
                              {"table", balls, {{"world", table}}, rigid_law(0)}});
    const auto everything = model.all_rigid();
    Gaps<double> start(model.mechanism(), everything, Ends::off),
        end(model.mechanism(), everything, Ends::off);
    Numbers q, to;
    for (size_t i = 0; i < n; ++i) {
      const double fast = std::exp(any(random) - 2);
      for (int k = 0; k < 3; ++k) {
        q.push_back(4 * any(random));
        to.push_back(q.back() + fast * any(random));
      }
      for (int k = 0; k < 4; ++k) q.push_back(k == 0), to.push_back(k == 0);
    }
    start.place(q);
    end.place(to);
    NearPairs near(model);
    const auto found = [&](const auto& last) {
      near.find(start.seat, last);
      Pairs pairs;
      for (const auto& p : near.placed().pairs) pairs.push_back({p.a, p.b});
      return pairs;
    };
    const Pairs resting = found(start.seat), pairs = found(end.seat);
    candidates += pairs.size();
    total += everything.pairs.size();
    size_t at = 0;
    for (const auto& p : everything.pairs) {
      bool touches = false;
      for (size_t i = p.first; i < p.first + p.points; ++i)
        touches = touches || std::min(start.touch[i].gap, end.touch[i].gap) <= 0 ||
                  start.touch[i].gap <= NearPairs::moved(start.seat[p.a], end.seat[p.a]) +
                                            NearPairs::moved(start.seat[p.b], end.seat[p.b]);
      const bool taken = at < pairs.size() && pairs[at] == std::pair{p.a, p.b};
      at += taken;
      if (!touches) continue;
      ++touching;
      EXPECT_TRUE(taken) << "scene " << scene;
      missed += std::find(resting.begin(), resting.end(), std::pair{p.a, p.b}) == resting.end();
    }
    EXPECT_EQ(at, pairs.size()) << "another order";
  }
  std::printf(
      "  40 scenes: %zu of %zu pairs can touch, %zu are looked at (without motion %zu are "
      "missed)\n",
      touching, total, candidates, missed);
  EXPECT_GT(missed, 0u);
  EXPECT_LT(candidates, total / 3);
}

/// A contact of bodies among themselves has each pair once.
TEST(Neighbours, AmongThemselvesEachPairOnce) {
  std::vector<mechanics::BodySpec> specs;
  std::vector<Surface> balls;
  for (const char* name : {"a", "b", "c", "d"}) {
    specs.push_back(body_on(name, "free", 1));
    balls.push_back({name, ball(0.1)});
  }
  const auto bodies = mechanism_of(specs);
  const ContactModel model(bodies, bodies, {{"all", balls, balls, rigid_law(0)}});
  EXPECT_EQ(model.all_rigid().pairs.size(), 6u);
}

}  // namespace
}  // namespace porthos::contact::neighbours_test
