#include "planning/task_hierarchy.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "phs/error.h"
#include "planning/quadratic_program.h"

namespace porthos::planning {
namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;
using RowsMap = Eigen::Map<const Eigen::Matrix<double, -1, -1, Eigen::RowMajor>>;
using VectorMap = Eigen::Map<const Vector>;

/// Directions that move a level's task by less than this, relative to its rows, are left to the
/// levels below.
constexpr double rank_tolerance = 1e-10;
/// Weight of the proximal term, relative to the mean square of the rows. See Work::minimise.
constexpr double proximal = 1e-6;

void check_level(const TaskLevel& level, size_t n) {
  const std::string of = " of the level '" + level.name + "'";
  require_size(("A" + of).c_str(), level.A.size(), level.b.size() * n);
  require_size(("C" + of).c_str(), level.C.size(), level.c.size() * n);
  for (const auto* v : {&level.A, &level.b, &level.C, &level.c})
    if (!std::all_of(v->begin(), v->end(), [](double x) { return std::isfinite(x); }))
      throw InvalidArgument("a number" + of + " is not finite");
}

}  // namespace

double LevelOutcome::distance() const { return VectorMap(error.data(), long(error.size())).norm(); }

bool HierarchySolution::met() const {
  return std::all_of(levels.begin(), levels.end(), [](const auto& l) { return l.met; });
}

/// x + Z v: Z spans what the levels so far leave free. CZ = C Z of all their limits, and
/// room = c - C x.
struct TaskHierarchy::Work {
  long n = 0, free = 0, limits = 0;
  Vector x, room, length, kept, v, before, scratch, r, s;
  Matrix Z, CZ, AZ, L;
  Eigen::ColPivHouseholderQR<Matrix> qr;
  Eigen::HouseholderQR<Matrix> thin;
  QpSolver solver, relaxed_solver;
  QuadraticProgram qp, relaxed;
  HierarchySolution out;

  void solve_level(const TaskLevel& level, LevelOutcome& o);
  void add_limits(const TaskLevel& level);
  long turn_to_task(const TaskLevel& level);
  bool within_limits();
  bool minimise(long rank);
  bool relax(long fresh);
};

/// The level's limits join those above. Room above is never less than none: v = 0 keeps them.
void TaskHierarchy::Work::add_limits(const TaskLevel& level) {
  room.head(limits) = room.head(limits).cwiseMin(0.0);
  const long fresh = long(level.c.size());
  const RowsMap C(level.C.data(), fresh, n);
  room.segment(limits, fresh) = VectorMap(level.c.data(), fresh);
  room.segment(limits, fresh).noalias() -= C * x;
  length.segment(limits, fresh) = C.rowwise().norm();
  CZ.block(limits, 0, fresh, free).noalias() = C * Z.leftCols(free);
  limits += fresh;
}

/// Turns Z such that A Z = P [L 0]: the task sees the first `rank` directions only, as L s. Sets L,
/// and r, the task's wanted move in L's order of rows.
long TaskHierarchy::Work::turn_to_task(const TaskLevel& level) {
  const long tasks = long(level.b.size());
  if (tasks == 0 || free == 0) return 0;
  const RowsMap A(level.A.data(), tasks, n);
  AZ.noalias() = A * Z.leftCols(free);
  qr.compute(AZ.transpose());
  const double size = A.norm();
  long rank = 0;
  while (rank < std::min(tasks, free) &&
         std::fabs(qr.matrixQR()(rank, rank)) > rank_tolerance * size)
    ++rank;
  L = qr.matrixQR().topRows(rank).triangularView<Eigen::Upper>().transpose();  // tasks × rank
  r = VectorMap(level.b.data(), tasks);
  r.noalias() -= A * x;
  r = qr.colsPermutation().transpose() * r;
  const auto Q = qr.householderQ().setLength(rank);
  auto Zf = Z.leftCols(free);
  Zf.applyOnTheRight(Q);
  auto Cf = CZ.topLeftCorner(limits, free);
  Cf.applyOnTheRight(Q);
  for (long i = 0; i < limits; ++i)  // what is left of them is rounding: the levels above fix them
    if (Cf.row(i).norm() <= 1e-12 * length[i]) Cf.row(i).setZero();
  return rank;
}

