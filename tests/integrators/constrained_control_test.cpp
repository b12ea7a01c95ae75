// Steps of transformed time and the monitor's projection on mechanisms with constraints.
#include <gtest/gtest.h>

#include <cmath>

#include "integrators/control/energy_monitor.h"
#include "integrators/control/step_control.h"
#include "phs/system/time_transform.h"
#include "tests/integrators/problems.h"
#include "tests/support/rollers.h"
#include "tests/support/symplectic.h"

namespace porthos::integrators::constrained_control_test {
namespace {

using test::Vec;

/// What a run does to energy, constraints and invariants: the largest change of each.
class Watch {
 public:
  Watch(const phs::Model& model, const phs::State& s)
      : gauge_(model),
        system_(model.instantiate<double>()),
        rows_(system_->constraints()),
        g_(size_t(rows_->count())),
        e_(s.x.size()),
        first_(size_t(model.description().invariant_count())),
        now_(first_),
        H_(gauge_.energy(s)) {
    system_->invariants(s.x, first_);
  }
  void see(double t, const phs::State& s, double put_in = 0) {
    const auto most = [](double& to, const Vec& values) {
      for (const double v : values) to = std::max(to, std::fabs(v));
    };
    rows_->set_time(t);
    rows_->place(s.x, g_);
    most(gap, g_);
    system_->gradient(s.x, e_);
    rows_->rates(e_, g_);
    rows_->add_drift(g_);
    most(slip, g_);
    system_->invariants(s.x, now_);
    for (size_t j = 0; j < now_.size(); ++j)
      drift = std::max(drift, std::fabs(now_[j] - first_[j]));
    energy = std::max(energy, std::fabs(double(gauge_.energy(s) - H_) - put_in));
  }
  void print(const char* what) const {
    std::printf("  %-34s energy %.1e J, |g| %.1e, |Gv| %.1e, invariants %.1e\n", what, energy, gap,
                slip, drift);
  }
  double energy = 0, gap = 0, slip = 0, drift = 0;

