// The energy monitor: warn, stop, repeat, roll back; the projection that keeps momenta, and the
// scaling that does not.
#include <gtest/gtest.h>

#include <cstdio>
#include <limits>

#include "integrators/control/energy_monitor.h"
#include "phs/system/user_model.h"
#include "tests/support/swinging_pendulum.h"

namespace porthos::test::energy_monitor_test {
namespace {

using integrators::EnergyMonitor;
using integrators::make_integrator;
using integrators::MonitorOptions;
using integrators::OnViolation;
using integrators::Outcome;

std::unique_ptr<EnergyMonitor> watched(const phs::Model& model, const std::string& method, double h,
                                       MonitorOptions o) {
  return std::make_unique<EnergyMonitor>(make_integrator(method, model, h), model, h, std::move(o));
}

double energy(const phs::Model& model, const phs::State& s) {
  std::vector<double> x(s.x);
  for (size_t i = 0; i < x.size(); ++i) x[i] += s.lo[i];
  return model.instantiate<double>()->hamiltonian(x);
}

TEST(EnergyMonitor, WarnsAndLeavesTheRunAlone) {
  const auto robot = swinging_pendulum();
  const double h = 0.02;
  const auto plain = make_integrator("rk4", *robot.model, h);
  const auto seen = watched(*robot.model, "rk4", h, {.limit = 1e-6});
  auto a = robot.start, b = robot.start;
  for (int i = 0; i < 1000; ++i) {
    ASSERT_EQ(plain->step(a), Outcome::ok);
    ASSERT_EQ(seen->step(b), Outcome::ok);
  }
  std::printf("  %s\n", seen->text().c_str());
  EXPECT_EQ(a.x, b.x);
  EXPECT_GT(seen->report().violations, 100);
  EXPECT_GT(seen->report().worst, 1e-6);
  const auto good = watched(*robot.model, "gauss16", h / 4, {.limit = 1e-12, .step_limit = 1e-13});
  auto c = robot.start;
  for (int i = 0; i < 1000; ++i) ASSERT_EQ(good->step(c), Outcome::ok);
  EXPECT_EQ(good->text(), "") << "the control: a good method is not accused";
}

TEST(EnergyMonitor, StopsAtTheLastGoodState) {
  const auto robot = swinging_pendulum();
  const auto seen =
      watched(*robot.model, "rk4", 0.02, {.limit = 1e-6, .action = OnViolation::stop});
  auto s = robot.start, good = s;
  Outcome o = Outcome::ok;
  for (int i = 0; i < 1000 && o == Outcome::ok; ++i) {
    good = s;
    o = seen->step(s);
  }
  EXPECT_EQ(o, Outcome::failed);
  EXPECT_EQ(s.x, good.x);
  EXPECT_EQ(s.step, good.step);
  const double H0 = energy(*robot.model, robot.start);
  const double off = std::fabs(energy(*robot.model, s) - H0);
  std::printf("  stopped after step %lld, %.2e J off: %s\n", (long long)s.step, off,
              seen->text().c_str());
  EXPECT_GT(s.step, 0);
  EXPECT_NE(seen->text().find("the relative residual of the balance is"), std::string::npos);
}

TEST(EnergyMonitor, RepeatsAStepInSmallerParts) {
  const auto robot = swinging_pendulum(0.05);
  const double h = 0.04, limit = 1e-8;
  const auto plain = watched(*robot.model, "rk4", h, {.step_limit = limit});
  const auto seen =
      watched(*robot.model, "rk4", h, {.step_limit = limit, .action = OnViolation::repeat});
  auto a = robot.start, b = robot.start;
  double work_a = 0, work_b = 0;
  const int steps = 500;
  for (int i = 0; i < steps; ++i) {
    ASSERT_EQ(plain->step(a), Outcome::ok);
    ASSERT_EQ(seen->step(b), Outcome::ok);
    for (const double w : plain->port_work()) work_a += w;
    for (const double w : seen->port_work()) work_b += w;
  }
  const double H0 = energy(*robot.model, robot.start);
  const double off = std::fabs(energy(*robot.model, a) - H0 + work_a),
               off_b = std::fabs(energy(*robot.model, b) - H0 + work_b);
  std::printf("  defect %.1e J, repeated %.1e J (%.1e); %lld of %d steps repeated\n", off, off_b,
              steps * limit * 60, (long long)seen->report().repeated, steps);
  EXPECT_GT(seen->report().repeated, 10);
  EXPECT_LT(off_b, steps * limit * 60) << "limit times the scale, below 60 J, at every step";
  EXPECT_GT(off, 10 * off_b) << "the control: without repetition";
  EXPECT_EQ(b.step, steps);
  EXPECT_DOUBLE_EQ(seen->time(b), steps * h) << "the clock stays on its grid";
}

/// A pendulum whose torsion bar breaks into NaN beyond an angle.
struct Breaking {
  static phs::Description description() {
    phs::Description d;
    d.name = "breaking";
    d.nx = 2;
    d.blocks = {{"angle", phs::BlockKind::linear, 0, 1, 1, "rad", "N m s"}};
    d.traits.canonical = d.traits.separable = true;
    return d;
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    const T V = T(0.5) * x[0] * x[0];
    if (phs::any(x[0] > T(1.5))) return T(std::numeric_limits<double>::quiet_NaN());
    return T(0.5) * x[1] * x[1] + V;
  }
};

TEST(EnergyMonitor, NanAndLimitsRollBack) {
  const phs::UserModel<Breaking> model{Breaking{}};
  for (const bool nan : {true, false}) {
    MonitorOptions o{.limit = 1e-3};
    if (!nan) {
      o.action = OnViolation::stop;
      o.watch = [](double, std::span<const double> x) {
        return x[0] > 1.2 ? std::string("the bar is beyond 1.2 rad") : std::string();
      };
    }
    const auto seen = watched(model, "gauss4", 0.05, o);
    phs::State s(model.description(), {0, 2}), good = s;
    Outcome outcome = Outcome::ok;
    for (int i = 0; i < 200 && outcome == Outcome::ok; ++i) {
      good = s;
      outcome = seen->step(s);
    }
    std::printf("  %s at %.2f rad: %s\n", to_string(outcome), s.x[0], seen->text().c_str());
    EXPECT_EQ(outcome, nan ? Outcome::not_finite : Outcome::failed);
    EXPECT_EQ(s.x, good.x);
    EXPECT_LT(s.x[0], nan ? 1.5 : 1.2);
    EXPECT_GT(s.x[0], nan ? 1.3 : 1.1);
    if (!nan) {
      EXPECT_NE(seen->text().find("beyond 1.2 rad"), std::string::npos);
    }
  }
}

/// Linear and angular momentum of the floating arm.
std::vector<double> momenta(phs::System<double>& f, const phs::State& s) {
  std::vector<double> x(s.x), v(size_t(f.description().invariant_count()));
  for (size_t i = 0; i < x.size(); ++i) x[i] += s.lo[i];
  f.invariants(x, v);
  return v;
}
double apart(const std::vector<double>& a, const std::vector<double>& b) {
  double d = 0, size = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    d = std::max(d, std::fabs(a[i] - b[i]));
    size = std::max(size, std::fabs(a[i]));
  }
  return d / size;
}

TEST(EnergyProjection, MovesTheEnergyAndKeepsMomenta) {
  auto robot = ets_vii(5);
  // The base tumbles and drifts too, so that there is momentum to keep.
  const auto f = robot.model->instantiate<double>();
  {
    const auto& m = robot.model->mechanism();
    auto q = m.neutral();
    std::vector<double> v(size_t(m.nv()), 0.1);
    std::fill(q.end() - 6, q.end(), 0.4);
    robot.start = phs::State(robot.model->description(), robot.model->state(q, v));
  }
  const auto L = momenta(*f, robot.start);
  const double H = energy(*robot.model, robot.start), target = H * 1.001;
  auto projected = robot.start, scaled = robot.start;
  integrators::EnergyProjection project(*robot.model);
  ASSERT_TRUE(project(*f, projected, target));
  // The textbook's repair: all velocities, so all momenta, by one factor (no potential here: H =
  // T).
  const double factor = std::sqrt(target / H);
  for (const auto& b : robot.model->description().blocks)
    for (int n = 0; n < b.size; ++n) scaled.x[size_t(b.momentum + n)] *= factor;
  std::printf(
      "  energy off by %.1e (1e-15) and %.1e; momenta moved by %.1e (1e-15), by scaling %.1e "
      "(control, %.1e)\n",
      std::fabs(energy(*robot.model, projected) / target - 1),
      std::fabs(energy(*robot.model, scaled) / target - 1), apart(L, momenta(*f, projected)),
      apart(L, momenta(*f, scaled)), factor - 1);
  EXPECT_LT(std::fabs(energy(*robot.model, projected) / target - 1), 1e-15);
  EXPECT_LT(apart(L, momenta(*f, projected)), 1e-15);
  EXPECT_NEAR(apart(L, momenta(*f, scaled)), factor - 1, 1e-3 * factor);

  // What carries the momenta cannot be taken away: below that the projection says so.
  auto untouched = robot.start;
  EXPECT_FALSE(project(*f, untouched, 1e-3 * H));
  EXPECT_EQ(untouched.x, robot.start.x);
}

TEST(EnergyProjection, HoldsTheEnergyOfAMethodThatDrifts) {
  const auto robot = ets_vii(10);
  const auto plain = make_integrator("rk4", *robot.model, 0.05);
  const auto seen = watched(*robot.model, "rk4", 0.05, {.project = true});
  auto a = robot.start, b = robot.start;
  const double H = energy(*robot.model, robot.start);
  double worst = 0, drift = 0;
  for (int i = 0; i < 2000; ++i) {
    ASSERT_EQ(plain->step(a), Outcome::ok);
    ASSERT_EQ(seen->step(b), Outcome::ok);
    drift = std::fabs(energy(*robot.model, a) / H - 1);
    worst = std::max(worst, std::fabs(energy(*robot.model, b) / H - 1));
  }
  std::printf("  energy error %.1e, projected %.1e (5e-15); %s\n", drift, worst,
              seen->text().c_str());
  EXPECT_LT(worst, 5e-15);
  EXPECT_GT(drift, 1e-9) << "the control: without projection";
  EXPECT_GT(seen->report().moved_J, 0);
}

TEST(EnergyMonitor, ContinuesBitForBit) {
  const auto robot = swinging_pendulum(0.05);
  const MonitorOptions o{.step_limit = 1e-8, .action = OnViolation::repeat, .project = true};
  phs::State ends[2];
  std::int64_t repeated[2];
  for (const bool interrupted : {false, true}) {
    auto method = watched(*robot.model, "gauss4", 0.04, o);
    auto s = robot.start;
    for (int i = 0; i < 200; ++i) {
      if (interrupted && i == 77) {
        const auto memory = method->memory();
        method = watched(*robot.model, "gauss4", 0.04, o);
        method->restore(memory);
      }
      ASSERT_EQ(method->step(s), Outcome::ok);
    }
    ends[interrupted] = s;
    repeated[interrupted] = method->report().repeated;
  }
  EXPECT_EQ(ends[0].x, ends[1].x);
  EXPECT_EQ(ends[0].lo, ends[1].lo);
  EXPECT_EQ(repeated[0], repeated[1]);
}

/// The memory of the method under watch, at the end of the monitor's own.
std::vector<double> inner_memory(const EnergyMonitor& m, size_t size) {
  const auto all = m.memory();
  return {all.end() - long(size), all.end()};
}
bool same(const phs::State& a, const phs::State& b) { return a.x == b.x && a.lo == b.lo; }

// The copy Tao's method carries is part of the motion: a step that is refused must not move it.
TEST(EnergyMonitor, ARefusedStepLeavesTheMemoryOfTheMethod) {
  const auto robot = swinging_pendulum();
  const double h = 0.04, limit = 1e-4;
  const auto plain = make_integrator("tao2", *robot.model, h);
  const auto repeats =
      watched(*robot.model, "tao2", h, {.step_limit = limit, .action = OnViolation::repeat});
  const auto stops =
      watched(*robot.model, "tao2", h, {.step_limit = limit, .action = OnViolation::stop});
  phs::State a = robot.start, b = a, c = a;
  Outcome o = Outcome::ok;
  std::vector<double> before, after;
  phs::State start;
  while (true) {
    before = plain->memory();
    start = a;
    o = stops->step(c);
    ASSERT_EQ(repeats->step(b), Outcome::ok);
    if (o != Outcome::ok || a.step > 500) break;
    ASSERT_EQ(plain->step(a), Outcome::ok);
    ASSERT_TRUE(same(a, b));
  }
  ASSERT_EQ(o, Outcome::failed) << "there must be a step to refuse";
  ASSERT_EQ(repeats->report().repeated, 1);
  EXPECT_TRUE(same(c, start));
  EXPECT_EQ(inner_memory(*stops, before.size()), before) << "what goes into the checkpoint";

  // The step in 2, 4, 8 ... parts from the same memory; from the one the refused step left it is
  // another.
  double best = INFINITY, moved = 0;
  for (int parts = 2; parts <= 1024; parts *= 2) {
    plain->restore(before);
    phs::State s = start;
    for (int i = 0; i < parts; ++i)
      ASSERT_EQ(plain->advance(start.time(h) + h * i / parts, h / parts, s), Outcome::ok);
    if (same(s, b)) best = 0;
    phs::State refused = start, wrong = start;
    plain->restore(before);
    ASSERT_EQ(plain->advance(start.time(h), h, refused), Outcome::ok);
    for (int i = 0; i < parts; ++i)
      ASSERT_EQ(plain->advance(start.time(h) + h * i / parts, h / parts, wrong), Outcome::ok);
    if (parts == 2)
      for (size_t i = 0; i < s.x.size(); ++i)
        moved = std::max(moved, std::fabs(s.x[i] - wrong.x[i]));
  }
  std::printf("  step %lld refused; with the memory it left, its repetition is %.1e off\n",
              (long long)c.step + 1, moved);
  EXPECT_EQ(best, 0) << "the repetition is the step in smaller parts";
  EXPECT_GT(moved, 1e-9) << "the control: the memory matters";
}

// A step that diverges is repeated by a method whose multipliers it would have poisoned.
TEST(EnergyMonitor, RepeatsAStepThatDiverged) {
  const auto robot = ets_vii(100);
  for (const char* name : {"stormer_verlet", "kahan_li6_sv", "gauss4"}) {
    const auto seen =
        watched(*robot.model, name, 0.08,
                {.step_limit = 1, .action = OnViolation::repeat, .most_halvings = 14});
    phs::State s = robot.start;
    for (int i = 0; i < 5; ++i) ASSERT_EQ(seen->step(s), Outcome::ok) << name << seen->text();
    std::printf("  %s: %s\n", name, seen->text().c_str());
    EXPECT_GT(seen->report().repeated, 0) << name;
  }
}

TEST(EnergyMonitor, RefusesWhatMakesNoSense) {
  const auto robot = swinging_pendulum();
  const auto refusal = [&](MonitorOptions o) -> std::string {
    try {
      watched(*robot.model, "gauss4", 0.1, std::move(o));
    } catch (const InvalidArgument& e) {
      return e.what();
    }
    return "(accepted)";
  };
  EXPECT_EQ(refusal({}),
            "the monitor has nothing to watch, expected a limit, a step_limit or project");
  EXPECT_EQ(refusal({.limit = 1e-17}),
            "the monitor's limit is 1e-17, expected 0 (not watched) or 1e-14 and more");
  EXPECT_EQ(refusal({.limit = 1e-9, .action = OnViolation::repeat}),
            "the monitor repeats steps without a step_limit, expected both");
}

}  // namespace
}  // namespace porthos::test::energy_monitor_test
