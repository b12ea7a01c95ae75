#pragma once
#include "mechanics/crba.h"
#include "mechanics/mechanical_model.h"
#include "phs/linear_algebra/linear_algebra.h"
#include "planning/planner.h"

namespace porthos::test {

/// A free base without momentum under joint rates: x = q, u = rates of the joints, and the base's
/// twist is -M_bb⁻¹ M_bm u. For following inputs: its derivative is by differences.
class KinematicBase final : public planning::Dynamics {
 public:
  explicit KinematicBase(std::shared_ptr<const mechanics::MechanicalModel> model)
      : Dynamics(model->mechanism().nq(), model->mechanism().nv() - 6),
        model_(std::move(model)),
        system_(model_->instantiate<double>()),
        work_(model_->mechanism()) {}

  void field(In t, In x, In u, Out f) override {
    const size_t n = size_t(nx()), m = size_t(nu()), nv = m + 6;
    std::vector<double> M(nv * nv), bb(36), right(6), v(nv), dx(2 * n);
    for (size_t p = 0; p < t.size(); ++p) {
      mechanics::crba<double>(model_->mechanism(), work_, x.subspan(p * n, n), M);
      for (size_t i = 0; i < 6; ++i) {
        right[i] = 0;
        for (size_t j = 0; j < 6; ++j) bb[i * 6 + j] = M[i * nv + j];
        for (size_t j = 0; j < m; ++j) right[i] -= M[i * nv + 6 + j] * u[p * m + j];
      }
      const auto twist = phs::linear_solve(6, bb, right);
      std::copy(twist.begin(), twist.end(), v.begin());
      for (size_t j = 0; j < m; ++j) v[6 + j] = u[p * m + j];
      system_->field(0.0, model_->state(x.subspan(p * n, n), v), {}, dx);
      std::copy_n(dx.begin(), n, f.begin() + long(p * n));
    }
  }
  void jacobian(In t, In x, In u, Out f, Out J) override {
    const size_t n = size_t(nx()), m = size_t(nu());
    field(t, x, u, f);
    std::vector<double> z(n + m), a(n), b(n);
    for (size_t p = 0; p < t.size(); ++p)
      for (size_t k = 0; k < n + m; ++k) {
        std::copy_n(x.begin() + long(p * n), n, z.begin());
        std::copy_n(u.begin() + long(p * m), m, z.begin() + long(n));
        const auto at = [&](double e, std::vector<double>& to) {
          const double was = z[k];
          z[k] += e;
          field(t.subspan(p, 1), In(z).first(n), In(z).subspan(n), to);
          z[k] = was;
        };
        at(1e-6, a);
        at(-1e-6, b);
        for (size_t i = 0; i < n; ++i) J[(p * (n + m) + k) * n + i] = (a[i] - b[i]) / 2e-6;
      }
  }
  void hessian(In, In, In, In, Out) override {
    throw InvalidArgument("a kinematic base has no second derivatives");
  }

 private:
  std::shared_ptr<const mechanics::MechanicalModel> model_;
  std::unique_ptr<phs::System<double>> system_;
  mechanics::Workspace<double> work_;
};

}  // namespace porthos::test