 private:
  test::Gauge gauge_;
  std::unique_ptr<phs::System<double>> system_;
  std::unique_ptr<phs::Constraints<double>> rows_;
  Vec g_, e_, first_, now_;
  long double H_;
};

struct Projected {
  Watch with, without;
};
Projected run_projected(const test::Linkage& given, const std::string& method, double h,
                        int steps) {
  test::Linkage l = given;
  const auto model = l.model();
  const phs::State start(model.description(), l.start());
  const auto run = [&](bool project) {
    std::unique_ptr<Integrator> m = make_integrator(method, model, h);
    if (project)
      m = std::make_unique<EnergyMonitor>(std::move(m), model, h, MonitorOptions{.project = true});
    phs::State s = start;
    Watch watch(model, s);
    double put_in = 0;
    for (int i = 0; i < steps; ++i) {
      EXPECT_EQ(m->step(s), Outcome::ok) << method << " " << i;
      for (const double w : m->port_work()) put_in += w;
      watch.see(m->time(s), s, put_in);
    }
    if (project) {
      const auto& r = static_cast<EnergyMonitor&>(*m).report();
      EXPECT_GT(r.projected, steps / 2) << model.description().name;
      EXPECT_EQ(r.out_of_reach, 0) << model.description().name;
    }
    watch.print((model.description().name + (project ? ", projected" : "")).c_str());
    return watch;
  };
  return {run(true), run(false)};
}

/// A coarse method keeps its energy, and the constraints and the invariants as it does alone.
TEST(Projection, KeepsToLoops) {
  for (const auto& [l, h] :
       {std::pair{test::four_bar(), 1. / 32}, std::pair{test::holding_arms(), 1. / 8}}) {
    const auto r = run_projected(l, "spark4", h, 1000);
    EXPECT_LT(r.with.energy, 5e-14);
    EXPECT_GT(r.without.energy, 1e-8);  // else there is nothing to project
    EXPECT_LT(r.with.gap, 2e-15);
    EXPECT_LT(r.with.slip, 3e-14);
    EXPECT_LT(r.with.drift, 3e-14);
  }
}
TEST(Projection, KeepsToMovingAndRollingRows) {
  const auto motor = run_projected(
      test::driven_pendulum(phs::swinging_motion(0.25, 0.75, 0.625, 0.5)), "spark2", 1. / 128, 512);
  const auto disk = run_projected(test::rolling_disk(1, {0.5, 0.25, 3}), "pgauss4", 1. / 32, 512);
  for (const Projected* r : {&motor, &disk}) {
    EXPECT_LT(r->with.energy, 1e-13);
    EXPECT_GT(r->without.energy, 1e-8);
    EXPECT_LT(r->with.gap, 1e-14);
    EXPECT_LT(r->with.slip, 1e-13);
  }
}
/// Control: the same projection without the rows leaves the rates off the constraints.
TEST(Projection, WithoutTheRowsRatesLeaveTheManifold) {
  auto l = test::four_bar();
  const auto model = l.model();
  const mechanics::MechanicalModel tree(l.mechanism);
  const phs::State start(model.description(), l.start());
  const auto move = [&](const phs::Model& of) {
    EnergyProjection project(of);
    const auto system = model.instantiate<double>();
    phs::State s = start;
    EXPECT_TRUE(project(*system, s, system->hamiltonian(s.x) + 0.01));
    EXPECT_NEAR(system->hamiltonian(s.x), system->hamiltonian(start.x) + 0.01, 1e-14);
    Watch w(model, start);
    w.see(0, s);
    return w.slip;
  };
  const double kept = move(model), lost = move(tree);
  std::printf("  |Gv| after 0.01 J: %.1e along the rows, %.1e without them\n", kept, lost);
  EXPECT_LT(kept, 2e-14);
  EXPECT_GT(lost, 1e-4);
}

/// The transformed system of a four-bar, on its manifold, with p_t = -H.
test::Problem transformed(const phs::Model& model, const phs::TimeScaleModel& scale, const Vec& x,
                          double h) {
  const auto t = std::make_shared<phs::TimeTransformedModel>(model, scale);
  Vec z(x.size() + 2, 0.0);
  for (size_t i = 0; i < x.size(); ++i) z[t->position(i)] = x[i];
  z[t->energy_at()] = -model.instantiate<double>()->hamiltonian(x);
  return {"transformed", t, phs::State(t->description(), z), h};
}

TEST(TransformedTime, IsSymplecticAlongTheManifold) {
  auto l = test::four_bar();
  const auto model = l.model();
  const phs::RateTimeScale scale(model, 4);
  const auto p = transformed(model, scale, l.start(), 1. / 32);
  for (const char* name : {"spark4", "spark16", "rattle"}) {
    const double defect =
        test::symplectic_defect(name, *p.model, p.start.x, test::tangents(p), p.h, true);
    std::printf("  %s: defect %.1e\n", name, defect);
    EXPECT_LT(defect, 2e-13) << name;
  }
  // Control: directions that leave the manifold.
  Vec across(p.start.x.size(), 0.0), other = across;
  across[0] = other[4] = 1;
  EXPECT_GT(test::symplectic_defect("spark4", *p.model, p.start.x, {across, other}, p.h, true),
            1e-6);
}

/// The run is that of the plain method in physical time, the steps vary, and all stays.
TEST(TransformedTime, RunsOnTheManifold) {
  auto l = test::four_bar();
  const auto model = l.model();
  const phs::State start(model.description(), l.start());
  for (const auto& [name, h, error, bound] :
       {std::tuple{"spark16", 1. / 64, 1e-12, 2e-13}, std::tuple{"spark4", 1. / 64, 1.0, 1e-4}}) {
    phs::State s = start;
    const auto method = make_time_transformed(name, model, h, {.rate = 4});
    Watch watch(model, s);
    double least = h, most = 0, reactions = 0;
    for (int i = 0; i < 1000; ++i) {
      const double t = method->time(s);
      ASSERT_EQ(method->step(s), Outcome::ok) << name << " " << i;
      least = std::min(least, method->time(s) - t);
      most = std::max(most, method->time(s) - t);
      watch.see(0, s);
      for (const double w : method->port_work()) reactions = std::max(reactions, std::fabs(w));
    }
    watch.print(name);
    std::printf("    steps %.2e to %.2e s, works of the reaction %.1e J\n", least, most, reactions);
    EXPECT_GT(most, 1.5 * least);
    EXPECT_LT(watch.energy, bound);
    EXPECT_LT(watch.gap, 2e-15);
    EXPECT_LT(watch.slip, 2e-14);
    EXPECT_LT(reactions, 1e-14);
    const double end = method->time(s), fine = end / 4096;
    phs::State exact = start;
    const auto plain = make_integrator("spark16", model, fine);
    for (int i = 0; i < 4096; ++i) ASSERT_EQ(plain->step(exact), Outcome::ok);
    const auto a = test::unwrapped(model.description(), s),
               b = test::unwrapped(model.description(), exact);
    std::printf("    off the plain method after %.2f s: %.1e\n", end, test::distance(a, b));
    EXPECT_LT(test::distance(a, b), error);
  }
}
/// Control: without the step back along Gᵀ the rates are off by the energy error.
TEST(TransformedTime, RatesNeedTheWayBack) {
  auto l = test::four_bar();
  const auto model = l.model();
  const phs::RateTimeScale scale(model, 4);
  const auto p = transformed(model, scale, l.start(), 1. / 64);
  const auto method = make_integrator("spark4", *p.model, p.h);
  const auto& t = dynamic_cast<const phs::TimeTransformedModel&>(*p.model);
  phs::State z = p.start, s(model.description(), l.start());
  Watch watch(model, s);
  for (int i = 0; i < 200; ++i) {
    ASSERT_EQ(method->step(z), Outcome::ok);
    for (size_t k = 0; k < s.x.size(); ++k) s.x[k] = z.x[t.position(k)];
    watch.see(0, s);
  }
  watch.print("without the way back");
  EXPECT_LT(watch.gap, 2e-15);
  EXPECT_GT(watch.slip, 1e-9);
}

TEST(TransformedTime, RefusesWhatMovesOrRolls) {
  for (const auto& [given, what] :
       {std::pair{test::driven_pendulum(phs::steady_motion(0, 1)),
                  "moves, and 'driven_pendulum' has"},
        std::pair{test::rolling_disk(1, {0, 0, 1}), "rolls, and 'rolling_disk' has"}}) {
    test::Linkage l = given;
    const auto model = l.model();
    try {
      make_time_transformed("pgauss8", model, 0.01);
      FAIL();
    } catch (const InvalidArgument& e) {
      EXPECT_NE(std::string(e.what()).find(what), std::string::npos) << e.what();
    }
  }
}

}  // namespace
}  // namespace porthos::integrators::constrained_control_test
