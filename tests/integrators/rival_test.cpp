// The methods of other libraries: that they converge, stop where they are told, count what they
// evaluate, and answer trouble by a status.
#include <gtest/gtest.h>

#include <limits>
#include <set>

#ifdef PORTHOS_HAVE_GSL
#include <gsl/gsl_errno.h>
#endif

#include "integrators/catalogue.h"
#include "tests/integrators/quartic_well.h"
#include "tests/support/driven_pendulum.h"
#include "tests/support/fast_arm.h"

/// A method of a program of one's own, whose namespace is not within porthos.
namespace program_with_a_method {

template <class T>
auto make(const porthos::integrators::Declaration& declaration, const porthos::phs::Model& model,
          T h, const porthos::integrators::Options& options) {
  return porthos::integrators::entry_of("rk4").make<T>()(declaration, model, h, options);
}
porthos::integrators::Entry method() {
  return porthos::integrators::entry({.name = "of_a_program"}, PORTHOS_MAKER(make));
}
}  // namespace program_with_a_method

namespace porthos::integrators::rival_test {
namespace {

using phs::Quad;
using namespace test::fast_arm;

/// Those of constrained systems: constrained_rival_test.cpp.
std::vector<std::string> rivals() {
  std::vector<std::string> names;
  for (const auto& d : catalogue())
    if (d.rival && !d.constraints) names.push_back(d.name);
  return names;
}
bool implicit(const std::string& name) {
  return name == "cvode_bdf" || name == "arkode_dirk5" || name == "ida" || name == "gsl_bsimp";
}
bool has_history(const std::string& name) {
  return name == "cvode_adams" || name == "cvode_bdf" || name == "ida" || name == "gsl_msadams";
}
Options tolerance(double tol) { return {.rtol = tol, .atol = tol}; }

double distance(const phs::State& a, const phs::State& b) {
  return test::distance({a.x.begin(), a.x.end()}, {b.x.begin(), b.x.end()});
}

TEST(Rivals, AreHonest) {
  EXPECT_GE(rivals().size(), 7u);
  for (const auto& name : rivals()) {
    const Declaration& d = declaration_of(name);
    EXPECT_EQ(d.family, "Reference solvers") << name;
    EXPECT_FALSE(d.resumable) << name;
    EXPECT_EQ(d.order, 0) << name;
    EXPECT_NE(d.source, "") << name;
  }
}

TEST(Rivals, ConvergeAsTheToleranceShrinks) {
  const auto error = [](const std::string& name, double tol, int steps) {
    const auto method = make_integrator(name, *robot().model, duration / steps, tolerance(tol));
    phs::State s = robot().start;
    for (int i = 0; i < steps; ++i) EXPECT_EQ(method->step(s), Outcome::ok) << method->remark();
    EXPECT_EQ(s.turns, robot().start.turns) << "angles are not wrapped";
    return test::distance({s.x.begin(), s.x.end()}, reference());
  };
  for (const auto& name : rivals()) {
    const double loose = error(name, 1e-5, 1), tight = error(name, 1e-10, 1),
                 in_pieces = error(name, 1e-10, 8);
    std::printf(
        "  %-12s error at 1e-5: %.1e (> 1e-7), at 1e-10: %.1e, in eight outputs %.1e (<= 1e-7)\n",
        name.c_str(), loose, tight, in_pieces);
    EXPECT_LE(tight, 1e-7) << name;
    EXPECT_LE(in_pieces, 1e-7) << name;
    EXPECT_GT(loose, 1e-7) << name << ": the control must miss the bound";
    EXPECT_GT(loose, 100 * tight) << name;
  }
}

// A multistep method that keeps its history from step to step works less than one that starts anew
// at each, and a state that it did not leave itself makes it start anew: with the bits of a new
// object.
TEST(Rivals, GoOnFromTheirOwnStatesOnly) {
  const int steps = 16;
  const double h = duration / steps;
  for (const auto& name : rivals()) {
    const auto one = make_integrator(name, *robot().model, h, tolerance(1e-8));
    phs::State s = robot().start, t = robot().start;
    Cost fresh;
    for (int i = 0; i < steps; ++i) {
      ASSERT_EQ(one->step(s), Outcome::ok);
      const auto other = make_integrator(name, *robot().model, h, tolerance(1e-8));
      ASSERT_EQ(other->step(t), Outcome::ok);
      fresh.evaluations += other->cost().evaluations;
    }
    std::printf("  %-12s evaluations going on %6lld, starting anew every step %6lld\n",
                name.c_str(), (long long)one->cost().evaluations, (long long)fresh.evaluations);
    EXPECT_FALSE(s == t) << name << ": a new object takes the same steps, why not resumable?";
    if (has_history(name)) {
      EXPECT_LT(2 * one->cost().evaluations, fresh.evaluations) << name;
    }

    for (const bool low_word : {false, true}) {
      (low_word ? s.lo : s.x)[20] += low_word ? 1e-20 : 1e-3;
      phs::State a = s, b = s;
      const auto other = make_integrator(name, *robot().model, h, tolerance(1e-8));
      ASSERT_EQ(one->step(a), Outcome::ok);
      ASSERT_EQ(other->step(b), Outcome::ok);
      EXPECT_TRUE(a == b) << name << ": a state from elsewhere, yet the old history";
      s = a;
    }
  }
}

TEST(Rivals, RunBackwards) {
  for (const auto& name : rivals()) {
    const auto method = make_integrator(name, *robot().model, 1.0, tolerance(1e-10));
    phs::State s = robot().start;
    for (int i = 0; i < 3; ++i) ASSERT_EQ(method->step(s), Outcome::ok);
    const double away = distance(s, robot().start);
    for (int i = 0; i < 3; ++i) ASSERT_EQ(method->step_by(s, -1.0), Outcome::ok);
    const double back = distance(s, robot().start);
    std::printf("  %-12s three steps away %.1e, and back to %.1e   bound 1e-6\n", name.c_str(),
                away, back);
    EXPECT_GT(away, 0.1) << name;
    EXPECT_LE(back, 1e-6) << name;
    EXPECT_EQ(method->time(s), 0) << name;
  }
}

enum class Trouble { none, nan, exception };

/// The driven pendulum, with trouble after t = 0.5. It counts the evaluations of its gradient,
/// and those in duals.
struct Pendulum : test::DrivenPendulum {
  Trouble trouble = Trouble::none;
  std::int64_t *count, *duals;

