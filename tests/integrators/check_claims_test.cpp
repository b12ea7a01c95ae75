// The claims of a method on a system, as a program asks for them.
#include <gtest/gtest.h>

#include <cmath>

#include "integrators/catalogue.h"
#include "integrators/control/step_control.h"
#include "tests/integrators/problems.h"
#include "tests/integrators/quartic_well.h"
#include "tests/support/bounds.h"

namespace porthos::integrators::check_claims_test {
namespace {

const test::Problem& problem(size_t k) { return test::problems()[k]; }  // 2: Henon-Heiles
ClaimReport report(const std::string& method, const test::Problem& p) {
  return check_claims(method, *p.model, p.start.x, p.h);
}
const ClaimResult& of(const ClaimReport& r, const std::string& claim) {
  return *std::ranges::find(r.claims, claim, &ClaimResult::claim);
}
/// rk4 under another name, which claims more than it keeps.
void add_liar(const std::string& name, const std::function<void(Declaration&)>& claims) {
  Entry e = entry_of("rk4");
  e.declaration.name = name;
  claims(e.declaration);
  e.make_lanes = nullptr;
  add_entry(e);
}

// All of the catalogue are judged in claims_test.cpp and order_test.cpp, by the same measures.
TEST(CheckClaims, HoldForMethodsOfTheCatalogue) {
  for (const char* name : {"gauss16", "gauss4", "midpoint", "rk4", "stormer_verlet", "strang",
                           "blanes_moan6", "lobatto4", "tao2"}) {
    const auto& d = declaration_of(name);
    test::Problem p = problem(test::fits(d, problem(0)) ? 0 : 2);
    if (d.name == "tao2") p.h *= 0.2;  // it resolves its binding
    const auto r = report(name, p);
    EXPECT_TRUE(r.holds()) << r.text();
    EXPECT_GE(of(r, "order").measured, d.order - 0.2) << r.text();
    EXPECT_EQ(of(r, "symplectic").declared, d.symplectic == Claim::holds);
  }
}

TEST(CheckClaims, FalseOnesAreTold) {
  const auto refuted = [](const char* claim, Claim Declaration::*which, size_t on) {
    add_liar("liar", [&](Declaration& d) { d.*which = Claim::holds; });
    const auto r = report("liar", problem(on));
    EXPECT_FALSE(r.holds()) << claim;
    for (const auto& c : r.claims) EXPECT_EQ(c.holds(), c.claim != claim) << r.text();
    EXPECT_NE(r.text().find("FAILS"), std::string::npos);
    EXPECT_NE(r.text().find("\n" + std::string(claim) + ": declared, measured an error of "),
              std::string::npos)
        << r.text();
    EXPECT_NE(r.text().find(of(r, claim).how + ", expected at most"), std::string::npos);
  };
  for (const size_t on : {0, 2}) {
    refuted("symplectic", &Declaration::symplectic, on);
    refuted("symmetric", &Declaration::symmetric, on);
    refuted("energy", &Declaration::energy_exact, on);
  }
  refuted("quadratic invariants", &Declaration::quadratic_invariants, 3);
  add_liar("liar", [](Declaration& d) { d.order = 5; });
  const auto r = report("liar", problem(0));
  EXPECT_FALSE(of(r, "order").holds()) << r.text();
  EXPECT_NEAR(of(r, "order").measured, 4, 0.2);
  // The steps are those of the measurement: the fine one is half of the coarse one.
  double measured = 0, coarse = 0, fine = 0, expected = 0;
  const std::string told = r.text().substr(r.text().find("order: declared 5"));
  ASSERT_EQ(std::sscanf(told.c_str(),
                        "order: declared 5, measured %lf from the errors of steps %lf s and %lf s, "
                        "expected at least %lf",
                        &measured, &coarse, &fine, &expected),
            4)
      << told;
  EXPECT_NEAR(measured, 4, 0.2);
  EXPECT_NEAR(coarse, 2 * fine, 1e-5 * coarse);
  EXPECT_LT(coarse, 4 * problem(0).h);
  EXPECT_EQ(expected, 4.5);
  add_liar("liar", [](Declaration&) {});
  EXPECT_TRUE(report("liar", problem(0)).holds()) << "control: what rk4 claims";
  EXPECT_EQ(report("liar", problem(0)).text().find("expected at"), std::string::npos);
  EXPECT_EQ(report("liar", problem(0)).text().find("FAILS"), std::string::npos);
}

/// What h does not show, 6 h may; where no step does, it is told. Control: the step of the problem.
TEST(CheckClaims, AShortStepProvesNothing) {
  add_liar("liar", [](Declaration& d) { d.symmetric = d.symplectic = Claim::holds; });
  const auto& p = problem(2);
  const double short_step = 0.02, far_too_short = 2e-4;
  EXPECT_LT(symmetry_defect("liar", *p.model, p.start, short_step), 1e-10);
  const auto some = check_claims("liar", *p.model, p.start.x, short_step),
             none = check_claims("liar", *p.model, p.start.x, far_too_short);
  for (const char* claim : {"symmetric", "symplectic"}) {
    EXPECT_FALSE(of(some, claim).holds()) << some.text();
    EXPECT_FALSE(of(report("liar", p), claim).holds()) << "control";
    EXPECT_EQ(of(none, claim).why_not, "the step is too short to tell") << none.text();
  }
}

/// Steps that are far too long show nothing, and no claim holds by that.
TEST(CheckClaims, StepsThatBreakDownProveNothing) {
  add_liar("liar", [](Declaration& d) {
    d.symplectic = d.symmetric = d.energy_exact = d.quadratic_invariants = Claim::holds;
  });
  for (const double factor : {1, 30, 300, 3000, 30000}) {
    const auto& p = problem(3);
    const auto r = check_claims("liar", *p.model, p.start.x, factor * p.h);
    EXPECT_FALSE(r.holds()) << r.text();
    for (const char* claim : {"symplectic", "symmetric", "energy", "quadratic invariants"})
      EXPECT_FALSE(of(r, claim).holds()) << r.text();
  }
  // A truth that steps of that size do not show: told, not believed.
  const auto& p = problem(0);
  const auto far = check_claims("gauss4", *p.model, p.start.x, 1000 * p.h);
  EXPECT_FALSE(far.holds()) << far.text();
  EXPECT_NE(far.text().find("not measured: its steps break down"), std::string::npos) << far.text();
  EXPECT_EQ(far.text().find("FAILS"), std::string::npos) << far.text();
}

/// The method of Adams and Bashforth of order 2, which keeps the rates of the last step.
class Adams final : public Integrator {
 public:
  Adams(const Declaration& d, const phs::Model& m, double h, const Options& o, bool carries)
      : Integrator(d, m, h, o), carries_(carries), now_(n_), before_(n_) {}
  Outcome advance(double t, double h, State& s) override {
    system_->field(t, s.x, {}, now_);
    for (size_t i = 0; i < n_; ++i)
      s.x[i] += kept_ ? h * (1.5 * now_[i] - 0.5 * before_[i]) : h * now_[i];
    before_ = now_;
    kept_ = true;
    return Outcome::ok;
  }
  void carry(Archive& archive) override {
    if (!carries_) return;
    archive(kept_);
    archive(before_);
  }

