// Maximal coordinates against reduced ones: the same motion by the same method.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "integrators/core/integrator.h"
#include "mechanics/constraints/maximal.h"
#include "tests/support/energy_run.h"
#include "tests/support/linkages.h"
#include "tests/support/poses.h"
#include "tests/support/random_tree.h"

namespace porthos::integrators::maximal_test {
namespace {

using mechanics::ConstraintSpec;
using mechanics::MechanicalModel;
using mechanics::Mechanism;
using mechanics::MechanismBuilder;
using test::apart;
using test::Vec;

/// A mechanism in both coordinates, from the same start.
struct Both {
  std::shared_ptr<const MechanicalModel> reduced, maximal;
  phs::State start, maximal_start;
};
std::shared_ptr<const MechanicalModel> model_of(const MechanismBuilder& parts,
                                                const ConstraintSpec& spec) {
  return std::make_shared<const MechanicalModel>(std::make_shared<const Mechanism>(parts.build()),
                                                 std::vector<mechanics::BodyPort>(), spec);
}
Both both(const MechanismBuilder& parts, const ConstraintSpec& spec, Vec q, Vec v) {
  Both b;
  b.reduced = model_of(parts, spec);
  if (const auto* set = b.reduced->constraint_set())
    mechanics::close_loops(b.reduced->mechanism(), *set, q, v);
  b.start = phs::State(b.reduced->description(), b.reduced->state(q, v));
  const auto form = mechanics::maximal_form(parts, spec);
  b.maximal = model_of(form.parts, form.constraints);
  b.maximal_start = mechanics::maximal_state(*b.reduced, b.start, *b.maximal);
  return b;
}

phs::State run(const MechanicalModel& model, const std::string& method, double h, int steps,
               phs::State s) {
  const auto m = make_integrator(method, model, h);
  for (int i = 0; i < steps; ++i) {
    const Outcome o = m->step(s);
    EXPECT_EQ(o, Outcome::ok) << method << ", step " << i << " " << m->remark();
    if (o != Outcome::ok) break;
  }
  return s;
}

/// A tree of all joint types, the axes of universal joints normal to each other.
MechanismBuilder random_tree(std::uint64_t seed, int bodies, const std::string& root,
                             const std::string& only = "") {
  test::RandomTree random(seed);
  MechanismBuilder b("random");
  const auto types = mechanics::joint_type_names();
  for (int i = 0; i < bodies; ++i) {
    const int parent = i == 0 ? -1 : std::max(0, i - 1 - random.below(std::min(i, 3)));
    const std::string type = i == 0          ? root
                             : !only.empty() ? only
                                             : types[size_t(random.below(int(types.size())))];
    auto body = random.body(i, i == 0 ? "world" : "body_" + std::to_string(parent), type);
    const auto z = body.joint.axis;
    *body.joint.second_axis -= (dot(*body.joint.second_axis, z) / dot(z, z)) * z;
    b.add(body);
  }
  b.gravity({0.5, -1, -9.81});
  return b;
}
Both random_case(std::uint64_t seed, const std::string& root, const std::string& only = "") {
  const auto parts = random_tree(seed, 6, root, only);
  const Mechanism m = parts.build();
  test::RandomTree random(seed + 100);
  const Vec q = random.q(m);
  return both(parts, {}, q, random.numbers(m.nv(), 0.7));
}

TEST(Maximal, TheStartIsTheSameMotion) {
  for (const auto& type : mechanics::joint_type_names()) {
    const Both b = random_case(3, "free", type);
    EXPECT_LT(apart(*b.reduced, b.start, *b.maximal, b.maximal_start), 1e-14) << type;
    const auto system = b.maximal->instantiate<double>();
    const auto rows = system->constraints();
    if (!rows) continue;
    Vec g(size_t(rows->count())), e(b.maximal_start.x.size()), rate(g.size());
    rows->place(b.maximal_start.x, g);
    system->gradient(b.maximal_start.x, e);
    rows->rates(e, rate);
    for (size_t r = 0; r < g.size(); ++r) {
      EXPECT_LT(std::fabs(g[r]), 1e-14) << type << " row " << r;
      EXPECT_LT(std::fabs(rate[r]), 1e-13) << type << " row " << r;
    }
    EXPECT_EQ(rows->factor(b.maximal_start.x), rows->count()) << type;
    // The energy is the same number.
    const auto reduced = b.reduced->instantiate<double>();
    EXPECT_NEAR(system->hamiltonian(b.maximal_start.x), reduced->hamiltonian(b.start.x),
                1e-12 * std::fabs(reduced->hamiltonian(b.start.x)))
        << type;
  }
}

/// Both coordinates by the same method: they differ by its error, and at order 16 by rounding.
TEST(Maximal, TreesMoveAsInReducedCoordinates) {
  double worst = 0, control = HUGE_VAL;
  for (const auto& type : mechanics::joint_type_names()) {
    if (type == "fixed" || type == "free") continue;
    const Both b = random_case(7, type, type);
    const auto difference = [&](const std::string& method, int steps) {
      const double h = 0.25 / steps;
      return apart(*b.reduced, run(*b.reduced, method, h, steps, b.start), *b.maximal,
                   run(*b.maximal, method, h, steps, b.maximal_start));
    };
    const double coarse = difference("spark4", 64), fine = difference("spark4", 128);
    const double least = difference("spark16", 64);
    std::printf("  %-12s spark4 %.1e, %.1e, order %.2f; spark16 %.1e\n", type.c_str(), coarse, fine,
                std::log2(coarse / fine), least);
    // Bodies that only slide move as polynomials, which any order follows.
    if (type == "prismatic")
      EXPECT_LT(coarse, 1e-13);
    else
      EXPECT_NEAR(std::log2(coarse / fine), 4, 0.3) << type;
    EXPECT_LT(least, 3e-12) << type;
    worst = std::max(worst, least);
    // Control: the last joint gives way in one more direction.
    auto form = mechanics::maximal_form(random_tree(7, 6, type, type), {});
    auto& last = form.constraints.loops.back();
    const std::string wider =
        type == "revolute" || type == "continuous" || type == "helical" || type == "prismatic"
            ? "cylindrical"
        : type == "universal" ? "spherical"
                              : "";
    if (wider.empty()) continue;
    last.type = wider;
    const auto loose = model_of(form.parts, form.constraints);
    control =
        std::min(control, apart(*b.reduced, run(*b.reduced, "spark16", 1. / 256, 64, b.start),
                                *loose, run(*loose, "spark16", 1. / 256, 64, b.maximal_start)));
  }
  std::printf("  largest difference %.1e; control, a row left out: %.1e\n", worst, control);
  EXPECT_GT(control, 1e-3);
}

double apart_after(const Both& b, double h, int steps) {
  return apart(*b.reduced, run(*b.reduced, "spark16", h, steps, b.start), *b.maximal,
               run(*b.maximal, "spark16", h, steps, b.maximal_start));
}
TEST(Maximal, TreesOfMixedJoints) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const double off =
        apart_after(random_case(seed, seed % 2 ? "free" : "spherical"), 1. / 256, 64);
    std::printf("  tree %d: %.1e\n", int(seed), off);
    EXPECT_LT(off, 1e-12) << seed;  // measured 8e-14
  }
}

