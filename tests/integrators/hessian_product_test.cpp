// Products with the Hessian of a run's cost, tangent over adjoint: against 113 bits, their
// symmetry, and differences of gradients as a control.
#include "tests/integrators/run_cost.h"

namespace porthos::integrators::hessian_product_test {
namespace {

using namespace run_cost;
using test::Problem;

RunGradient along(const Problem& p, const std::string& method, int steps, const Vec& direction,
                  size_t memory = size_t(64) << 20) {
  const auto r = gradient_of_run(method, *p.model, p.start, p.h, steps, objective(),
                                 {.memory = memory, .direction = direction});
  EXPECT_EQ(r.outcome, Outcome::ok) << r.remark;
  return r;
}
std::vector<Quad> moved(const Vec& x, const Vec& a, Quad by_a, const Vec& b, Quad by_b) {
  std::vector<Quad> to(x.begin(), x.end());
  for (size_t i = 0; i < x.size(); ++i) to[i] += by_a * Quad(a[i]) + by_b * Quad(b[i]);
  return to;
}

/// γᵀ H δ of the cost by its values at four corners in 113 bits: the error of the difference and
/// that of rounding are both some 1e-16. The rounding of the run itself grows as its neighbours
/// part, by gauss6 a hundred times. Control: a central difference of gradients in double.
TEST(HessianProduct, IsThatOf113Bits) {
  for (const auto& [p, method, steps] : {std::tuple{test::double_pendulum(), "gauss16", 20},
                                         {test::double_pendulum(), "gauss6", 20},
                                         {test::double_pendulum(), "midpoint", 20},
                                         {test::floating_arm(), "gauss8", 4}}) {
    const size_t n = p.start.x.size();
    const Vec delta = random_vector(n, 9), gamma = random_vector(n, 10);
    const auto r = along(p, method, steps, delta);
    const Quad h = Quad(1e-8);
    const auto J = [&](double a, double b) {
      return cost_in_113_bits(*p.model, method,
                              moved(p.start.x, delta, Quad(a) * h, gamma, Quad(b) * h), p.h, steps);
    };
    const double expected = double((J(1, 1) - J(1, -1) - J(-1, 1) + J(-1, -1)) / (4 * h * h));
    const auto [mine, moduli] = product(r.start_along, gamma);

    const double by = 1e-5;
    double differenced = 0;
    for (const double way : {by, -by}) {
      phs::State start = p.start;
      for (size_t i = 0; i < n; ++i) start.x[i] += way * delta[i];
      differenced +=
          product(gradient_of_run(method, *p.model, start, p.h, steps, objective()).start, gamma)
              .first /
          (2 * way);
    }
    std::printf("  %-15s %-8s off by %.1e of the moduli (bound 1e-12), differences by %.1e\n",
                p.name.c_str(), method, std::fabs(mine - expected) / moduli,
                std::fabs(differenced - expected) / moduli);
    EXPECT_LT(std::fabs(mine - expected), 1e-12 * moduli);
    EXPECT_GT(std::fabs(differenced - expected), 4 * std::fabs(mine - expected));
  }
}

/// Also for methods whose runs are not there in 113 bits; and segments taken again from checkpoints
/// change the product by rounding only.
TEST(HessianProduct, IsSymmetric) {
  for (const auto& [p, method] : {std::pair{test::floating_arm(), "gauss16"},
                                  {test::double_pendulum(), "lobatto4"},
                                  {test::double_pendulum(), "rk4"},
                                  {test::double_pendulum(), "radau15"},
                                  {test::double_pendulum(), "hbvm4"},
                                  {test::double_pendulum(), "yoshida4"},
                                  {test::double_pendulum(), "stormer_verlet"}}) {
    const size_t n = p.start.x.size();
    const Vec delta = random_vector(n, 9), gamma = random_vector(n, 10);
    const auto H_delta = along(p, method, 60, delta), H_gamma = along(p, method, 60, gamma),
               again = along(p, method, 60, delta, 20000);
    const auto [one, moduli] = product(H_delta.start_along, gamma);
    const double other = product(H_gamma.start_along, delta).first,
                 repeated = product(again.start_along, gamma).first;
    std::printf("  %-15s %-15s differ by %.1e of the moduli, taken again by %.1e (bound 2e-11)\n",
                p.name.c_str(), method, std::fabs(one - other) / moduli,
                std::fabs(one - repeated) / moduli);
    EXPECT_LT(std::fabs(one - other), 2e-11 * moduli);
    EXPECT_LT(std::fabs(one - repeated), 2e-11 * moduli);
    EXPECT_GT(again.steps_taken, H_delta.steps_taken);
    EXPECT_EQ(again.start, H_delta.start);
  }
}

/// ∂²J/∂θ∂x_0 δ, where the forces of the network have second derivatives of their own.
TEST(HessianProduct, ByParametersIsThatOf113Bits) {
  const auto base = pendulum(1, 1, 1, 1);
  const Problem p{"pendulum", base, phs::State(base->description(), {0.7, -0.4, 1.1, 0.5}), 0.0625};
  const int steps = 16;
  const Vec delta = random_vector(4, 9);
  const auto r = along(p, "gauss12", steps, delta);
  const auto number = [&](const std::string& name) {
    const auto at = std::find(r.names.begin(), r.names.end(), name);
    EXPECT_NE(at, r.names.end()) << name;
    return r.parameters_along[size_t(at - r.names.begin())];
  };
  const auto expected = [&](auto model_of) {
    const Quad h = Quad(1e-10);
    const auto slope = [&](double factor) {
      const auto J = [&](Quad by) {
        return cost_in_113_bits(*model_of(factor), "gauss12", moved(p.start.x, delta, by, delta, 0),
                                p.h, steps);
      };
      return (J(h) - J(-h)) / (2 * h);
    };
    const auto once = [&](double by) { return (slope(1 + by) - slope(1 - by)) / Quad(2 * by); };
    return double((4 * once(0x1p-13) - once(0x1p-12)) / 3);
  };
  const auto compare = [&](const char* what, double mine, double reference) {
    std::printf("  %-6s %.15g, off by %.1e   bound 1e-10\n", what, mine,
                std::fabs(mine / reference - 1));
    EXPECT_NEAR(mine, reference, 1e-10 * std::fabs(reference)) << what;
  };
  compare("hard", number("hard.factor"), expected([](double f) { return pendulum(1, f, 1, 1); }));
  compare("dry", number("dry.factor"), expected([](double f) { return pendulum(1, 1, f, 1); }));
  compare("push", number("push.factor"), expected([](double f) { return pendulum(1, 1, 1, f); }));
  const double mass = number("link0.mass") - 0.5 * number("link0.moment.y") +
                      0.25 * (number("link0.inertia.xx") + number("link0.inertia.zz"));
  compare("mass", mass, expected([](double f) { return pendulum(f, 1, 1, 1); }));
}

/// The steps of a stiff spring, whose equations LU solves.
TEST(HessianProduct, OfStiffStepsIsSymmetric) {
  Problem p = test::double_pendulum();
  phs::Network net("stiff");
  net.add("arm", p.model).potential("shaft", "arm.link0", phs::spring(1e6, p.start.x[0]));
  p.model = net.build();
  const Vec delta{1e-3, 1, 1, 1}, gamma{2e-3, -1, 0.5, 1};
  const auto H_delta = along(p, "gauss8", 20, delta), H_gamma = along(p, "gauss8", 20, gamma);
  EXPECT_GT(H_delta.adjoint.factorisations, 0);
  const auto [one, moduli] = product(H_delta.start_along, gamma);
  const double off = std::fabs(one - product(H_gamma.start_along, delta).first) / moduli;
  std::printf("  differ by %.1e of the moduli, bound 1e-11\n", off);
  EXPECT_LT(off, 1e-11);
}

/// Without curvatures of the cost's parts its gradients are differenced.
TEST(HessianProduct, DifferencesTheCostWhereItHasNoCurvature) {
  const Problem p = test::double_pendulum();
  const Vec delta = random_vector(4, 9);
  Objective plain = objective();
  plain.end_curvature = plain.sampled_curvature = plain.running_curvature = {};
  const auto exact = along(p, "gauss12", 20, delta);
  const auto r =
      gradient_of_run("gauss12", *p.model, p.start, p.h, 20, plain, {.direction = delta});
  double off = 0, size = 0;
  for (size_t i = 0; i < 4; ++i) {
    off = std::max(off, std::fabs(r.start_along[i] - exact.start_along[i]));
    size = std::max(size, std::fabs(exact.start_along[i]));
  }
  std::printf("  off by %.1e, bound 1e-8\n", off / size);
  EXPECT_LT(off, 1e-8 * size);
  EXPECT_EQ(r.start, exact.start);
}

TEST(HessianProduct, RefusesWhatItDoesNotCover) {
  const auto refused = [](const Problem& p, const std::string& method, Vec direction) {
    try {
      (void)gradient_of_run(method, *p.model, p.start, p.h, 1, {}, {.direction = direction});
    } catch (const InvalidArgument& e) {
      return std::string(e.what());
    }
    return std::string("not refused");
  };
  EXPECT_NE(refused(test::floating_arm(), "stormer_verlet", Vec(26, 1.0)).find("with quaternions"),
            std::string::npos);
  EXPECT_NE(refused(test::double_pendulum(), "gauss8", Vec(3, 1.0)).find("direction"),
            std::string::npos);
  for (const auto& p : test::problems())
    if (p.name == "Henon-Heiles") {
      EXPECT_NE(refused(p, "gauss8", Vec(4, 1.0)).find("no second derivatives"), std::string::npos);
    }
}

}  // namespace
}  // namespace porthos::integrators::hessian_product_test
