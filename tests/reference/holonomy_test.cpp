// A planar free-floating base with prescribed cyclic joint motion and zero momentum: its rotation
// is a holonomy of the mechanical connection. The base's kinematics, made a (non-autonomous) system
// of the contract, run with gauss16.
#include <cmath>

#include "integrators/core/integrator.h"
#include "mechanics/crba.h"
#include "mechanics/kinematics.h"
#include "phs/system/user_model.h"
#include "tests/support/tree_case.h"

namespace porthos::holonomy_test {
namespace {

using mechanics::Mechanism;

/// x = base position and quaternion; x' follows from zero momentum: M_bb v_b + M_bj v_j = 0.
struct ZeroMomentumBase {
  std::shared_ptr<const Mechanism> mechanism;
  static constexpr bool drop_coupling = false;

  phs::Description description() const {
    phs::Description d;
    d.name = "zero-momentum base";
    d.nx = 7;
    d.traits.autonomous = false;
    d.blocks = {{"position", phs::BlockKind::linear, 0, 3, -1, "m", ""},
                {"attitude", phs::BlockKind::rotation, 3, 4, -1, "1", ""}};
    return d;
  }
  template <class T>
  T hamiltonian(std::span<const T>) const {
    return T(0.0);
  }
  template <class T>
  void gradient(std::span<const T>, std::span<T> e) const {
    for (auto& g : e) g = T(0.0);
  }
  template <class T>
  void structure(std::span<const T>, std::span<const T>, std::span<T> Je) const {
    for (auto& g : Je) g = T(0.0);
  }
  template <class T>
  void drive(T t, std::span<const T> x, std::span<T> dx) const {
    const Mechanism& m = *mechanism;
    mechanics::Workspace<T> w(m);
    const size_t nv = size_t(m.nv());
    T s, c;
    phs::sincos(T(2.0) * t, s, c);
    std::vector<T> q(x.begin(), x.end()), M(nv * nv), v(nv, T(0.0)), q_dot(size_t(m.nq()));
    q.push_back(T(0.5) + T(0.75) * s);
    q.push_back(T(-1.0) + T(0.75) * c);
    v[6] = T(1.5) * c;
    v[7] = T(-1.5) * s;
    mechanics::crba<T>(m, w, q, M);
    T A[6][7];
    for (size_t i = 0; i < 6; ++i) {
      for (size_t j = 0; j < 6; ++j) A[i][j] = M[i + nv * j];
      A[i][6] = -(M[i + nv * 6] * v[6] + M[i + nv * 7] * v[7]);
    }
    for (size_t k = 0; k < 6; ++k)  // Gauss-Jordan, M_bb is positive definite
      for (size_t i = 0; i < 6; ++i) {
        if (i == k) continue;
        const T f = A[i][k] / A[k][k];
        for (size_t j = k; j < 7; ++j) A[i][j] = A[i][j] - f * A[k][j];
      }
    for (size_t k = 0; k < 6; ++k) v[k] = A[k][6] / A[k][k];
    mechanics::coordinate_rates<T>(m, q, v, q_dot);
    for (size_t i = 0; i < 7; ++i) dx[i] = q_dot[i];
  }
};

TEST(Reference, PlanarHolonomy) {
  const auto file = test::read_json(test::data_file("reference/f_planar_holonomy.json"));
  const phs::UserModel<ZeroMomentumBase> model(ZeroMomentumBase{test::tree_mechanism(file)});
  const int steps_per_cycle = 64;
  const auto method = integrators::make_integrator("gauss16", model, M_PI / steps_per_cycle);
  phs::State s(model.description(), {0, 0, 0, 1, 0, 0, 0});
  const int cycles[] = {0, 1, 2, 10};
  double worst = 0;
  for (size_t k = 0; k < 4; ++k) {
    while (s.step < cycles[k] * steps_per_cycle)
      ASSERT_EQ(method->step(s), integrators::Outcome::ok);
    const auto row = test::numbers(file["outputs"][k]["group0"]);
    for (size_t i = 0; i < 7; ++i) worst = std::max(worst, std::fabs(s.x[i] - row[i]));
    const double angle = 2 * std::atan2(s.x[6], s.x[3]);
    const double holonomy =
        test::number(file["closed_form"]["base_rotation_per_cycle_rad"]) * cycles[k];
    worst = std::max(worst, std::fabs(angle - holonomy));
  }
  std::printf("  holonomy over 10 cycles: worst %.1e   bound 1e-13\n", worst);
  EXPECT_LE(worst, 1e-13);
  EXPECT_GT(std::fabs(2 * std::atan2(s.x[6], s.x[3])), 0.4) << "the base must have turned";
}

}  // namespace
}  // namespace porthos::holonomy_test
