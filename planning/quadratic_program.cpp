#include "planning/quadratic_program.h"

#include <Eigen/Cholesky>
#include <Eigen/Householder>
#include <Eigen/Jacobi>
#include <algorithm>
#include <cmath>

#include "phs/error.h"

namespace porthos::planning {
namespace {

constexpr double eps_qp = 2.3e-16;

void check_program(const QuadraticProgram& p) {
  if (p.n < 1) throw InvalidArgument("a quadratic program needs at least one unknown");
  const auto n = size_t(p.n), m = p.c.size();
  require_size("G of a quadratic program", p.G.size(), n * n);
  require_size("a of a quadratic program", p.a.size(), n);
  require_size("C of a quadratic program", p.C.size(), m * n);
  if (p.equalities < 0 || p.equalities > p.rows())
    throw InvalidArgument("a quadratic program of " + std::to_string(m) + " rows cannot have " +
                          std::to_string(p.equalities) + " equalities");
  const auto finite = [](const std::vector<double>& v) {
    return std::all_of(v.begin(), v.end(), [](double x) { return std::isfinite(x); });
  };
  if (!finite(p.G) || !finite(p.a) || !finite(p.C) || !finite(p.c))
    throw InvalidArgument("a quadratic program has a number that is not finite");
}

}  // namespace

/// With G = L Lᵀ and the active rows N: J = L⁻ᵀ Q, Nᵀ J = [Rᵀ 0]. So Jᵀ G J = 1, the first k
/// columns of J belong to the active rows, and the others, J2, span the moves that keep them.
struct QpSolver::Work {
  using Matrix = Eigen::MatrixXd;
  using Vector = Eigen::VectorXd;
  using Rows = Eigen::Map<const Eigen::Matrix<double, -1, -1, Eigen::RowMajor>>;

  long n = 0, m = 0, k = 0;
  double reach = 0;     ///< largest |x| so far: what the rounding of steps is relative to
  long equalities = 0;  ///< rows of `active` that are equalities: the first ones
  Eigen::LLT<Matrix> llt;
  Matrix J, R;
  Vector x, u, y, d, z, r, e, slack, norm, essential, room;
  std::vector<int> active;
  std::vector<char> passed;  ///< rows that are active or follow from active ones
  QpSolution s;

  void resize(const QuadraticProgram& p) {
    n = p.n;
    m = p.rows();
    J.resize(n, n);
    R.resize(n, n);
    for (Vector* v : {&x, &y, &d, &z, &r, &e, &essential, &room}) v->resize(n);
    u.resize(n + 1);
    slack.resize(m);
    norm.resize(m);
    active.resize(size_t(n) + 1);
    passed.resize(size_t(m));
  }

  auto row(const QuadraticProgram& p, long i) const {
    return Eigen::Map<const Vector>(p.C.data() + i * n, n);
  }

  void factor(const QuadraticProgram& p) {
    llt.compute(Eigen::Map<const Matrix>(p.G.data(), n, n));
    if (llt.info() != Eigen::Success)
      throw InvalidArgument("G of a quadratic program is not positive definite");
    J.setIdentity();
    llt.matrixU().solveInPlace(J);
    k = 0;
  }

  /// d = Jᵀ n_p and r = R⁻¹ d1. Returns whether the row is independent of the active ones.
  bool look_at(const QuadraticProgram& p, long i) {
    d.noalias() = J.transpose() * row(p, i);
    r.head(k) = d.head(k);
    R.topLeftCorner(k, k).triangularView<Eigen::Upper>().solveInPlace(r.head(k));
    return k < n && d.tail(n - k).norm() > 1e3 * eps_qp * d.norm();
  }

  /// The row of look_at() becomes active.
  void add(long i) {
    double tau = 0, beta = 0;
    auto rest = essential.head(n - k - 1);
    d.tail(n - k).makeHouseholder(rest, tau, beta);
    J.rightCols(n - k).applyHouseholderOnTheRight(rest, tau, room.data());
    R.col(k).head(k) = d.head(k);
    R(k, k) = beta;
    active[size_t(k++)] = int(i);
    passed[size_t(i)] = 1;
  }

