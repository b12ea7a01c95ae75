#include "integrators/claims.h"

#include <algorithm>
#include <cmath>

#include "phs/linear_algebra/linear_algebra.h"
#include "phs/system/constraints.h"

namespace porthos::integrators {
namespace {

using Directions = std::vector<std::vector<double>>;

double dot_J(const std::vector<double>& a, const std::vector<double>& b) {
  const size_t n = a.size() / 2;
  double sum = 0;
  for (size_t k = 0; k < n; ++k) sum += a[k] * b[n + k] - a[n + k] * b[k];
  return sum;
}

/// Those of given directions that keep g = 0 and Bᵀe = 0 to first order: their projections.
Directions along_constraints(const phs::Model& model, const std::vector<double>& at,
                             const Directions& basis) {
  const auto system = model.instantiate<phs::Dual>();
  const auto rows = system->constraints();
  if (!rows) return basis;
  const size_t m = size_t(rows->count()), n = basis.size();
  phs::Matrix C(2 * rows->count(), int(n));
  for (size_t j = 0; j < n; ++j) {
    std::vector<phs::Dual> x(at.begin(), at.end()), g(m), rate(m), e(at.size());
    for (size_t i = 0; i < x.size(); ++i) x[i].d = basis[j][i];
    rows->place(x, g);
    system->gradient(x, e);
    rows->rates(e, rate);
    for (size_t r = 0; r < m; ++r) {
      C(int(r), int(j)) = g[r].d;
      C(int(m + r), int(j)) = rate[r].d;
    }
  }
  const phs::Matrix P = phs::pseudo_inverse(C).inverse * C;
  Directions along;
  for (size_t j = 0; j < n; ++j) {
    std::vector<double> u = basis[j];
    for (size_t l = 0; l < n; ++l)
      for (size_t i = 0; i < u.size(); ++i) u[i] -= P(int(l), int(j)) * basis[l][i];
    along.push_back(std::move(u));
  }
  return along;
}

}  // namespace

double symplectic_defect(const Directions& tangents, const Directions& images) {
  const auto norm = [](const std::vector<double>& a) {
    double sum = 0;
    for (const double x : a) sum += x * x;
    return std::sqrt(sum);
  };
  double worst = 0;
  for (size_t i = 0; i < images.size(); ++i)
    for (size_t j = 0; j < i; ++j) {
      const double d = dot_J(images[i], images[j]) - dot_J(tangents[i], tangents[j]);
      const double relative = std::fabs(d) / std::max(1.0, norm(images[i]) * norm(images[j]));
      worst = !(relative <= worst) ? relative : worst;
    }
  return worst;
}

Directions tangents(const phs::Model& model, const std::vector<double>& x) {
  Directions basis;
  const auto fresh = [&]() -> std::vector<double>& {
    basis.emplace_back(x.size(), 0.0);
    return basis.back();
  };
  // ξ ∘ e_k, with e_k = i, j, k
  const auto times_unit = [](const double* a, int k, double* out) {
    const double w = a[0], i = a[1], j = a[2], l = a[3];
    const double table[3][4] = {{-i, w, l, -j}, {-j, -l, w, i}, {-l, j, -i, w}};
    std::copy(table[k], table[k] + 4, out);
  };
  for (const auto& b : model.description().blocks) {
    const size_t q = size_t(b.at), m = size_t(b.momentum), n = size_t(b.size);
    if (b.kind == phs::BlockKind::rotation) {
      for (int k = 0; k < 3; ++k) {
        auto& turn = fresh();
        times_unit(&x[q], k, &turn[q]);
        times_unit(&x[m], k, &turn[m]);
        times_unit(&x[q], k, &fresh()[m]);
      }
    } else {
      for (size_t i = 0; i < n; ++i) {
        fresh()[q + i] = 1;
        fresh()[m + i] = 1;
      }
    }
  }
  return along_constraints(model, x, basis);
}

}  // namespace porthos::integrators
