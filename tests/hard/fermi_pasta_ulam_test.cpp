// Fermi, Pasta, Ulam with stiff springs, ω = 50 (Hairer, Lubich, Wanner 2006, I.5.1): the
// oscillatory energies I_i exchange on the time ω while their sum I is an adiabatic invariant,
// constant to O(1/ω) over exponentially long times. Must hold to t = 200: gauss8 and gauss16 keep H
// and follow I; stormer_verlet at hω = 1 still keeps I and H in a band; the I_i really exchange.
// Must fail: rk4 at Verlet's step damps the stiff springs.
#include "tests/support/energy_run.h"
#include "tests/support/problems.h"

namespace porthos::fermi_pasta_ulam_test {
namespace {

const test::FermiPastaUlam system_{};
const phs::UserModel<test::FermiPastaUlam> model{system_};

struct Exchange {
  double sum = 0;                                ///< max |I - I(0)|
  double least_first = HUGE_VAL, most_last = 0;  ///< of I_1 and I_3
  double energy = 0;                             ///< max |H - H(0)| / H(0)
  double end_sum = 0;
};

/// q_1 = 1, first stiff spring at I_1 = 1, the rest at zero.
Exchange run(const char* name, double h) {
  std::vector<double> x(12, 0.0);
  x[0] = 1;
  x[6] = 1;
  x[3] = 1 / system_.omega;
  x[9] = 1;
  phs::State s(model.description(), x);
  const auto method = integrators::make_integrator(name, model, h);
  test::Gauge gauge(model);
  const auto I = [&](size_t i) { return system_.oscillatory(std::span<const double>(s.x), i); };
  const double I0 = I(0) + I(1) + I(2);
  const auto H0 = gauge.energy(s);
  Exchange e;
  for (std::int64_t i = 0; i < std::int64_t(200 / h); ++i) {
    if (method->step(s) != integrators::Outcome::ok) return {.sum = HUGE_VAL, .energy = HUGE_VAL};
    e.end_sum = I(0) + I(1) + I(2);
    e.sum = std::max(e.sum, std::fabs(e.end_sum - I0));
    e.least_first = std::min(e.least_first, I(0));
    e.most_last = std::max(e.most_last, I(2));
    e.energy = std::max(e.energy, std::fabs(double((gauge.energy(s) - H0) / H0)));
  }
  return e;
}

TEST(FermiPastaUlam, AdiabaticInvariant) {
  const double h = 1 / system_.omega;
  const auto g16 = run("gauss16", h), g8 = run("gauss8", h / 2), verlet = run("stormer_verlet", h),
             rk4 = run("rk4", h);
  // I oscillates by O(1/ω), the constant being the pull of the soft springs on the stiff ones.
  // Verlet's stiff springs keep p² + (1 - h²ω²/4) ω² q², so their I swings by up to h²ω²/4 / (1 -
  // h²ω²/4) = 1/3 besides; of H that is a share I/H < 1/2.
  const double band = 10 / system_.omega;
  test::keeps("gauss16, h ω = 1: energy", g16.energy, 1e-12);
  test::keeps("gauss16: |I - I(0)|", g16.sum, band);
  test::keeps("gauss8, h ω = 0.5: energy", g8.energy, 1e-11);
  test::keeps("gauss8: |I - I(0)|", g8.sum, band);
  test::keeps("stormer_verlet, h ω = 1: energy", verlet.energy, 1.0 / 6);
  test::keeps("stormer_verlet: |I - I(0)|", verlet.sum, 1.0 / 3 + band);
  test::breaks("gauss16: I_3 reached from zero", g16.most_last, 0.5);
  test::keeps("gauss16: I_1 left of one", g16.least_first, 0.5);
  test::breaks("rk4, h ω = 1: energy", rk4.energy, 1.0 / 6);
  test::keeps("rk4: I at the end, damped away", rk4.end_sum, 0.1);
}

}  // namespace
}  // namespace porthos::fermi_pasta_ulam_test