  void drop(long j) {
    passed[size_t(active[size_t(j)])] = 0;
    for (long i = j; i + 1 < k; ++i) {
      active[size_t(i)] = active[size_t(i) + 1];
      u[i] = u[i + 1];
      R.col(i).head(i + 2) = R.col(i + 1).head(i + 2);
    }
    u[k - 1] = u[k];  // of the row that is being added
    --k;
    for (long i = j; i < k; ++i) {
      Eigen::JacobiRotation<double> turn;
      turn.makeGivens(R(i, i), R(i + 1, i));
      R.middleCols(i, k - i).applyOnTheLeft(i, i + 1, turn.adjoint());
      J.applyOnTheRight(i, i + 1, turn);
    }
  }

  /// x and u of the active rows from the factors, with one refinement: no step's rounding stays.
  void settle(const QuadraticProgram& p) {
    const Eigen::Map<const Vector> a(p.a.data(), n);
    const Eigen::Map<const Matrix> G(p.G.data(), n, n);
    x.setZero();
    u.head(k).setZero();
    for (int pass = 0; pass < 2; ++pass) {
      e = -a;  // what is left of -(G x + a - N u)
      if (pass) e.noalias() -= G.selfadjointView<Eigen::Lower>() * x;
      for (long i = 0; i < k; ++i) {
        const auto normal = row(p, active[size_t(i)]);
        r[i] = p.c[size_t(active[size_t(i)])] - normal.dot(x);
        if (pass) e += u[i] * normal;
      }
      y.noalias() = J.transpose() * e;
      const auto Rk = R.topLeftCorner(k, k);
      Rk.transpose().triangularView<Eigen::Lower>().solveInPlace(r.head(k));
      z.head(k) = r.head(k) - y.head(k);
      Rk.triangularView<Eigen::Upper>().solveInPlace(z.head(k));
      u.head(k) += z.head(k);
      y.head(k) = r.head(k);
      x.noalias() += J * y;
    }
  }

  /// The rounding of row i at points of that size, in units of the row's length.
  double rounding(const QuadraticProgram& p, long i, double size) const {
    return double(n) * eps_qp * (size + std::fabs(p.c[size_t(i)]) / norm[i]);
  }

  QpSolution::Status contradiction(long i, double sign) {
    s.conflict.assign(1, int(i));
    s.conflict_weights.assign(1, sign);
    for (long j = 0; j < k; ++j)
      if (std::fabs(r[j]) > 1e-12 * (1 + r.head(k).lpNorm<Eigen::Infinity>())) {
        s.conflict.push_back(active[size_t(j)]);
        s.conflict_weights.push_back(-sign * r[j]);
      }
    return QpSolution::Status::infeasible;
  }

