#pragma once
#include <memory>

#include "integrators/core/integrator.h"
#include "integrators/implicit/step_solver.h"
#include "integrators/tables/collocation_table.h"

namespace porthos::integrators {

/// x (written, size n) at the fraction θ of the step that ended in `after`, on the polynomial of
/// its increments. at(k, j): increment j of the k-th number
template <int most_stages, class T, class State, class At>
void interpolate_step(const CollocationTable<TableReal<T>>& table, const State& after, T theta,
                      const At& at, std::span<T> x) {
  using Real = TableReal<T>;
  Real B[most_stages];
  table.polynomial(table_real(theta), std::span<Real>(B, size_t(table.s)));
  for (size_t k = 0; k < x.size(); ++k) {
    T back(0.0);  // from the end of the step, where increments carry weight 1
    for (int j = 0; j < table.s; ++j) back += T(Real(1) - B[j]) * at(k, j);
    x[k] = after.x[k] + (after.lo[k] - back);
  }
}

/// The step of every method that a CollocationTable describes: Gauss, HBVM, Lobatto pairs. It
/// evaluates all stages at once as SIMD lanes, and iterates to stagnation from the extrapolated
/// polynomial of the last step. The state is compensated. A table with mu_p requires a canonical
/// system.
template <class T>
std::unique_ptr<BasicIntegrator<T>> make_collocation(const Declaration& declaration,
                                                     CollocationTable<TableReal<T>> table,
                                                     const phs::Model& model, T h,
                                                     const Options& options);

/// Sets up Newton's iteration for the table, if it has one. @return whether it has
template <class Real>
bool offer_newton(StepSolver& solver, const CollocationTable<Real>& t, const phs::Model& model,
                  const Options& o) {
  if (o.solver == Solver::fixed_point || t.degree() > 8 || !t.mu_p.empty()) return false;
  const size_t s = size_t(t.s);
  std::vector<double> A(s * s);  // of L = h b f(x + μ L)
  for (size_t i = 0; i < s; ++i)
    for (size_t j = 0; j < s; ++j)
      A[i * s + j] = phs::to_double(t.b[i]) * phs::to_double(t.mu[i * s + j]);
  solver.set_newton(std::make_unique<SimplifiedNewton>(model, A, o.solver));
  return true;
}

}  // namespace porthos::integrators