  Pendulum(Trouble t, std::int64_t* c, std::int64_t* d = nullptr)
      : trouble(t), count(c), duals(d) {}
  template <class T>
  void gradient(std::span<const T> x, std::span<T> e) const {
    ++*count;
    if (duals) *duals += std::is_same_v<T, phs::Dual>;
    test::DrivenPendulum::gradient(x, e);
  }
  template <class T>
  void drive(T t, std::span<const T> x, std::span<T> dx) const {
    test::DrivenPendulum::drive(t, x, dx);
    if (trouble == Trouble::none || !phs::any(t > T(0.5))) return;
    if (trouble == Trouble::exception) throw InvalidArgument("the motor burnt out");
    dx[1] = T(std::numeric_limits<double>::quiet_NaN());
  }
};

// The clock of a driven system, from t = 3 on; evaluations as the system counts them, the
// Jacobian's in duals included.
TEST(Rivals, KeepTheTimeAndCountEveryEvaluation) {
  std::int64_t count = 0, duals = 0;
  const phs::UserModel<Pendulum> model({Trouble::none, &count, &duals});
  phs::State start(model.description(), {0.5, 1.0});
  start.origin = 3;
  phs::State exact = start, late = start;
  late.origin = 3.01;
  const auto gauss = make_integrator("gauss16", model, 0.125);
  for (int i = 0; i < 16; ++i) ASSERT_EQ(gauss->step(exact), Outcome::ok);
  for (int i = 0; i < 16; ++i) ASSERT_EQ(gauss->step(late), Outcome::ok);
  ASSERT_GT(distance(exact, late), 1e-3) << "the control: a clock that is late shows";
  for (const auto& name : rivals()) {
    auto options = tolerance(1e-10);
    options.port_work = false;  // they are taken by evaluations of their own
    const auto method = make_integrator(name, model, 0.5, options);
    count = duals = 0;
    phs::State s = start;
    for (int i = 0; i < 4; ++i) ASSERT_EQ(method->step(s), Outcome::ok);
    const double error = distance(s, exact);
    std::printf(
        "  %-12s error %.1e (1e-7), %lld evaluations, %lld counted, %lld in duals, %lld "
        "factorisations\n",
        name.c_str(), error, (long long)method->cost().evaluations, (long long)count,
        (long long)duals, (long long)method->cost().factorisations);
    EXPECT_LE(error, 1e-7) << name;
    EXPECT_EQ(method->cost().evaluations, count) << name;
    EXPECT_EQ(method->cost().steps, 4) << name;
    EXPECT_EQ(duals > 0, implicit(name)) << name << ": an exact Jacobian";
    if (name != "gsl_bsimp") {
      EXPECT_EQ(method->cost().factorisations > 0, implicit(name)) << name;
    }
  }
}

/// A mass dragged through syrup by a periodic force, q' = p, p' = c (sin 3t - p) - q³: stiff, and
/// driven so.
struct Syrup : test::QuarticWell {
  static constexpr double c = 1e5;
  phs::Description description() const { return of("syrup"); }
  template <class T>
  void dissipation(std::span<const T>, std::span<const T> e, std::span<T> Re) const {
    Re[0] = T(0.0);
    Re[1] = T(c) * e[1];
  }
  template <class T>
  void drive(T t, std::span<const T>, std::span<T> dx) const {
    dx[1] += T(c) * phs::sin(T(3.0) * t);
  }
};

// With the right Jacobian an implicit method does not see the stiffness; an explicit one does, and
// so does an implicit one whose Jacobian is wrong; gsl_bsimp takes ∂f/∂t too, and 2699 evaluations
// without it.
TEST(Rivals, ImplicitOnesHaveTheRightJacobian) {
  const phs::UserModel<Syrup> model(Syrup{});
  for (const auto& name : rivals()) {
    if (!implicit(name) && name != "arkode_erk5") continue;
    phs::State s(model.description(), {0.5, 0.0});
    const auto method = make_integrator(name, model, 1.0, tolerance(1e-6));
    ASSERT_EQ(method->step(s), Outcome::ok) << name;
    const auto evaluations = (long long)method->cost().evaluations;
    const long long bound = name == "gsl_bsimp" ? 2000 : 5000;
    std::printf("  %-12s %lld evaluations (implicit: at most %lld, explicit: more)\n", name.c_str(),
                evaluations, bound);
    if (implicit(name)) {
      EXPECT_LE(evaluations, bound) << name;
    } else {
      EXPECT_GT(evaluations, bound) << name << ": the control";
    }
  }
}
TEST(Rivals, TroubleIsAStatusWithoutAWord) {
  std::int64_t count = 0;
  const phs::UserModel<Pendulum> nan({Trouble::nan, &count}), burnt({Trouble::exception, &count});
  const phs::State start(nan.description(), {0.5, 1.0});
  for (const auto& name : rivals()) {
    testing::internal::CaptureStderr();
    phs::State s = start;
    const auto method = make_integrator(name, nan, 1.0, tolerance(1e-8));
    count = 0;
    EXPECT_EQ(method->step(s), Outcome::not_finite) << name;
    std::printf("  %-12s %lld evaluations until it gave up (at most 5000)\n", name.c_str(),
                (long long)count);
    EXPECT_LE(count, 5000) << name << ": it crept up to the singularity";
    EXPECT_TRUE(s == start) << name << ": the state must be unchanged";
    EXPECT_EQ(method->step_by(s, 0.25), Outcome::ok) << name << ": usable after a failure";
    s.x[1] = std::numeric_limits<double>::infinity();
    EXPECT_EQ(method->step(s), Outcome::not_finite) << name;

    s = start;
    const auto other = make_integrator(name, burnt, 1.0, tolerance(1e-8));
    try {
      EXPECT_NE(other->step(s), Outcome::ok);
      ADD_FAILURE() << name << ": the exception was lost";
    } catch (const InvalidArgument& e) {
      EXPECT_STREQ(e.what(), "the motor burnt out") << name;
    }
    EXPECT_TRUE(s == start) << name;
    EXPECT_EQ(other->step_by(s, 0.25), Outcome::ok) << name;
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "") << name;
  }
}

/// A mass between two walls, H = p²/2 + k / (1 - q²), which is no number beyond a wall. It counts
/// the trials there.
struct Walls {
  static constexpr double k = 0.05;
  std::int64_t* beyond;
  phs::Description description() const {
    phs::Description d;
    d.name = "walls";
    d.nx = 2;
    d.traits = {.canonical = true, .separable = true};
    d.blocks = {{"q", phs::BlockKind::linear, 0, 1, 1, "m", "kg m/s"}};
    return d;
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    return T(0.5) * x[1] * x[1] + T(k) / (T(1.0) - x[0] * x[0]);
  }
  template <class T>
  void gradient(std::span<const T> x, std::span<T> e) const {
    const T room = T(1.0) - x[0] * x[0];
    const bool outside = !phs::any(room > T(0.0));
    *beyond += outside;
    e[0] =
        outside ? T(std::numeric_limits<double>::quiet_NaN()) : T(2.0 * k) * x[0] / (room * room);
    e[1] = x[1];
  }
};

// A trial that is not a number is taken back by a shorter inner step; the run goes on, as accurate
// as ever.
TEST(Rivals, TrialsBeyondTheDomainAreTakenBack) {
  std::int64_t beyond = 0;
  const phs::UserModel<Walls> model(Walls{&beyond});
  const phs::State start(model.description(), {0.0, 3.0});
  phs::State exact = start;
  const auto gauss = make_integrator("gauss16", model, 1.0 / 1024);
  for (int i = 0; i < 2048; ++i) ASSERT_EQ(gauss->step(exact), Outcome::ok);
  ASSERT_EQ(beyond, 0);
  for (const auto& name : rivals()) {
    std::int64_t trials = 0;
    for (const double tol : {1e-2, 1e-4, 1e-9}) {
      beyond = 0;
      phs::State s = start;
      const auto method = make_integrator(name, model, 2.0, tolerance(tol));
      ASSERT_EQ(method->step(s), Outcome::ok) << name << " at " << tol << ": " << method->remark();
      trials += beyond;
      const double error = distance(s, exact);
      std::printf("  %-12s tolerance %.0e: %lld trials beyond a wall, error %.1e\n", name.c_str(),
                  tol, (long long)beyond, error);
      if (tol == 1e-9) {
        EXPECT_LE(error, 1e-5) << name;
      }
    }
    EXPECT_GT(trials, 0) << name << ": the control, nothing was taken back";
  }
}

/// H = q p²: p = -1 / (1 - t) from p = -1 leaves for infinity at t = 1.
struct BlowUp {
  phs::Description description() const {
    phs::Description d;
    d.name = "blow-up";
    d.nx = 2;
    d.traits = {.canonical = true};
    d.blocks = {{"q", phs::BlockKind::linear, 0, 1, 1, "m", "kg m/s"}};
    return d;
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    return x[0] * x[1] * x[1];
  }
  template <class T>
  void gradient(std::span<const T> x, std::span<T> e) const {
    e[0] = x[1] * x[1];
    e[1] = T(2.0) * x[0] * x[1];
  }
};

TEST(Rivals, DoNotFollowASolutionToInfinity) {
  const phs::UserModel<BlowUp> model(BlowUp{});
  const phs::State start(model.description(), {1.0, -1.0});
  for (const auto& name : rivals()) {
    phs::State s = start;
    const auto method = make_integrator(name, model, 2.0, tolerance(1e-8));
    const Outcome outcome = method->step(s);
    std::printf("  %-12s %s: %s, %lld evaluations (at most 5e4)\n", name.c_str(),
                to_string(outcome), method->remark().c_str(),
                (long long)method->cost().evaluations);
    EXPECT_NE(outcome, Outcome::ok) << name;
    EXPECT_TRUE(s == start) << name;
    EXPECT_LE(method->cost().evaluations, 50'000) << name;
    EXPECT_NE(method->remark(), "") << name;
  }
}

/// A mass on a spring with dry friction. Where it sticks, q' = p changes sign at every inner step.
struct DryFriction {
  phs::Description description() const {
    phs::Description d;
    d.name = "dry friction";
    d.nx = 2;
    d.traits = {.canonical = true, .lossless = false};
    d.blocks = {{"q", phs::BlockKind::linear, 0, 1, 1, "m", "kg m/s"}};
    return d;
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    return T(0.5) * (x[1] * x[1] + x[0] * x[0]);
  }
  template <class T>
  void gradient(std::span<const T> x, std::span<T> e) const {
    e[0] = x[0];
    e[1] = x[1];
  }
  template <class T>
  void dissipation(std::span<const T>, std::span<const T> e, std::span<T> Re) const {
    Re[0] = T(0.0);
    Re[1] = phs::any(e[1] > T(0.0)) ? T(2.0) : T(-2.0);
  }
};

TEST(Rivals, GiveUpWithAReason) {
  const phs::UserModel<DryFriction> model(DryFriction{});
  const phs::State start(model.description(), {0.5, 1.0});
  // One of each library and way to stop; arkode_erk8 does come to the end.
  const std::set<std::string> some{"cvode_adams", "arkode_erk4", "ida", "gsl_msadams", "gsl_bsimp"};
  for (const auto& name : rivals()) {
    if (!some.contains(name)) continue;
    testing::internal::CaptureStderr();
    phs::State s = start;
    const auto method = make_integrator(name, model, 1.0, tolerance(1e-13));
    EXPECT_EQ(method->step(s), Outcome::failed) << name;
    std::printf("  %-12s %lld evaluations, %s\n", name.c_str(),
                (long long)method->cost().evaluations, method->remark().c_str());
    EXPECT_NE(method->remark(), "") << name;
    EXPECT_TRUE(s == start) << name;
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "") << name;
  }
}

TEST(Rivals, RefuseTolerancesThatAreNone) {
  const auto text = [](const std::string& name, const Options& o) -> std::string {
    try {
      make_integrator(name, *robot().model, 1.0, o);
    } catch (const InvalidArgument& e) {
      return e.what();
    }
    return "";
  };
  for (const auto& name : rivals()) {
    const std::string method = "method '" + name + "': ";
    const std::string least = ", expected a finite number of at least 2.2e-16, the unit round-off";
    EXPECT_EQ(text(name, {.rtol = -1}), method + "rtol is -1" + least);
    EXPECT_EQ(text(name, {.rtol = 0}), method + "rtol is 0" + least);
    EXPECT_EQ(text(name, {.rtol = 1e-16}), method + "rtol is 1e-16" + least);
    EXPECT_EQ(text(name, {.rtol = INFINITY}), method + "rtol is inf" + least);
    EXPECT_EQ(text(name, {.atol = NAN}), method + "atol is nan, expected a finite number above 0");
    EXPECT_EQ(text(name, {.atol = 0}), method + "atol is 0, expected a finite number above 0");
    EXPECT_EQ(text(name, {.rtol = 3e-16, .atol = 1e-30}), "");
  }
}

/// H alone: its gradient comes by duals, in double only.
struct Bare {
  phs::Description description() const { return test::Pendulum{}.description(); }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    return T(0.5) * x[1] * x[1] + T(0.25) * x[0] * x[0] * x[0] * x[0];
  }
};

