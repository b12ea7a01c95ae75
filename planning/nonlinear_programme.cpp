#include "planning/nonlinear_programme.h"

#include <algorithm>

#include "planning/detail/newton_iteration.h"

namespace porthos::planning {

struct NonlinearProgramme::Work {
  const Problem& problem;
  detail::Shooting shooting;
  Bounds unknowns, rows;
  Pattern jacobian, hessian;
  detail::Vector z, lambda, cost_hessian;
  bool solved = false, differentiated = false;

  explicit Work(const Problem& p) : problem(p), shooting(p) {
    set_bounds();
    set_jacobian();
    set_hessian();
  }
  long steps() const { return shooting.N() * shooting.nx(); }
  long goals() const { return shooting.goals.size(); }
  long per_interval() const { return shooting.path() / shooting.N(); }

  void set_bounds() {
    detail::Vector low, high;
    shooting.limits(low, high);
    const long n = shooting.unknowns(), equations = steps() + goals();
    for (long i = 0; i < shooting.nx(); ++i) low[i] = high[i] = problem.start[size_t(i)];
    unknowns = {{low.begin(), low.begin() + n}, {high.begin(), high.begin() + n}};
    rows.lower.assign(size_t(equations), 0.0);
    rows.upper = rows.lower;
    rows.lower.insert(rows.lower.end(), low.begin() + n, low.end());
    rows.upper.insert(rows.upper.end(), high.begin() + n, high.end());
  }

  /// A full block of a row, at `columns` columns from `at` on.
  void add_row(long row, long at, long columns) {
    for (long c = 0; c < columns; ++c) {
      jacobian.row.push_back(int(row));
      jacobian.column.push_back(int(at + c));
    }
  }
  /// In the order in which jacobian() writes.
  void set_jacobian() {
    const long nx = shooting.nx(), nw = shooting.nw(), N = shooting.N();
    const auto add_block = [&](long row, long k) {
      add_row(row, shooting.at_x(k), nx);
      add_row(row, shooting.at_w(k), nw);
    };
    for (long k = 0; k < N; ++k)
      for (long i = 0; i < nx; ++i) {
        add_block(k * nx + i, k);
        add_row(k * nx + i, shooting.at_x(k + 1) + i, 1);
      }
    for (long i = 0; i < goals(); ++i) add_row(steps() + i, shooting.at_x(N), nx);
    for (long k = 0, row = steps() + goals(); k < N; ++k)
      for (long i = 0; i < per_interval(); ++i) add_block(row++, k);
  }
  /// The lower triangles of the blocks of (x_k, w_k), then that of x_N.
  void set_hessian() {
    const long nx = shooting.nx(), z_block = nx + shooting.nw(), N = shooting.N();
    const auto place = [&](long k, long i) {
      return int(i < nx ? shooting.at_x(k) + i : shooting.at_w(k) + i - nx);
    };
    for (long k = 0; k <= N; ++k)
      for (long i = 0; i < (k < N ? z_block : nx); ++i)
        for (long j = 0; j <= i; ++j) {
          hessian.row.push_back(place(k, i));
          hessian.column.push_back(place(k, j));
        }
  }