/// Loops beside the joints; Bricard's linkage has dependent rows, and no loop is cut here.
TEST(Maximal, LinkagesMoveAsInReducedCoordinates) {
  const struct {
    test::Linkage linkage;
    double h, bound;
  } cases[] = {{test::four_bar(), 1. / 256, 1e-13},    {test::four_bars(3), 1. / 256, 1e-13},
               {test::holding_arms(), 1. / 64, 1e-13}, {test::scissors(4), 1. / 256, 1e-13},
               {test::lattice(2), 1. / 512, 1e-13},    {test::bricard(), 1. / 512, 1e-12}};
  for (const auto& c : cases) {
    const auto& l = c.linkage;
    const Both b = both(l.parts, l.spec, l.q, l.v);
    const double off = apart_after(b, c.h, 128);
    std::printf("  %-12s %.1e\n", l.mechanism->name().c_str(), off);
    EXPECT_LT(off, c.bound) << l.mechanism->name();
  }
}

/// Momenta and norms to rounding and energy without drift, as with loops in reduced coordinates.
TEST(Maximal, AFreeTreeKeepsMomentaAndEnergy) {
  auto parts = random_tree(11, 5, "free", "revolute");
  parts.gravity({0, 0, 0});
  const Mechanism m = parts.build();
  test::RandomTree random(5);
  const Both b = both(parts, {}, random.q(m), random.numbers(m.nv(), 0.3));
  test::Gauge gauge(*b.maximal);
  const auto& start = b.maximal_start;
  const auto first = gauge.invariants(start);
  const auto method = make_integrator("spark16", *b.maximal, 1. / 64);
  phs::State s = start;
  const int steps = 1 << (test::long_runs() ? 16 : 11);
  double drift = 0, sum = 0;
  const auto H0 = gauge.energy(start);
  for (int i = 0; i < steps; ++i) {
    ASSERT_EQ(method->step(s), Outcome::ok);
    const double error = double((gauge.energy(s) - H0) / H0);
    sum += error * error;
  }
  const auto last = gauge.invariants(s);
  for (size_t k = 0; k < first.size(); ++k)
    drift = std::max(drift, double(std::fabs(last[k] - first[k])));
  const double rms = std::sqrt(sum / steps);
  std::printf("  %d steps: invariants %.1e, rms energy error %.1e = %.1e sqrt(N)\n", steps, drift,
              rms, rms / std::sqrt(double(steps)));
  EXPECT_LT(drift, 1e-13);
  EXPECT_LT(rms, 2 * test::random_walk(steps));
  // Control: an iteration stopped early.
  const auto loose = test::energy_run("spark16", *b.maximal, start, 1. / 64, 256,
                                      {.method = {.iteration_tolerance = 1e-9}});
  EXPECT_GT(loose.energy, 10 * rms);
}