TEST(Rivals, WithoutDualsTakeDifferencesOrRefuse) {
  const phs::UserModel<Bare> model(Bare{});
  const phs::State start(model.description(), {0.5, 1.0});
  for (const auto& name : rivals()) {
    if (name == "gsl_bsimp") {
      try {
        make_integrator(name, model, 1.0);
        ADD_FAILURE() << name;
      } catch (const InvalidArgument& e) {
        EXPECT_STREQ(e.what(),
                     "method 'gsl_bsimp' needs the Jacobian of the field, 'pendulum' cannot be "
                     "evaluated in duals");
      }
      continue;
    }
    phs::State s = start;
    const auto method = make_integrator(name, model, 1.0, tolerance(1e-10));
    EXPECT_EQ(method->step(s), Outcome::ok) << name;
    const auto H = [&](const phs::State& x) { return Bare{}.hamiltonian<double>(x.x); };
    EXPECT_NEAR(H(s), H(start), 1e-7) << name;
  }
}

#ifdef PORTHOS_HAVE_GSL
int errors_of_gsl = 0;

TEST(Rivals, KeepGslFromAbortingAndLeaveAHandlerOfOnesOwn) {
  const phs::UserModel<Bare> model(Bare{});
  const auto make = [&] { make_integrator("gsl_rk8pd", model, 1.0); };
  gsl_set_error_handler(nullptr);  // GSL's own, which aborts
  make();
  gsl_error("nobody shall hear of this", __FILE__, __LINE__, GSL_EFAILED);

  gsl_set_error_handler([](const char*, const char*, int, int) { ++errors_of_gsl; });
  make();
  gsl_error("a program's own handler shall", __FILE__, __LINE__, GSL_EFAILED);
  EXPECT_EQ(errors_of_gsl, 1);
  gsl_set_error_handler(nullptr);
}
#endif

TEST(Catalogue, TakesMethodsInUse) {
  const Entry& rk4 = entry_of("rk4");
  add_entry(program_with_a_method::method());
  Entry own = rk4;
  own.declaration.name = "own";
  add_entry(own);
  EXPECT_EQ(&entry_of("rk4"), &rk4);  // references stay
  EXPECT_EQ(catalogue().back().name, "own");
  own.declaration.order = 3;
  EXPECT_EQ(version_of("own"), "");
  add_entry(own, "mine");  // replaced
  EXPECT_EQ(version_of("own"), "mine");
  EXPECT_EQ(declaration_of("own").order, 3);
  EXPECT_EQ(std::ranges::count(catalogue(), "own", &Declaration::name), 1);
  EXPECT_THROW(add_entry(rk4), InvalidArgument);
  const phs::UserModel<Bare> model(Bare{});
  EXPECT_EQ(make_integrator("of_a_program", model, 0.1)->declaration().name, "of_a_program");
}

}  // namespace
}  // namespace porthos::integrators::rival_test
