#include "planning/detail/shooting.h"

#include <tuple>

namespace porthos::planning::detail {

Shooting::Shooting(const Problem& p)
    : defects(p.intervals * p.dynamics->nx()),
      goals(long(p.goals.size())),
      p_(p),
      nx_(p.dynamics->nx()),
      nw_(p.per_interval()),
      N_(p.intervals),
      f_(size_t(nx_)),
      none_(size_t(p.dynamics->nu()), 0.0) {
  const size_t z = size_t(nx_) + none_.size();
  J_.resize(size_t(nx_) * z);
  H_.resize(z * z);
  nu_x_.resize(size_t(nx_));
  table_ = std::make_shared<const integrators::CollocationTable<double>>(
      integrators::gauss_table<double>(p.stages));
  intervals_.reserve(size_t(N_));
  for (int k = 0; k < p.intervals; ++k) intervals_.emplace_back(p, *table_, k);
  qp.stages.resize(size_t(N_));
  qp.last_H = Matrix::Zero(nx_, nx_);
  qp.last_g = Vector::Zero(nx_);
  qp.C = Matrix::Zero(goals.size(), nx_);
  qp.c = Vector::Zero(goals.size());
}

bool Shooting::evaluate(const Vector& v) {
  cost = 0;
  for (long k = 0; k < N_; ++k) {
    auto& interval = intervals_[size_t(k)];
    if (!interval.solve(v.data() + at_x(k), v.data() + at_w(k))) return false;
    cost += interval.cost();
    defects.segment(k * nx_, nx_) = interval.end() - v.segment(at_x(k + 1), nx_);
  }
  evaluate_goals(v.data() + at_x(N_));
  return std::isfinite(cost) && defects.allFinite() && goals.allFinite();
}

bool Shooting::follow(const Vector& v, const Vector& move, double alpha, const RiccatiQp& sweep,
                      Vector& trial) {
  cost = 0;
  trial = v + alpha * move;
  for (long k = 0; k < N_; ++k) {
    auto& interval = intervals_[size_t(k)];
    const auto x = trial.segment(at_x(k), nx_);
    const Vector strayed = x - v.segment(at_x(k), nx_) - alpha * move.segment(at_x(k), nx_);
    trial.segment(at_w(k), nw_) += sweep.feedback(size_t(k)) * strayed;
    if (!interval.solve(trial.data() + at_x(k), trial.data() + at_w(k))) return false;
    cost += interval.cost();
    defects.segment(k * nx_, nx_) = (1 - alpha) * qp.stages[size_t(k)].d;
    trial.segment(at_x(k + 1), nx_) = interval.end() - defects.segment(k * nx_, nx_);
  }
  evaluate_goals(trial.data() + at_x(N_));
  return std::isfinite(cost) && goals.allFinite();
}

bool Shooting::roll(Vector& v) {
  for (long k = 0; k < N_; ++k) {
    auto& interval = intervals_[size_t(k)];
    if (!interval.solve(v.data() + at_x(k), v.data() + at_w(k))) return false;
    v.segment(at_x(k + 1), nx_) = interval.end();
  }
  return evaluate(v);
}

void Shooting::evaluate_goals(const double* x) {
  last_.assign(x, x + nx_);
  const double t = p_.duration;
  bool rates = false;
  for (const Goal& g : p_.goals) rates = rates || g.rate >= 0;
  if (rates) p_.dynamics->field({&t, 1}, last_, none_, f_);
  for (size_t i = 0; i < p_.goals.size(); ++i) {
    const Goal& g = p_.goals[i];
    double value = g.rate >= 0 ? f_[size_t(g.rate)] : g.number ? g.number->value(t, last_) : 0;
    for (const auto& [k, factor] : g.row) value += factor * x[k];
    goals[long(i)] = value - g.value;
  }
}

double Shooting::largest_defect() const {
  return std::max(defects.lpNorm<Eigen::Infinity>(),
                  goals.size() > 0 ? goals.lpNorm<Eigen::Infinity>() : 0.0);
}

void Shooting::differentiate() {
  for (long k = 0; k < N_; ++k) {
    auto& interval = intervals_[size_t(k)];
    interval.differentiate();
    auto& s = qp.stages[size_t(k)];
    s.A = interval.A();
    s.B = interval.B();
  }
  renew_slopes();
  set_equations(defects, goals);
  const double t = p_.duration;
  qp.C.setZero();
  bool have = false;
  for (size_t i = 0; i < p_.goals.size(); ++i) {
    const Goal& g = p_.goals[i];
    for (const auto& [k, factor] : g.row) qp.C(long(i), k) += factor;
    if (g.number) {
      g.number->gradient(t, last_, nu_x_);
      qp.C.row(long(i)) = Eigen::Map<const Vector>(nu_x_.data(), nx_).transpose();
    }
    if (g.rate < 0) continue;
    if (!have) p_.dynamics->jacobian({&t, 1}, last_, none_, f_, J_);
    have = true;
    qp.C.row(long(i)) = Eigen::Map<const Matrix>(J_.data(), nx_, nx_).row(g.rate);
  }
}

void Shooting::renew_slopes() {
  for (long k = 0; k < N_; ++k) qp.stages[size_t(k)].g = intervals_[size_t(k)].gradient();
  qp.last_g.setZero();
}

void Shooting::set_equations(const Vector& d, const Vector& c) {
  for (long k = 0; k < N_; ++k) qp.stages[size_t(k)].d = d.segment(k * nx_, nx_);
  qp.c = c;
}

void Shooting::copy_path(double* to) const {
  for (const auto& interval : intervals_)
    to = std::copy(interval.path().begin(), interval.path().end(), to);
}

void Shooting::path_along(const Vector& dv, double* to) const {
  for (long k = 0; k < N_; ++k) {
    const Matrix& rows = intervals_[size_t(k)].path_rows();
    Eigen::Map<Vector>(to + k * rows.rows(), rows.rows()) =
        rows.leftCols(nx_) * dv.segment(at_x(k), nx_) +
        rows.rightCols(nw_) * dv.segment(at_w(k), nw_);
  }
}

void Shooting::limits(Vector& low, Vector& high) const {
  const long n = unknowns();
  low = Vector::Constant(n + path(), -no_limit);
  high = Vector::Constant(n + path(), no_limit);
  std::vector<bool> fixed(size_t(nx_), false);  // by a goal, at the end
  for (const Goal& g : p_.goals)
    for (const auto& [k, factor] : g.row) fixed[size_t(k)] = true;
  const auto set = [&](const std::vector<double>& list, Vector& to, long at, bool last) {
    for (size_t i = 0; i < list.size(); ++i)
      if (!last || !fixed[i]) to[at + long(i)] = list[i];
  };
  for (long k = 1; k <= N_; ++k) {
    set(p_.limits.state_lower, low, at_x(k), k == N_);
    set(p_.limits.state_upper, high, at_x(k), k == N_);
  }
  for (long at = at_w(0); at < n; at += p_.dynamics->nu()) {
    set(p_.limits.input_lower, low, at, false);
    set(p_.limits.input_upper, high, at, false);
  }
  std::vector<std::pair<double, double>> at_stage;
  for (const double r : p_.limits.rate)
    if (std::isfinite(r)) at_stage.emplace_back(-r, r);
  for (const PathLimit& l : p_.limits.path) at_stage.emplace_back(l.lower, l.upper);
  for (long i = n; i < low.size(); ++i)
    std::tie(low[i], high[i]) = at_stage[size_t(i - n) % at_stage.size()];
}

void Shooting::add_path(const double* weights, Vector& gradient) const {
  for (long k = 0; k < N_; ++k) {
    const Matrix& rows = intervals_[size_t(k)].path_rows();
    const Eigen::Map<const Vector> w(weights + k * rows.rows(), rows.rows());
    if (k > 0) gradient.segment(at_x(k), nx_) += rows.leftCols(nx_).transpose() * w;
    gradient.segment(at_w(k), nw_) += rows.rightCols(nw_).transpose() * w;
  }
}

void Shooting::add_to_programme(long i, double sigma, double slope) {
  const long per = intervals_.front().path().size();
  const auto row = intervals_[size_t(i / per)].path_rows().row(i % per);
  auto& s = qp.stages[size_t(i / per)];
  s.H += sigma * row.transpose() * row;
  s.g += slope * row.transpose();
}

void Shooting::curve(const Vector& lambda, const Vector& nu, bool exact, const double* weights) {
  const long per = intervals_.front().path().size();
  for (long k = 0; k < N_; ++k)
    intervals_[size_t(k)].hessian(lambda.segment((k + 1) * nx_, nx_), exact, qp.stages[size_t(k)].H,
                                  weights ? weights + k * per : nullptr);
  qp.last_H.setZero();
  std::fill(nu_x_.begin(), nu_x_.end(), 0.0);
  bool curved = false;
  for (size_t i = 0; i < p_.goals.size(); ++i)
    if (p_.goals[i].rate >= 0) {
      nu_x_[size_t(p_.goals[i].rate)] += nu[long(i)];
      curved = true;
    }
  if (!exact) return;
  const double t = p_.duration;
  if (curved) {
    p_.dynamics->hessian({&t, 1}, last_, none_, nu_x_, H_);
    const long z = nx_ + long(none_.size());
    qp.last_H = Eigen::Map<const Matrix>(H_.data(), z, z).topLeftCorner(nx_, nx_);
  }
  for (size_t i = 0; i < p_.goals.size(); ++i) {
    if (!p_.goals[i].number) continue;
    p_.goals[i].number->hessian(t, last_, H_);
    qp.last_H += nu[long(i)] * Eigen::Map<const Matrix>(H_.data(), nx_, nx_);
  }
}

void Shooting::slope(const Vector& lambda, const Vector& nu, Vector& gradient) const {
  gradient.setZero(unknowns());
  for (long k = 0; k < N_; ++k) {
    const auto& s = qp.stages[size_t(k)];
    const auto next = lambda.segment((k + 1) * nx_, nx_);
    if (k > 0)
      gradient.segment(at_x(k), nx_) =
          s.g.head(nx_) + s.A.transpose() * next - lambda.segment(k * nx_, nx_);
    gradient.segment(at_w(k), nw_) = s.g.tail(nw_) + s.B.transpose() * next;
  }
  gradient.segment(at_x(N_), nx_) = qp.C.transpose() * nu - lambda.segment(N_ * nx_, nx_);
}

double Shooting::by_duration(const Vector& lambda, const double* weights) const {
  double sum = 0;
  const long per = intervals_.front().path().size();
  for (long k = 0; k < N_; ++k)
    sum += intervals_[size_t(k)].by_length(lambda.segment((k + 1) * nx_, nx_), weights + k * per);
  return sum / double(N_);
}

Vector Shooting::at_start(const Vector& lambda) const {
  const auto& s = qp.stages.front();
  return s.g.head(nx_) + s.A.transpose() * lambda.segment(nx_, nx_);
}

}  // namespace porthos::planning::detail