  bool begin(const QuadraticProgram& p, bool warm);
  QpSolution::Status iterate(const QuadraticProgram& p);
  QpSolution::Status bring_in(const QuadraticProgram& p, long i);
  void write(const QuadraticProgram& p);
};

/// The equalities, then the rows of a warm start whose multipliers have the right sign. false: the
/// equalities contradict each other.
bool QpSolver::Work::begin(const QuadraticProgram& p, bool warm) {
  std::fill(passed.begin(), passed.end(), 0);
  for (long i = 0; i < m; ++i) {
    norm[i] = row(p, i).norm();
    if (norm[i] == 0) norm[i] = 1;
  }
  for (long i = 0; i < p.equalities; ++i)
    if (look_at(p, i)) add(i);
  equalities = k;
  settle(p);
  reach = x.norm();
  for (long i = 0; i < p.equalities; ++i) {
    if (passed[size_t(i)]) continue;
    passed[size_t(i)] = 1;
    const double off = row(p, i).dot(x) - p.c[size_t(i)];
    if (std::fabs(off) / norm[i] <= 1e4 * rounding(p, i, x.norm())) continue;
    look_at(p, i);
    s.status = contradiction(i, off > 0 ? -1 : 1);
    return false;
  }
  if (!warm) return true;
  for (const int i : s.active)
    if (i >= p.equalities && look_at(p, i)) add(i);
  for (settle(p); k > equalities; settle(p)) {
    long worst = 0;
    if (u.segment(equalities, k - equalities).minCoeff(&worst) >= 0) break;
    drop(equalities + worst);
  }
  return true;
}

/// Adds the violated row i; on the way, rows whose multipliers reach zero are dropped.
QpSolution::Status QpSolver::Work::bring_in(const QuadraticProgram& p, long i) {
  u[k] = 0;
  for (long tries = 0; tries <= 2 * n + m; ++tries) {
    ++s.steps;
    const double off = row(p, i).dot(x) - p.c[size_t(i)];
    const bool independent = look_at(p, i);
    const double small = 1e2 * eps_qp * (k ? r.head(k).lpNorm<Eigen::Infinity>() : 0);
    double dual = HUGE_VAL;  // the step that brings a multiplier to zero
    long leaves = -1;
    for (long j = equalities; j < k; ++j)
      if (r[j] > small && std::max(u[j], 0.0) / r[j] < dual) {
        dual = std::max(u[j], 0.0) / r[j];
        leaves = j;
      }
    const double primal = independent ? -off / d.tail(n - k).squaredNorm() : HUGE_VAL;
    if (!independent && leaves < 0) {
      if (-off / norm[i] > 1e4 * rounding(p, i, reach)) return contradiction(i, 1);
      passed[size_t(i)] = 1;  // it follows from active rows, to rounding
      return QpSolution::Status::optimal;
    }
    const double t = std::min(primal, dual);
    if (independent) {
      z.noalias() = J.rightCols(n - k) * d.tail(n - k);
      x += t * z;
      reach = std::max(reach, x.norm());
    }
    u.head(k) -= t * r.head(k);
    u[k] += t;
    if (primal <= dual) {
      add(i);
      return QpSolution::Status::optimal;
    }
    drop(leaves);
  }
  return QpSolution::Status::too_many_steps;
}

QpSolution::Status QpSolver::Work::iterate(const QuadraticProgram& p) {
  const Rows C(p.C.data(), m, n);
  const Eigen::Map<const Vector> c(p.c.data(), m);
  bool settled = true;
  while (s.steps <= 10 * (n + m)) {
    slack.noalias() = C * x;
    slack -= c;
    long worst = -1;
    double least = 0;
    const double size = x.norm();
    for (long i = p.equalities; i < m; ++i) {
      const double scaled = slack[i] / norm[i];
      if (passed[size_t(i)] || scaled >= least || scaled >= -rounding(p, i, size)) continue;
      worst = i;
      least = scaled;
    }
    if (worst < 0) {
      if (settled) return QpSolution::Status::optimal;
      settle(p);
      settled = true;
      continue;
    }
    settled = false;
    const auto status = bring_in(p, worst);
    if (status != QpSolution::Status::optimal) return status;
  }
  return QpSolution::Status::too_many_steps;
}

void QpSolver::Work::write(const QuadraticProgram& p) {
  s.x.assign(x.data(), x.data() + n);
  s.multipliers.assign(size_t(m), 0.0);
  s.active.assign(active.begin(), active.begin() + k);
  for (long j = 0; j < k; ++j) s.multipliers[size_t(active[size_t(j)])] = u[j];
  const Eigen::Map<const Matrix> G(p.G.data(), n, n);
  e.noalias() = G.selfadjointView<Eigen::Lower>() * x;
  s.value = 0.5 * e.dot(x) + Eigen::Map<const Vector>(p.a.data(), n).dot(x);
}

QpSolver::QpSolver() : work_(std::make_unique<Work>()) {}
QpSolver::~QpSolver() = default;
QpSolver::QpSolver(QpSolver&&) noexcept = default;
QpSolver& QpSolver::operator=(QpSolver&&) noexcept = default;

const QpSolution& QpSolver::solve(const QuadraticProgram& program, Start start) {
  check_program(program);
  Work& w = *work_;
  const bool warm = start == Start::warm && w.n == program.n && w.m == program.rows();
  w.resize(program);
  w.s.steps = 0;
  w.s.conflict.clear();
  w.s.conflict_weights.clear();
  w.factor(program);
  if (w.begin(program, warm)) w.s.status = w.iterate(program);
  w.write(program);
  return w.s;
}

}  // namespace porthos::planning