  void differentiate() {
    if (!differentiated) shooting.differentiate();
    differentiated = true;
  }
  /// ∇²(J + multipliersᵀ c); null: all 0. @return the end of what was written
  double* curve(const double* multipliers, double factor, double* to) {
    const long nx = shooting.nx(), N = shooting.N();
    lambda.setZero((N + 1) * nx);
    detail::Vector nu = detail::Vector::Zero(goals()),
                   weights = detail::Vector::Zero(shooting.path());
    if (multipliers) {
      lambda.tail(steps()) = factor * Eigen::Map<const detail::Vector>(multipliers, steps());
      nu = factor * Eigen::Map<const detail::Vector>(multipliers + steps(), goals());
      weights = factor *
                Eigen::Map<const detail::Vector>(multipliers + steps() + goals(), weights.size());
    }
    shooting.curve(lambda, nu, true, weights.data());
    for (long k = 0; k <= N; ++k) {
      const detail::Matrix& H = k < N ? shooting.qp.stages[size_t(k)].H : shooting.qp.last_H;
      for (long i = 0; i < H.rows(); ++i)
        for (long j = 0; j <= i; ++j) *to++ = H(i, j);
    }
    return to;
  }
};

NonlinearProgramme::NonlinearProgramme(const Problem& problem) {
  problem.check();
  w_ = std::make_unique<Work>(problem);
}
NonlinearProgramme::~NonlinearProgramme() = default;

const NonlinearProgramme::Bounds& NonlinearProgramme::unknowns() const { return w_->unknowns; }
const NonlinearProgramme::Bounds& NonlinearProgramme::rows() const { return w_->rows; }
const NonlinearProgramme::Pattern& NonlinearProgramme::jacobian_pattern() const {
  return w_->jacobian;
}
const NonlinearProgramme::Pattern& NonlinearProgramme::hessian_pattern() const {
  return w_->hessian;
}

bool NonlinearProgramme::go_to(In z) {
  const Eigen::Map<const detail::Vector> there(z.data(), long(z.size()));
  if (w_->solved && w_->z == there) return true;
  w_->z = there;
  w_->differentiated = false;
  return w_->solved = w_->shooting.evaluate(w_->z);
}

double NonlinearProgramme::cost() const { return w_->shooting.cost; }

void NonlinearProgramme::values(Out c) const {
  const auto& s = w_->shooting;
  double* to = std::copy(s.defects.begin(), s.defects.end(), c.data());
  s.copy_path(std::copy(s.goals.begin(), s.goals.end(), to));
}

void NonlinearProgramme::gradient(Out g) {
  w_->differentiate();
  const auto& s = w_->shooting;
  const long nx = s.nx(), nw = s.nw();
  Eigen::Map<detail::Vector> to(g.data(), long(g.size()));
  to.setZero();
  for (long k = 0; k < s.N(); ++k) {
    const detail::Vector& own = s.qp.stages[size_t(k)].g;
    to.segment(s.at_x(k), nx) = own.head(nx);
    to.segment(s.at_w(k), nw) = own.tail(nw);
  }
}

void NonlinearProgramme::jacobian(Out numbers) {
  w_->differentiate();
  const auto& s = w_->shooting;
  double* to = numbers.data();
  const auto put = [&](const detail::Matrix& block, long row) {
    for (long c = 0; c < block.cols(); ++c) *to++ = block(row, c);
  };
  for (const auto& stage : s.qp.stages)
    for (long i = 0; i < s.nx(); ++i) {
      put(stage.A, i);
      put(stage.B, i);
      *to++ = -1;
    }
  for (long i = 0; i < s.qp.C.rows(); ++i) put(s.qp.C, i);
  for (long k = 0; k < s.N(); ++k)
    for (long i = 0; i < w_->per_interval(); ++i) put(s.path_rows(k), i);
}

void NonlinearProgramme::hessian(double cost_factor, In multipliers, Out numbers) {
  w_->differentiate();
  Eigen::Map<detail::Vector> H(numbers.data(), long(numbers.size()));
  if (cost_factor == 0) {  // as a difference: the cost is a part of the steps' own
    w_->curve(multipliers.data(), 1, numbers.data());
    w_->cost_hessian.resize(H.size());
    w_->curve(nullptr, 1, w_->cost_hessian.data());
    H -= w_->cost_hessian;
  } else {
    w_->curve(multipliers.data(), 1 / cost_factor, numbers.data());
    H *= cost_factor;
  }
}

Plan NonlinearProgramme::plan(In z, In multipliers, In lower, In upper) const {
  const auto vector = [](In list) {
    return detail::Vector(Eigen::Map<const detail::Vector>(list.data(), long(list.size())));
  };
  const auto& s = w_->shooting;
  const PlannerOptions options;
  const Trajectory motion{{z.begin(), z.begin() + s.at_w(0)}, {z.begin() + s.at_w(0), z.end()}};
  const detail::Vector of_rows = vector(multipliers), path = of_rows.tail(s.path());
  detail::NewtonIteration judge(w_->problem, motion, options);
  return judge.judge(vector(z), of_rows.head(w_->steps()),
                     of_rows.segment(w_->steps(), w_->goals()),
                     detail::NewtonIteration::joined(vector(lower), (-path).cwiseMax(0)),
                     detail::NewtonIteration::joined(vector(upper), path.cwiseMax(0)));
}

}  // namespace porthos::planning
