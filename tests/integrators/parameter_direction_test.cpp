// Second derivatives of a run's cost along parameters: against 113 bits, and their symmetry with
// those along the start.
#include "mechanics/rotation.h"
#include "tests/integrators/run_cost.h"
#include "tests/support/random_tree.h"

namespace porthos::integrators::parameter_direction_test {
namespace {

using namespace run_cost;
using test::Problem;

/// A change of the start and of the parameters.
struct Direction {
  Vec start, parameters;
};

RunGradient along(const Problem& p, const std::string& method, int steps, const Direction& d,
                  size_t memory = size_t(64) << 20) {
  const auto r = gradient_of_run(
      method, *p.model, p.start, p.h, steps, objective(),
      {.memory = memory, .direction = d.start, .parameter_direction = d.parameters});
  EXPECT_EQ(r.outcome, Outcome::ok) << r.remark;
  return r;
}
/// The product of what a gradient changed by with another direction, and the sum of its moduli.
std::pair<double, double> product(const RunGradient& r, const Direction& d) {
  const auto a = run_cost::product(r.start_along, d.start),
             b = run_cost::product(r.parameters_along, d.parameters);
  return {a.first + b.first, a.second + b.second};
}

Problem swung(std::shared_ptr<const phs::Model> model) {
  return {"pendulum", model, phs::State(model->description(), {0.7, -0.4, 1.1, 0.5}), 0.0625};
}

/// γ ∂²J/∂θ² δ where δ and γ are the factors of the two arguments of a model.
TEST(ParameterDirection, IsThatOf113Bits) {
  const Problem p = swung(pendulum(1, 1, 1, 1));
  const int steps = 16;
  const auto names = gradient_of_run("gauss12", *p.model, p.start, p.h, 0, {}).names;
  const auto direction = [&](std::initializer_list<std::pair<const char*, double>> numbers) {
    Direction d{Vec(4), Vec(names.size())};
    for (const auto& [name, by] : numbers) {
      const auto at = std::find(names.begin(), names.end(), name);
      EXPECT_NE(at, names.end()) << name;
      d.parameters[size_t(at - names.begin())] = by;
    }
    return d;
  };
  // With the centre half a metre along -y and the inertia about it kept.
  const Direction of[] = {direction({{"link0.mass", 1},
                                     {"link0.moment.y", -0.5},
                                     {"link0.inertia.xx", 0.25},
                                     {"link0.inertia.zz", 0.25}}),
                          direction({{"hard.factor", 1}}), direction({{"dry.factor", 1}}),
                          direction({{"push.factor", 1}})};
  const auto model = [](std::array<double, 4> f) { return pendulum(f[0], f[1], f[2], f[3]); };
  const std::vector<Quad> x(p.start.x.begin(), p.start.x.end());
  const auto J = [&](size_t i, double a, size_t j, double b) {
    std::array<double, 4> f{1, 1, 1, 1};
    f[i] += a;
    f[j] += b;
    return cost_in_113_bits(*model(f), "gauss12", x, p.h, steps);
  };
  for (const auto& [i, j] : {std::pair{0, 0}, {0, 1}, {0, 3}, {1, 1}, {1, 2}, {2, 2}, {2, 3}}) {
    const auto a = size_t(i), b = size_t(j);
    const auto once = [&](double by) {
      return (J(a, by, b, by) - J(a, by, b, -by) - J(a, -by, b, by) + J(a, -by, b, -by)) /
             Quad(4 * by * by);
    };
    const double expected = double((4 * once(0x1p-12) - once(0x1p-11)) / 3);
    const auto [mine, moduli] = product(along(p, "gauss12", steps, of[a]), of[b]);
    std::printf("  %d %d: %.12g, off by %.1e of the moduli   bound 1e-9\n", i, j, mine,
                std::fabs(mine - expected) / moduli);
    EXPECT_NEAR(mine, expected, 1e-9 * moduli);
  }
}

/// Every joint there is, rotors, springs and dampers at joints, under gravity or without.
Problem tree(std::uint64_t seed, const std::string& root, mechanics::Vec3d gravity,
             double rotor = 0.5) {
  test::RandomTree random(seed);
  random.rotor = rotor;
  mechanics::MechanismBuilder builder("tree");
  const auto types = mechanics::joint_type_names();
  for (int i = 0; i < 6; ++i) {
    auto b = random.body(i, i == 0 ? "world" : "body_" + std::to_string(i / 2),
                         i == 0 ? root : types[size_t(random.below(int(types.size())))]);
    if (mechanics::freedoms(b.joint.type) == 1) {
      b.joint.damping = 0.2 + 0.1 * i;
      b.joint.stiffness = 1.0 + i;
      b.joint.rest = 0.3;
    }
    builder.add(b);
  }
  const auto m = std::make_shared<mechanics::Mechanism>(builder.gravity(gravity).build());
  auto model = std::make_shared<mechanics::MechanicalModel>(m);
  return {"tree of " + root, model,
          phs::State(model->description(), model->state(random.q(*m), random.numbers(m->nv()))),
          0.02};
}

/// γᵀ H δ = δᵀ H γ, where δ and γ change the start and all parameters, or one of them that alone.
TEST(ParameterDirection, IsSymmetric) {
  for (const auto& [p, method] : {std::pair{test::floating_arm(), "gauss8"},
                                  {test::double_pendulum(), "lobatto4"},
                                  {test::double_pendulum(), "stormer_verlet"},
                                  {swung(pendulum(1, 1, 1, 1)), "yoshida4"},
                                  {tree(1, "free", {0, 0, -9.81}), "gauss8"},
                                  {tree(2, "revolute", {1, 2, -9.81}), "gauss8"},
                                  {tree(3, "spherical", {0, 0, 0}), "gauss8"}}) {
    const auto plain = gradient_of_run(method, *p.model, p.start, p.h, 0, {});
    const size_t n = p.start.x.size(), parameters = plain.names.size();
    const auto change = [&](unsigned seed) {
      Direction d{random_vector(n, seed), random_vector(parameters, seed + 1)};
      for (double& x : d.parameters) x *= 0.1;
      return d;
    };
    const Direction delta = change(9), gamma = change(11), at_start{delta.start, Vec(parameters)},
                    fixed_start{Vec(n), delta.parameters};
    const int steps = 20;
    const auto H_delta = along(p, method, steps, delta), H_gamma = along(p, method, steps, gamma),
               again = along(p, method, steps, delta, 20000),
               one = along(p, method, steps, {delta.start, {}}),
               other = along(p, method, steps, {{}, delta.parameters});
    const auto [mine, moduli] = product(H_delta, gamma);
    const double turned = product(H_gamma, delta).first,
                 summed = product(one, gamma).first + product(other, gamma).first;
    std::printf("  %-22s %-15s differ by %.1e of the moduli, in parts by %.1e (bound 1e-11)\n",
                p.name.c_str(), method, std::fabs(mine - turned) / moduli,
                std::fabs(mine - summed) / moduli);
    EXPECT_LT(std::fabs(mine - turned), 1e-11 * moduli);
    EXPECT_LT(std::fabs(mine - summed), 1e-11 * moduli);
    EXPECT_LT(std::fabs(mine - product(again, gamma).first), 1e-11 * moduli);
    EXPECT_EQ(H_delta.start, one.start);
    EXPECT_EQ(H_delta.parameters, one.parameters);
    // Controls: neither part is all of it.
    EXPECT_GT(std::fabs(mine - product(one, gamma).first), 1e-6 * moduli);
    EXPECT_GT(std::fabs(mine - product(other, gamma).first), 1e-6 * moduli);
    EXPECT_EQ(along(p, method, steps, at_start).start_along, one.start_along);
    EXPECT_EQ(along(p, method, steps, fixed_start).start_along, other.start_along);
  }
}

TEST(ParameterDirection, RefusesWhatItDoesNotCover) {
  const auto refused = [](const Problem& p, const std::string& method, const Vec& parameters) {
    try {
      (void)gradient_of_run(method, *p.model, p.start, p.h, 1, {},
                            {.parameter_direction = parameters});
    } catch (const InvalidArgument& e) {
      return std::string(e.what());
    }
    return std::string("not refused");
  };
  const Problem p = tree(2, "revolute", {0, 0, 0}, 0);
  const auto names = gradient_of_run("gauss8", *p.model, p.start, p.h, 0, {}).names;
  EXPECT_NE(refused(p, "gauss8", Vec(3, 1.0)).find("parameter_direction has 3 entries"),
            std::string::npos);
  EXPECT_NE(refused(p, "gauss8", Vec(names.size(), 1.0)).find(".rotor_inertia', which is 0"),
            std::string::npos);
  EXPECT_NE(refused(test::floating_arm(), "stormer_verlet", Vec(3, 1.0)).find("parameter"),
            std::string::npos);
}

}  // namespace
}  // namespace porthos::integrators::parameter_direction_test