 private:
  bool carries_, kept_ = false;
  std::vector<double> now_, before_;
};

/// Control: with its memory it is resumable.
TEST(CheckClaims, AMethodThatForgetsIsNotResumable) {
  for (const bool carries : {false, true}) {
    Declaration d;
    d.name = carries ? "adams" : "forgetful_adams";
    d.order = 2;
    add_entry(double_entry(
        d, [carries](const Declaration& as, const phs::Model& m, double h, const Options& o) {
          return std::make_unique<Adams>(as, m, h, o, carries);
        }));
    auto p = problem(0);
    p.h /= 16;
    const auto r = report(d.name, p);
    EXPECT_EQ(of(r, "resumable").holds(), carries) << r.text();
    EXPECT_EQ(of(r, "resumable").measured == 0, carries);
  }
}

/// Steps of the midpoint rule, explicit, as many as a tolerance wants.
class Tolerant final : public Integrator {
 public:
  Tolerant(const Declaration& d, const phs::Model& m, double h, const Options& o)
      : Integrator(d, m, h, o), k_(n_), y_(n_) {}
  Outcome advance(double t, double h, State& s) override {
    const int parts = std::max(1, int(std::fabs(h) / std::sqrt(options_.rtol)));
    for (int j = 0; j < parts; ++j) {
      const double part = h / parts;
      system_->field(t, s.x, {}, k_);
      for (size_t i = 0; i < n_; ++i) y_[i] = s.x[i] + part / 2 * k_[i];
      system_->field(t, y_, {}, k_);
      for (size_t i = 0; i < n_; ++i) s.x[i] += part * k_[i];
    }
    return Outcome::ok;
  }