bool TaskHierarchy::Work::within_limits() {
  kept.head(limits).noalias() = CZ.topLeftCorner(limits, free) * v;
  const double rounding = 1e-15 * double(n) * (v.norm() + x.norm());
  for (long i = 0; i < limits; ++i) {
    if (kept[i] - room[i] < -rounding * length[i]) return false;
  }
  return true;
}

/// min |L s - r|² over v = (s, t) within the limits. The task does not see t, so the program is
/// made strictly convex by δ |t - t_before|² and repeated until the task does not gain: its end is
/// a minimum of the task alone (proximal points, Rockafellar 1976). false: no v keeps the limits.
bool TaskHierarchy::Work::minimise(long rank) {
  qp.n = int(free);
  qp.equalities = 0;
  qp.G.assign(size_t(free * free), 0.0);
  qp.a.assign(size_t(free), 0.0);
  qp.C.resize(size_t(limits * free));
  Eigen::Map<Eigen::Matrix<double, -1, -1, Eigen::RowMajor>>(qp.C.data(), limits, free) =
      CZ.topLeftCorner(limits, free);
  qp.c.assign(room.data(), room.data() + limits);
  Eigen::Map<Matrix> G(qp.G.data(), free, free);
  Eigen::Map<Vector> a(qp.a.data(), free);
  double delta = 1;
  if (rank > 0) {
    delta = proximal * L.squaredNorm() / double(rank);
    G.topLeftCorner(rank, rank).noalias() = L.transpose() * L;
    a.head(rank).noalias() = -L.transpose() * r;
  }
  G.diagonal().tail(free - rank).setConstant(delta);
  v.setZero(free);
  for (int pass = 0; pass < 50; ++pass) {
    before = v;
    a.tail(free - rank) = -delta * before.tail(free - rank);
    const auto& best = solver.solve(qp, pass ? QpSolver::Start::warm : QpSolver::Start::cold);
    ++out.quadratic_programs;
    if (best.status != QpSolution::Status::optimal) return false;
    v = VectorMap(best.x.data(), free);
    if (rank == 0 || rank == free) break;
    scratch.noalias() = L * (v - before).head(rank);
    if (pass && scratch.norm() <= 1e-13 * (r.norm() + scratch.norm())) break;
  }
  return true;
}

/// min |w|² with the last `fresh` limits relaxed by w; then these limits have room for v.
bool TaskHierarchy::Work::relax(long fresh) {
  const long size = free + fresh;
  auto& p = relaxed;
  p.n = int(size);
  p.equalities = 0;
  p.G.assign(size_t(size * size), 0.0);
  p.a.assign(size_t(size), 0.0);
  p.C.assign(size_t(limits * size), 0.0);
  p.c.assign(room.data(), room.data() + limits);
  Eigen::Map<Matrix> G(p.G.data(), size, size);
  Eigen::Map<Vector> a(p.a.data(), size);
  Eigen::Map<Eigen::Matrix<double, -1, -1, Eigen::RowMajor>> C(p.C.data(), limits, size);
  const auto own = CZ.topLeftCorner(limits, free);
  const double delta =
      proximal * std::max(own.bottomRows(fresh).squaredNorm() / double(fresh), 1e-300);
  G.diagonal().head(free).setConstant(delta);
  G.diagonal().tail(fresh).setOnes();
  C.leftCols(free) = own;
  C.bottomRightCorner(fresh, fresh).setIdentity();
  Vector w = Vector::Zero(fresh), old(fresh);
  v.setZero(free);
  for (int pass = 0; pass < 50; ++pass) {
    old = w;
    a.head(free) = -delta * v;
    const auto& best =
        relaxed_solver.solve(p, pass ? QpSolver::Start::warm : QpSolver::Start::cold);
    ++out.quadratic_programs;
    if (best.status != QpSolution::Status::optimal) return false;
    v = VectorMap(best.x.data(), free);
    w = VectorMap(best.x.data() + free, fresh);
    if (pass && (w - old).norm() <= 1e-13 * w.norm()) break;
  }
  room.segment(limits - fresh, fresh) -= w.cwiseMax(0.0);
  return true;
}

