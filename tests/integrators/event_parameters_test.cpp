// Events that set parameters of the models that follow, against closed forms; several costs.
#include <gtest/gtest.h>

#include <cmath>

#include "integrators/control/event_gradient.h"
#include "phs/system/user_model.h"
#include "phs/system/varied_model.h"

namespace porthos::integrators::event_parameters_test {
namespace {

using phs::Dual;
using In = std::span<const Dual>;

/// Falling: H = p²/2m + m g q.
struct Falling {
  static constexpr double m = 2;
  double g;
  phs::Description description() const {
    phs::Description d;
    d.name = "falling";
    d.nx = 2;
    d.blocks = {{"height", phs::BlockKind::linear, 0, 1, 1, "m", "N s"}};
    d.traits = {.canonical = true, .separable = true};
    return d;
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    return x[1] * x[1] / T(2 * m) + T(m * g) * x[0];
  }
  template <class T>
  void gradient(std::span<const T> x, std::span<T> e) const {
    e[0] = T(m * g);
    e[1] = x[1] / T(m);
  }
};

std::shared_ptr<const phs::Model> falling(double g) {
  return std::make_shared<phs::UserModel<Falling>>(Falling{g});
}

/// A fall past a line, below which gravity has changed with the momentum there by `rate`.
class FallPastALine : public ::testing::Test {
 protected:
  static constexpr double g = 9.5, line = 0.5, rate = 0.7, end = 0.6;
  FallPastALine() {
    std::vector<std::shared_ptr<const phs::Model>> beside;
    for (const auto& point : phs::difference_points)
      beside.push_back(falling(g + point.at * phs::difference_distance));
    below_ = std::make_shared<phs::VariedModel>(
        above_, std::vector<phs::Variation>{{"gravity", std::move(beside)}});
  }
  std::vector<RunPhase> phases() const {
    RunEvent passes{.name = "line",
                    .guard = [](In, const Dual&, In x) { return x[0] - Dual(line); },
                    .direction = Crossing::falling,
                    .reset =
                        [](In, const Dual&, In x, std::span<Dual> after) {
                          after[0] = x[0];
                          after[1] = x[1];
                          after[2] = Dual(rate) * x[1];
                        },
                    .then = 1,
                    .sets = {"gravity"}};
    return {{above_.get(), {passes}}, {below_.get()}};
  }
  static EventObjective number(size_t i) {
    return {.end = [i](double, std::span<const double> x, std::span<double> gradient) {
      gradient[i] = 1;
      return x[i];
    }};
  }
  phs::State start() const { return {above_->description(), {1.0, -0.4}}; }

  std::shared_ptr<const phs::Model> above_ = falling(g), below_;
};

TEST_F(FallPastALine, HasTheSlopesOfItsClosedForm) {
  const double m = Falling::m, v0 = -0.4 / m, v1 = -std::sqrt(v0 * v0 + 2 * g * (1 - line)),
               left = end - (v0 - v1) / g, by_speed = g / v1, by_gravity = rate * m * by_speed;
  const double exact[] = {left * by_speed + (v1 - g * left) / v1 - left * left / 2 * by_gravity,
                          m * (by_speed - g / v1 - left * by_gravity)};
  const EventObjective costs[] = {number(0), number(1)};
  const auto all = gradients_across_events("gauss4", phases(), start(), 0.0625, end, costs);
  for (size_t i = 0; i < 2; ++i) {
    ASSERT_EQ(all[i].remark, "");
    EXPECT_NEAR(all[i].start[0], exact[i], 1e-13 * std::fabs(exact[i]));
    const auto alone = gradient_across_events("gauss4", phases(), start(), 0.0625, end, costs[i]);
    EXPECT_EQ(alone.start, all[i].start);
    EXPECT_EQ(alone.cost, all[i].cost);
    EXPECT_EQ(all[i].names, std::vector<std::string>{"gravity"});
    EXPECT_EQ(all[i].parameters[0], 0) << "it is the event's";
  }
  auto own = number(0);  // which depends on the gravity itself
  own.end_by_parameters = [](double, std::span<const double>) {
    return std::map<std::string, double>{{"gravity", 2.0}};
  };
  const auto more = gradient_across_events("gauss4", phases(), start(), 0.0625, end, own);
  EXPECT_NEAR(more.start[0] - all[0].start[0], 2 * by_gravity, 1e-13);
  // Control: a model that does not know its gravity.
  auto blind = phases();
  blind[1].model = above_.get();
  const auto wrong = gradient_across_events("gauss4", blind, start(), 0.0625, end, costs[0]);
  EXPECT_GT(std::fabs(wrong.start[0] - exact[0]), 0.1);
}

TEST_F(FallPastALine, OfATangentIsRefused) {
  const double direction[] = {1, 0};
  const auto refused = [&](const std::vector<RunPhase>& all) -> std::string {
    try {
      (void)tangent_across_events("gauss4", all, start(), 0.0625, end, direction);
    } catch (const InvalidArgument& e) {
      return e.what();
    }
    return "(accepted)";
  };
  EXPECT_EQ(refused(phases()),
            "the event 'line' sets 'gravity', by which a tangent has no derivatives, expected a "
            "gradient");
  auto all = phases();
  all[0].events[0].reset = {};
  EXPECT_EQ(refused(all), "the event 'line' sets parameters, expected a reset");
}

}  // namespace
}  // namespace porthos::integrators::event_parameters_test