void expect_refusal(const MechanismBuilder& parts, const ConstraintSpec& spec,
                    const std::string& named) {
  try {
    mechanics::maximal_form(parts, spec);
    ADD_FAILURE() << "accepted: " << named;
  } catch (const InvalidArgument& e) {
    const std::string text = e.what();
    EXPECT_NE(text.find(named), std::string::npos) << text;
    EXPECT_NE(text.find("coordinates = \"reduced\""), std::string::npos) << text;
  }
}
TEST(Maximal, WhatActsOnJointCoordinatesIsRefused) {
  const auto with = [](const auto& change) {
    auto parts = random_tree(2, 2, "revolute", "universal");
    change(parts.bodies()[0].joint, parts.bodies()[1]);
    return parts;
  };
  expect_refusal(with([](auto& j, auto&) { j.damping = 1; }), {}, "'joint_0': a damper");
  expect_refusal(with([](auto& j, auto&) { j.stiffness = 1; }), {}, "'joint_0': a spring");
  expect_refusal(with([](auto& j, auto&) { j.rotor_inertia = 1; }), {}, "'joint_0': a rotor");
  expect_refusal(with([](auto&, auto& b) { *b.joint.second_axis += b.joint.axis; }), {},
                 "not normal");
  expect_refusal(with([](auto&, auto& b) {
                   b.mass.mass = 0;
                   b.mass.inertia = {0, 0, 0, 0, 0, 0};
                 }),
                 {}, "'body_1' has no inertia");
  ConstraintSpec spec;
  spec.couplings.push_back({"gear", {{"joint_0", 1}}, 0});
  expect_refusal(with([](auto&, auto&) {}), spec, "'gear': a coupling");
}

}  // namespace
}  // namespace porthos::integrators::maximal_test