void TaskHierarchy::Work::solve_level(const TaskLevel& level, LevelOutcome& o) {
  add_limits(level);
  const long rank = turn_to_task(level);
  o.freedoms = int(rank);
  o.solved = true;
  if (free == 0) return;
  v.setZero(free);
  if (rank == L.rows() && rank > 0) {
    s = r.head(rank);
    L.triangularView<Eigen::Lower>().solveInPlace(s);
    v.head(rank) = s;
  } else if (rank > 0) {
    thin.compute(L);
    v.head(rank) = thin.solve(r);
  }
  if (!within_limits() && !minimise(rank)) {
    const long fresh = long(level.c.size());
    o.solved = fresh > 0 && relax(fresh);
    if (!o.solved) {
      v.setZero(free);
    } else {
      const Vector relaxed_move = v;
      if (rank > 0 && !minimise(rank)) {
        v = relaxed_move;
        o.solved = false;
      }
    }
  }
  x.noalias() += Z.leftCols(free) * v;
  room.head(limits).noalias() -= CZ.topLeftCorner(limits, free) * v;
  const long left = free - rank;
  if (rank > 0) {  // from the left to the right: no column is read after it was written
    for (long j = 0; j < left; ++j) {
      Z.col(j) = Z.col(j + rank);
      CZ.col(j).head(limits) = CZ.col(j + rank).head(limits);
    }
  }
  free = left;
}

TaskHierarchy::TaskHierarchy(int n) : work_(std::make_unique<Work>()) {
  if (n < 1) throw InvalidArgument("a hierarchy of tasks needs at least one unknown");
  work_->n = n;
}
TaskHierarchy::~TaskHierarchy() = default;
TaskHierarchy::TaskHierarchy(TaskHierarchy&&) noexcept = default;
TaskHierarchy& TaskHierarchy::operator=(TaskHierarchy&&) noexcept = default;

const HierarchySolution& TaskHierarchy::solve(std::span<const TaskLevel> levels) {
  Work& w = *work_;
  const long n = w.n;
  long limits = 0;
  for (const auto& level : levels) {
    check_level(level, size_t(n));
    limits += long(level.c.size());
  }
  w.x.setZero(n);
  w.Z.setIdentity(n, n);
  w.room.setZero(limits);
  w.length.setZero(limits);
  w.kept.resize(limits);
  w.CZ.resize(limits, n);
  w.free = n;
  w.limits = 0;
  w.out.quadratic_programs = 0;
  w.out.levels.resize(levels.size());
  for (size_t k = 0; k < levels.size(); ++k) w.solve_level(levels[k], w.out.levels[k]);
  w.out.x.assign(w.x.data(), w.x.data() + n);
  for (size_t k = 0; k < levels.size(); ++k) {
    w.out.levels[k].name = levels[k].name;
    judge(levels[k], w.out.x, w.out.levels[k]);
  }
  return w.out;
}

void judge(const TaskLevel& level, std::span<const double> at, LevelOutcome& o) {
  const VectorMap x(at.data(), long(at.size()));
  const double size = x.norm();
  o.met = o.solved;
  const auto rows = [&](const std::vector<double>& A, const std::vector<double>& b,
                        std::vector<double>& to, auto value) {
    to.resize(b.size());
    for (size_t i = 0; i < b.size(); ++i) {
      const VectorMap row(A.data() + i * at.size(), x.size());
      to[i] = value(row.dot(x), b[i]);
      o.met = o.met && std::fabs(to[i]) <= 1e-9 * (row.norm() * size + std::fabs(b[i]));
    }
  };
  rows(level.A, level.b, o.error, [](double ax, double b) { return ax - b; });
  rows(level.C, level.c, o.short_of, [](double cx, double c) { return std::max(0.0, c - cx); });
}

}  // namespace porthos::planning
