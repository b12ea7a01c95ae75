#include "planning/detail/gauss_interval.h"

#include <cmath>

namespace porthos::planning::detail {

GaussInterval::GaussInterval(const Problem& problem,
                             const integrators::CollocationTable<double>& table, int number)
    : p_(problem),
      table_(table),
      s_(table.s),
      nx_(problem.dynamics->nx()),
      nu_(problem.dynamics->nu()),
      nw_(problem.per_interval()),
      point_(problem.cost, int(nx_)),
      hb_(size_t(s_)),
      t_(size_t(s_)),
      u_(size_t(s_ * nu_)),
      f_(size_t(s_ * nx_)),
      J_(size_t(s_ * nx_ * (nx_ + nu_))),
      H_(size_t(s_ * (nx_ + nu_) * (nx_ + nu_))),
      x_(nx_),
      w_(nw_),
      L_(Vector::Zero(s_ * nx_)),
      Y_(s_ * nx_),
      end_(nx_),
      gradient_(nx_ + nw_),
      residual_(s_ * nx_),
      sensitivity_(s_ * nx_, nx_ + nw_),
      A_(nx_, nx_),
      B_(nx_, nw_),
      dl_(nx_ + nu_, s_) {
  const auto& fastest = problem.limits.rate;
  for (size_t k = 0; k < fastest.size(); ++k)
    if (std::isfinite(fastest[k])) limited_.push_back(long(k));
  per_stage_ = long(limited_.size() + problem.limits.path.size());
  path_.resize(s_ * per_stage_);
  path_slopes_ = Matrix::Zero(path_.size(), nx_ + nu_);
  path_rows_.resize(path_.size(), nx_ + nw_);
  const double h = problem.step();
  table.weights(h, hb_);
  for (size_t i = 0; i < t_.size(); ++i) t_[i] = (number + table.c[i]) * h;
}

/// The inputs of the interval at its stages.
void GaussInterval::spread(const double* w) {
  for (long i = 0; i < s_; ++i)
    for (long a = 0; a < nu_; ++a)
      u_[size_t(i * nu_ + a)] = w[p_.inputs == Inputs::held ? a : i * nu_ + a];
}

/// Y = x + μ L
void GaussInterval::place(const Vector& L) {
  for (long i = 0; i < s_; ++i) {
    auto Y = Y_.segment(i * nx_, nx_);
    Y = x_;
    for (long j = 0; j < s_; ++j) Y += table_.mu[size_t(i * s_ + j)] * L.segment(j * nx_, nx_);
  }
}

/// M = 1 - h b Df μ at the stages Y.
void GaussInterval::factorise() {
  const long z = nx_ + nu_;
  p_.dynamics->jacobian(t_, {Y_.data(), size_t(Y_.size())}, u_, f_, J_);
  Matrix M = Matrix::Identity(s_ * nx_, s_ * nx_);
  for (long i = 0; i < s_; ++i) {
    const Eigen::Map<const Matrix> F(J_.data() + i * nx_ * z, nx_, nx_);
    for (long j = 0; j < s_; ++j)
      M.block(i * nx_, j * nx_, nx_, nx_) -= (hb_[size_t(i)] * table_.mu[size_t(i * s_ + j)]) * F;
  }
  lu_.compute(M);
  have_factor_ = true;
}

bool GaussInterval::solve(const double* x, const double* w) {
  const Eigen::Map<const Vector> to_x(x, nx_), to_w(w, nw_);
  const bool warm = have_factor_ && have_sensitivity_;
  if (warm)  // the first guess is the linearised one
    L_ += sensitivity_.leftCols(nx_) * (to_x - x_) + sensitivity_.rightCols(nw_) * (to_w - w_);
  x_ = to_x;
  w_ = to_w;
  spread(w);
  if (!(warm && iterate(false)) && !iterate(true)) return have_factor_ = have_sensitivity_ = false;
  end_ = x_;
  for (long i = 0; i < s_; ++i) end_ += L_.segment(i * nx_, nx_);
  cost_ = 0;
  for (long i = 0; i < s_; ++i)
    cost_ += hb_[size_t(i)] * point_.value(f_.data() + i * nx_, u_.data() + i * nu_);
  for (long i = 0, at = 0; i < s_; ++i) {
    for (const long k : limited_) path_[at++] = f_[size_t(i * nx_ + k)];
    for (const PathLimit& l : p_.limits.path)
      path_[at++] = l.number->value(t_[size_t(i)], state_at(i));
  }
  return end_.allFinite();
}

/// Newton with the factor of the last call while that converges fast, until rounding ends it.
/// afresh: from L = 0, with a new factor for every pass.
bool GaussInterval::iterate(bool afresh) {
  if (afresh) L_.setZero();
  double before = HUGE_VAL;
  for (int pass = 0; pass < 40; ++pass) {
    place(L_);
    p_.dynamics->field(t_, {Y_.data(), size_t(Y_.size())}, u_, f_);
    for (long i = 0; i < s_; ++i)
      residual_.segment(i * nx_, nx_) =
          hb_[size_t(i)] * Eigen::Map<const Vector>(f_.data() + i * nx_, nx_) -
          L_.segment(i * nx_, nx_);
    const double size = residual_.lpNorm<Eigen::Infinity>(),
                 scale = 1 + L_.lpNorm<Eigen::Infinity>() + x_.lpNorm<Eigen::Infinity>();
    if (!std::isfinite(size) || (!afresh && size > 1e3 * before)) return false;
    if (size == 0 || (size <= 1e-15 * scale && size > 0.25 * before)) return true;
    if (size > 1e-13 * scale && (afresh || size > 0.1 * before)) factorise();
    before = size;
    L_ += lu_.solve(residual_);
  }
  return false;
}

Vector GaussInterval::value(double theta) const {
  std::vector<double> B(static_cast<size_t>(s_));
  table_.polynomial(theta, B);
  Vector x = x_;
  for (long i = 0; i < s_; ++i) x += B[size_t(i)] * L_.segment(i * nx_, nx_);
  return x;
}

void GaussInterval::differentiate() {
  const long z = nx_ + nu_;
  factorise();
  sensitivity_.setZero();
  for (long i = 0; i < s_; ++i) {
    const Eigen::Map<const Matrix> J(J_.data() + i * nx_ * z, nx_, z);
    const double hb = hb_[size_t(i)];
    const long at = nx_ + (p_.inputs == Inputs::held ? 0 : i * nu_);
    sensitivity_.block(i * nx_, 0, nx_, nx_) = hb * J.leftCols(nx_);
    sensitivity_.block(i * nx_, at, nx_, nu_) = hb * J.rightCols(nu_);
  }
  sensitivity_ = lu_.solve(sensitivity_);
  have_sensitivity_ = true;
  A_.setIdentity();
  B_.setZero();
  for (long i = 0; i < s_; ++i) {
    A_ += sensitivity_.block(i * nx_, 0, nx_, nx_);
    B_ += sensitivity_.block(i * nx_, nx_, nx_, nw_);
  }
  gradient_.setZero();
  for (long i = 0; i < s_; ++i) {
    const Eigen::Map<const Matrix> J(J_.data() + i * nx_ * z, nx_, z);
    point_.gradient(f_.data() + i * nx_, J, u_.data() + i * nu_, dl_.col(i));
    const double hb = hb_[size_t(i)];
    const auto lx = dl_.col(i).head(nx_);
    const long at = nx_ + (p_.inputs == Inputs::held ? 0 : i * nu_);
    gradient_.head(nx_) += hb * lx;
    for (long j = 0; j < s_; ++j)
      gradient_ += hb * table_.mu[size_t(i * s_ + j)] *
                   (sensitivity_.middleRows(j * nx_, nx_).transpose() * lx);
    gradient_.segment(at, nu_) += hb * dl_.col(i).tail(nu_);
  }
  if (per_stage_ == 0) return;
  Matrix Z;
  std::vector<double> slope(static_cast<size_t>(nx_));
  for (long i = 0, row = 0; i < s_; ++i) {
    const Eigen::Map<const Matrix> J(J_.data() + i * nx_ * z, nx_, z);
    for (const long k : limited_) path_slopes_.row(row++) = J.row(k);
    for (const PathLimit& l : p_.limits.path) {
      l.number->gradient(t_[size_t(i)], state_at(i), slope);
      path_slopes_.row(row++).head(nx_) = Eigen::Map<const Vector>(slope.data(), nx_).transpose();
    }
    spread_moves(i, Z);
    path_rows_.middleRows(row - per_stage_, per_stage_) =
        path_slopes_.middleRows(row - per_stage_, per_stage_) * Z;
  }
}

/// Z = δ(Y_i, u_i) along (x, w)
void GaussInterval::spread_moves(long i, Matrix& Z) const {
  Z.setZero(nx_ + nu_, nx_ + nw_);
  Z.topLeftCorner(nx_, nx_).setIdentity();
  for (long j = 0; j < s_; ++j)
    Z.topRows(nx_) += table_.mu[size_t(i * s_ + j)] * sensitivity_.middleRows(j * nx_, nx_);
  Z.block(nx_, nx_ + (p_.inputs == Inputs::held ? 0 : i * nu_), nu_, nu_).setIdentity();
}

/// η of Mᵀ η = λ' + Σ μ_ij (h b_i ∂l_i + Σ weights ∂c)
Vector GaussInterval::adjoint_stages(const Vector& lambda, const double* weights) const {
  Vector eta(s_ * nx_);
  for (long j = 0; j < s_; ++j) {
    auto e = eta.segment(j * nx_, nx_);
    e = lambda;
    for (long i = 0; i < s_; ++i) {
      const double mu = table_.mu[size_t(i * s_ + j)];
      e += hb_[size_t(i)] * mu * dl_.col(i).head(nx_);
      for (long k = i * per_stage_; weights && k < (i + 1) * per_stage_; ++k)
        e += (mu * weights[k]) * path_slopes_.row(k).head(nx_).transpose();
    }
  }
  return lu_.transpose().solve(eta);
}

double GaussInterval::by_length(const Vector& lambda, const double* weights) const {
  const Vector eta = adjoint_stages(lambda, weights);
  double sum = 0;
  for (long i = 0; i < s_; ++i) {
    const Eigen::Map<const Vector> f(f_.data() + i * nx_, nx_);
    sum += hb_[size_t(i)] *
           (eta.segment(i * nx_, nx_).dot(f) + point_.value(f.data(), u_.data() + i * nu_));
  }
  return sum / p_.step();
}

/// weights ∇²c over h b of the numbers of the state, at each stage.
void GaussInterval::add_path_curvature(const double* weights, std::vector<Matrix>& own) {
  Matrix curvature(nx_, nx_);
  for (long i = 0; i < s_; ++i) {
    const double* w = weights + i * per_stage_ + long(limited_.size());
    for (const PathLimit& l : p_.limits.path) {
      const double weight = *w++ / hb_[size_t(i)];
      if (weight == 0) continue;
      l.number->hessian(t_[size_t(i)], state_at(i), {curvature.data(), size_t(curvature.size())});
      own[size_t(i)].topLeftCorner(nx_, nx_) += weight * curvature;
    }
  }
}

void GaussInterval::hessian(const Vector& lambda, bool exact, Matrix& H, const double* weights) {
  const long z = nx_ + nu_;
  Vector eta = adjoint_stages(lambda, weights);
  for (long i = 0; weights && i < s_; ++i)
    for (size_t k = 0; k < limited_.size(); ++k)
      eta[i * nx_ + limited_[k]] += weights[i * per_stage_ + long(k)] / hb_[size_t(i)];
  if (!exact) eta.setZero();
  std::vector<Matrix> own(size_t(s_), Matrix(z, z));
  for (long i = 0; i < s_; ++i) {
    const Eigen::Map<const Matrix> J(J_.data() + i * nx_ * z, nx_, z);
    point_.hessian(f_.data() + i * nx_, J, u_.data() + i * nu_, own[size_t(i)],
                   eta.data() + i * nx_);
  }
  if (exact)
    p_.dynamics->hessian(t_, {Y_.data(), size_t(Y_.size())}, u_, {eta.data(), size_t(eta.size())},
                         H_);
  if (exact && weights) add_path_curvature(weights, own);
  H.setZero(nx_ + nw_, nx_ + nw_);
  Matrix Z;
  for (long i = 0; i < s_; ++i) {
    Matrix& at_stage = own[size_t(i)];
    if (exact) at_stage += Eigen::Map<const Matrix>(H_.data() + i * z * z, z, z);
    spread_moves(i, Z);
    H.noalias() += hb_[size_t(i)] * (Z.transpose() * (at_stage * Z));
  }
}

}  // namespace porthos::planning::detail