 private:
  std::vector<double> k_, y_;
};

/// A tight tolerance would make it look symmetric: there its defect is below the bound.
TEST(CheckClaims, ATightToleranceHidesNoFalseClaim) {
  Declaration d;
  d.name = "tolerant";
  d.symmetric = Claim::holds;
  add_entry(
      double_entry(d, [](const Declaration& as, const phs::Model& m, double h, const Options& o) {
        return std::make_unique<Tolerant>(as, m, h, o);
      }));
  const auto r = report("tolerant", problem(0));
  EXPECT_FALSE(of(r, "symmetric").holds()) << r.text();
  EXPECT_EQ(of(r, "order").why_not, "a tolerance sets it");
}

/// Damping and a drive that depend on the place: H = p²/2 + q⁴/4.
struct DampedOscillator : test::QuarticWell {
  phs::Description description() const {
    auto d = of("damped oscillator");
    d.traits.separable = true;
    return d;
  }
  template <class T>
  void dissipation(std::span<const T> x, std::span<const T> e, std::span<T> Re) const {
    Re[0] = T(0.0);
    Re[1] = T(0.05) * x[0] * x[0] * e[1];
  }
  template <class T>
  void drive(T t, std::span<const T> x, std::span<T> dx) const {
    using phs::sin, std::sin;
    dx[1] = dx[1] + (T(1.0) + T(0.3) * x[0]) * sin(t);
  }
};

TEST(CheckClaims, PassivityShowsWhereEnergyIsLostAndSupplied) {
  const phs::UserModel<DampedOscillator> damped{DampedOscillator{}};
  const auto on_damped = [&](const std::string& method) {
    return check_claims(method, damped, {1.5, 0.3}, 0.05);
  };
  const auto held = on_damped("gonzalez");
  EXPECT_TRUE(held.holds()) << held.text();
  EXPECT_TRUE(of(held, "passivity").declared);
  test::keeps("balance of gonzalez", of(held, "passivity").measured, 1e-11);
  test::breaks("that of gauss4, which claims none", of(on_damped("gauss4"), "passivity").measured,
               1e-11);
  EXPECT_TRUE(on_damped("gauss4").holds());
  EXPECT_EQ(of(held, "energy").why_not, "the system depends on time");
  add_liar("liar", [](Declaration& d) { d.passivity_exact = Claim::holds; });
  const auto r = on_damped("liar");
  EXPECT_FALSE(of(r, "passivity").holds()) << r.text();
  EXPECT_NE(r.text().find("of H less the works within 100 steps"), std::string::npos) << r.text();
  EXPECT_EQ(of(report("liar", problem(0)), "passivity").why_not, "nothing is supplied or lost");
}

/// Euler's method whose steps grow, as it likes.
class Varying final : public Integrator {
 public:
  Varying(const Declaration& d, const phs::Model& m, double h, const Options& o)
      : Integrator(d, m, h, o) {}
  bool varies() const override { return true; }
  Outcome step(State& s) override {
    const double h = h_ * (1 + 0.5 * double(s.step % 3));
    const Outcome o = advance(s.time(h_), h, s);
    if (o == Outcome::ok) s.step_off_the_grid(h_, h);
    return o;
  }
  Outcome advance(double t, double h, State& s) override {
    std::vector<double> rates(n_);
    system_->field(t, s.x, {}, rates);
    for (size_t i = 0; i < n_; ++i) s.x[i] += h * rates[i];
    return Outcome::ok;
  }
};

/// Of steps that it chooses no order can be measured, and no step control can choose them.
/// Controls: methods of a tolerance inside steps of one size, which it can.
TEST(CheckClaims, AMethodThatChoosesItsStepsHasNoOrder) {
  Declaration d;
  d.name = "varying";
  d.order = 1;
  add_entry(
      double_entry(d, [](const Declaration& as, const phs::Model& m, double h, const Options& o) {
        return std::make_unique<Varying>(as, m, h, o);
      }));
  const auto r = report("varying", problem(0));
  EXPECT_EQ(of(r, "order").why_not, "the method chooses its steps itself");
  EXPECT_TRUE(of(r, "order").holds()) << r.text();
  const auto refused = [](const std::string& method) {
    return test::refusal([&] {
      make_controlled(StepControl::time_transformed, method, *problem(0).model, 0.01, {});
    });
  };
  EXPECT_NE(refused("varying").find("chooses its steps itself"), std::string::npos);
  EXPECT_EQ(refused("radau15"), "");
}

/// At rest every order is exact: that is told, and is no failure.
TEST(CheckClaims, AStartWithoutErrorTellsNoOrder) {
  const auto& p = problem(0);
  const auto r = check_claims("rk4", *p.model, std::vector<double>(p.start.x.size(), 0.0), p.h);
  EXPECT_NE(of(r, "order").why_not.find("take another start"), std::string::npos) << r.text();
  EXPECT_TRUE(r.holds()) << r.text();
}

TEST(CheckClaims, SayWhatIsNotMeasured) {
  const auto r = report("gauss4", problem(0));
  EXPECT_EQ(of(r, "quadratic invariants").why_not, "the system declares none");
  EXPECT_NE(r.text().find("not measured: the system declares none"), std::string::npos);
  EXPECT_TRUE(of(report("gauss4", problem(3)), "quadratic invariants").why_not.empty());
  Entry e = entry_of("gauss4");
  e.declaration.name = "double_only";
  add_entry(double_entry(e.declaration, e.make_double));
  const auto d = report("double_only", problem(0));
  EXPECT_EQ(of(d, "symplectic").why_not, "the method works in double only");
  EXPECT_NEAR(of(d, "order").measured, 4, 0.2) << d.text();
  const auto few = [] { check_claims("gauss4", *problem(0).model, {0.1}, 0.1); };
  EXPECT_NE(test::refusal(few), "");
  const auto unfit = [] {
    check_claims("stormer_verlet", *problem(4).model, problem(4).start.x, 0.1);
  };
  EXPECT_NE(test::refusal(unfit), "");
}

}  // namespace
}  // namespace porthos::integrators::check_claims_test
