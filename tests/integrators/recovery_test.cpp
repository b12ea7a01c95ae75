// A step that fails leaves nothing behind: the next one gives the bits of a method that has not
// failed.
#include <gtest/gtest.h>

#include <cstdio>

#include "tests/integrators/problems.h"

namespace porthos::integrators::recovery_test {
namespace {

bool same(const phs::State& a, const phs::State& b) { return a.x == b.x && a.lo == b.lo; }

std::unique_ptr<Integrator> fresh(const Declaration& d, const test::Problem& p) {
  return make_integrator(d.name, *p.model, p.h);
}

/// Takes a step that must fail, of a size far too long or from a state that is no number. False if
/// the method takes it.
bool fails(Integrator& method, const phs::State& at, double h) {
  phs::State s = at;
  if (std::isnan(h)) s.x.back() = NAN;
  const phs::State before = s;
  const Outcome o = std::isnan(h) ? method.step(s) : method.step_by(s, h);
  if (o == Outcome::ok) return false;
  EXPECT_TRUE(s.x == before.x || std::isnan(h)) << method.declaration().name;
  EXPECT_EQ(s.step, before.step) << method.declaration().name;
  return true;
}

TEST(Recovery, EveryMethodGoesOnAfterAFailedStep) {
  int failures = 0;
  for (const auto& p : test::problems())
    for (const auto& d : catalogue()) {
      if (!test::fits(d, p)) continue;
      // A step of 1e300 s would be cut into millions by what chooses its own.
      const bool chooses = d.rival || d.order == 0;
      for (const double h : {20.0, 1e3, 1e300, double(NAN)}) {
        if (chooses && !std::isnan(h)) continue;
        const auto failed = fresh(d, p), other = fresh(d, p);
        if (!fails(*failed, p.start, h)) continue;
        ++failures;
        phs::State a = p.start, b = p.start;
        ASSERT_EQ(other->step(b), Outcome::ok) << d.name;
        EXPECT_EQ(failed->step(a), Outcome::ok)
            << d.name << " on the " << p.name << " after a step of " << h << " s";
        EXPECT_TRUE(same(a, b)) << d.name << " on the " << p.name << " after a step of " << h;
      }
    }
  std::printf("  %d failed steps\n", failures);
  EXPECT_GT(failures, 200);
}

// In the middle of a run too: as a method that starts there, or, where the memory is part of the
// motion (Tao's copy), as one that never tried.
TEST(Recovery, EveryMethodGoesOnInTheMiddleOfARun) {
  const auto p = test::floating_arm();
  for (const auto& d : catalogue()) {
    if (!test::fits(d, p) || d.rival || d.order == 0) continue;
    const auto method = fresh(d, p), calm = fresh(d, p);
    phs::State s = p.start, t = p.start;
    for (int i = 0; i < 3; ++i) {
      ASSERT_EQ(method->step(s), Outcome::ok) << d.name;
      ASSERT_EQ(calm->step(t), Outcome::ok) << d.name;
    }
    ASSERT_TRUE(fails(*method, s, NAN)) << d.name;
    phs::State anew = s;
    ASSERT_EQ(method->step(s), Outcome::ok) << d.name;
    ASSERT_EQ(calm->step(t), Outcome::ok) << d.name;
    ASSERT_EQ(fresh(d, p)->step(anew), Outcome::ok) << d.name;
    EXPECT_TRUE(same(s, anew) || same(s, t)) << d.name;
  }
}

// The control: what used to stay behind, a multiplier that is not a number, is seen.
TEST(Recovery, AMemoryThatIsNoNumberIsSeen) {
  const auto p = test::floating_arm();
  for (const char* name : {"stormer_verlet", "kahan_li8_sv"}) {
    const auto method = make_integrator(name, *p.model, p.h);
    method->restore(std::vector<double>(method->memory().size(), NAN));
    phs::State s = p.start;
    EXPECT_EQ(method->step(s), Outcome::not_finite) << name;
    s = p.start;
    EXPECT_EQ(method->step(s), Outcome::ok) << name << " has dropped it";
  }
}

}  // namespace
}  // namespace porthos::integrators::recovery_test
