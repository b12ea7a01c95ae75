#include "planning/detail/riccati_qp.h"

#include <Eigen/Eigenvalues>

namespace porthos::planning::detail {

RiccatiQp::Result RiccatiQp::solve(const QuadraticProgramme& qp, double regularisation, double rho,
                                   bool any) {
  const size_t N = qp.stages.size();
  gains_.resize(N);
  P_.resize(N + 1);
  p_.resize(N + 1);
  Gamma_.resize(N + 1);
  P_[N] = qp.last_H + rho * qp.C.transpose() * qp.C;
  p_[N] = qp.last_g + rho * qp.C.transpose() * qp.c;
  Gamma_[N] = qp.C.transpose();
  W_ = Matrix::Zero(qp.C.rows(), qp.C.rows());
  e_ = qp.c;
  if (!back(qp, regularisation, any)) return Result::not_convex;
  settle_goals();
  forth(qp);
  return Result::ok;
}

/// P, p and Γ from the last block to the first, with the gains; W and e of the goals.
bool RiccatiQp::back(const QuadraticProgramme& qp, double regularisation, bool any) {
  const long n = qp.last_H.rows();
  for (size_t k = qp.stages.size(); k-- > 0;) {
    const auto& s = qp.stages[k];
    const long nw = s.B.cols();
    const Matrix &P = P_[k + 1], &Gamma = Gamma_[k + 1];
    PA_.noalias() = P * s.A;
    PB_.noalias() = P * s.B;
    pd_ = p_[k + 1];
    pd_.noalias() += P * s.d;
    Q_ = s.H.topLeftCorner(n, n);
    Q_.noalias() += s.A.transpose() * PA_;
    S_ = s.H.bottomLeftCorner(nw, n);
    S_.noalias() += s.B.transpose() * PA_;
    R_ = s.H.bottomRightCorner(nw, nw);
    R_.noalias() += s.B.transpose() * PB_;
    R_.diagonal().array() += regularisation;
    q_ = s.g.head(n);
    q_.noalias() += s.A.transpose() * pd_;
    r_ = s.g.tail(nw);
    r_.noalias() += s.B.transpose() * pd_;
    Gw_.noalias() = s.B.transpose() * Gamma;
    Gains& g = gains_[k];
    const auto solve_by = [&](const auto& factor) {
      g.K = -factor.solve(S_);
      g.k = -factor.solve(r_);
      if (Gw_.cols() == 0)  // Eigen would refer to an element of the empty matrix
        g.Knu.resize(Gw_.rows(), 0);
      else
        g.Knu = -factor.solve(Gw_);
    };
    if (any) {
      lu_.compute(R_);
      solve_by(lu_);
    } else {
      llt_.compute(R_);
      if (llt_.info() != Eigen::Success || !(llt_.rcond() > 1e-15)) return false;
      solve_by(llt_);
    }
    P_[k] = Q_;
    P_[k].noalias() += S_.transpose() * g.K;
    P_[k] = 0.5 * (P_[k] + P_[k].transpose()).eval();
    p_[k] = q_;
    p_[k].noalias() += S_.transpose() * g.k;
    Gamma_[k].noalias() = s.A.transpose() * Gamma;
    Gamma_[k].noalias() += S_.transpose() * g.Knu;
    e_.noalias() += Gamma.transpose() * s.d;
    e_.noalias() += Gw_.transpose() * g.k;
    W_.noalias() -= Gw_.transpose() * g.Knu;
  }
  return true;
}

/// W ν = e. Where the programme is convex W is semidefinite; what it cannot reach is left out.
void RiccatiQp::settle_goals() {
  const long m = W_.rows();
  nu = Vector::Zero(m);
  unreached = 0;
  if (m == 0) return;
  const Eigen::SelfAdjointEigenSolver<Matrix> spectrum(W_);
  const auto& values = spectrum.eigenvalues();
  const double largest = values.cwiseAbs().maxCoeff();
  for (long i = 0; i < m; ++i) {
    const auto v = spectrum.eigenvectors().col(i);
    if (std::fabs(values[i]) > 1e-13 * largest)
      nu += v * (v.dot(e_) / values[i]);
    else
      ++unreached;
  }
}

/// The moves and λ from the first block to the last.
void RiccatiQp::forth(const QuadraticProgramme& qp) {
  const size_t N = qp.stages.size();
  x.resize(N + 1);
  w.resize(N);
  lambda.resize(N + 1);
  x[0] = Vector::Zero(qp.last_H.rows());
  for (size_t k = 0; k < N; ++k) {
    const auto& s = qp.stages[k];
    const Gains& g = gains_[k];
    w[k] = g.k;
    w[k].noalias() += g.K * x[k];
    w[k].noalias() += g.Knu * nu;
    x[k + 1] = s.d;
    x[k + 1].noalias() += s.A * x[k];
    x[k + 1].noalias() += s.B * w[k];
  }
  for (size_t k = 0; k <= N; ++k) {
    lambda[k] = p_[k];
    lambda[k].noalias() += P_[k] * x[k];
    lambda[k].noalias() += Gamma_[k] * nu;
  }
}

}  // namespace porthos::planning::detail
