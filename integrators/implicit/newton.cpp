#include "integrators/implicit/newton.h"

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <complex>

namespace porthos::integrators {

using phs::Complex4;

SimplifiedNewton::SimplifiedNewton(const phs::Model& model, std::span<const double> A,
                                   Solver solver, DualField* field)
    : s_(size_t(std::lround(std::sqrt(double(A.size()))))),
      forward_(s_),
      back_(s_),
      system_(model.instantiate<double>()),
      field_(field),
      keeper_(model.description()),
      own_(system_->resolvent()),
      d_(size_t(model.description().nx)),
      before_(d_.size()),
      x_(d_.size()) {
  turns_.assign(size_t(model.description().angle_count()), 0);
  choose_solvers(model, solver);
  diagonalise(A);
}

void SimplifiedNewton::choose_solvers(const phs::Model& model, Solver solver) {
  const bool automatic = solver == Solver::automatic;
  if (own_ && (automatic || solver == Solver::newton_articulated))
    solvers_.push_back(Solver::newton_articulated);
  if (automatic && (field_ || !(own_ && own_->exact())))
    solvers_.push_back(d_.size() <= 100 ? Solver::newton_dense : Solver::newton_krylov);
  if (solver == Solver::newton_dense || solver == Solver::newton_krylov) solvers_.push_back(solver);
  if (solvers_.empty())
    throw InvalidArgument("solver '" + std::string(to_string(solver)) + "' is not offered by '" +
                          model.description().name + "'");
  if (solvers_.back() != Solver::newton_articulated) {
    if (!field_) {
      own_field_ = field_in_duals(model);
      field_ = own_field_.get();
    }
    try {  // throws here, not in the middle of a run, if a gradient has no duals
      std::vector<phs::Dual> x(d_.size()), f(d_.size());
      (*field_)(0, x, f);
    } catch (const InvalidArgument&) {
      if (!automatic) throw;
      solvers_.pop_back();
    }
    if (!solvers_.empty() && solvers_.back() == Solver::newton_dense)
      dense_ = make_dense_resolvent(*field_, d_.size());
    if (!solvers_.empty() && solvers_.back() == Solver::newton_krylov)
      krylov_ = make_krylov_resolvent(*field_, d_.size(), own_.get());
  }
}

void SimplifiedNewton::diagonalise(std::span<const double> A) {
  // A = Σ_k 2 Re(v_k λ_k w_kᵀ) over the pairs, plus the real ones. Methods of lower degree than
  // their number of nodes have many zero eigenvalues, whose eigenvectors are not well defined. So A
  // = U C on its range, and C U has the other eigenvalues, with vectors v = U z, w = yᵀ C / λ from
  // its own z and y.
  using Matrix = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
  const auto s = Eigen::Index(s_);
  const Matrix a =
      Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
          A.data(), s, s)
          .cast<long double>();
  Eigen::JacobiSVD<Matrix> svd(a, Eigen::ComputeFullU);
  svd.setThreshold(1e-13L);
  const Eigen::Index rank = svd.rank();
  const Matrix U = svd.matrixU().leftCols(rank), C = U.transpose() * a;
  const Eigen::EigenSolver<Matrix> eigen(C * U);
  const auto Z = eigen.eigenvectors().eval();
  const auto V = (U * Z).eval();
  const auto W = (eigen.eigenvalues().cwiseInverse().asDiagonal() * Z.inverse() * C).eval();
  lambda_ = Complex4(0.0);
  std::fill(forward_.begin(), forward_.end(), Complex4(0.0));
  std::fill(back_.begin(), back_.end(), Complex4(0.0));
  int lane = 0;
  for (Eigen::Index k = 0; k < rank; ++k) {
    const auto l = eigen.eigenvalues()[k];
    if (l.imag() < 0) continue;
    if (lane == 4)
      throw InvalidArgument("Newton iteration: the method's matrix has more than four pairs");
    const auto set = [lane](Complex4& c, const std::complex<long double>& x) {
      c.re.set(lane, double(x.real()));
      c.im.set(lane, double(x.imag()));
    };
    set(lambda_, l);
    for (Eigen::Index i = 0; i < s; ++i) {
      set(forward_[size_t(i)], W(k, i));
      set(back_[size_t(i)], (l.imag() > 0 ? 2.0L : 1.0L) * V(i, k));
    }
    ++lane;
  }
  for (; lane < 4; ++lane) {  // spare lanes solve with a right-hand side of zero
    lambda_.re.set(lane, lambda_.re[0]);
    lambda_.im.set(lane, lambda_.im[0]);
  }
}

phs::Resolvent* SimplifiedNewton::of(Solver s) {
  return s == Solver::newton_articulated ? own_.get()
         : s == Solver::newton_dense     ? dense_.get()
                                         : static_cast<phs::Resolvent*>(krylov_.get());
}

void SimplifiedNewton::freeze(Solver solver, double t, double h, std::span<const double> x,
                              const std::vector<std::int64_t>& turns) {
  frozen_ = solver;
  t_ = t;
  h_ = h;
  std::copy(x.begin(), x.end(), x_.begin());
  std::copy(turns.begin(), turns.end(), turns_.begin());
  keeper_.synchronise(turns_, *system_);
  if (dense_ || krylov_) field_->tell_turns(turns_);
  resolvent().factor(t, x_, h * lambda_);
  ++factorisations_;
}

void SimplifiedNewton::solve(std::span<double> r) {
  for (size_t k = 0; k < d_.size(); ++k) {
    Complex4 sum(0.0);
    for (size_t i = 0; i < s_; ++i) sum += r[k * s_ + i] * forward_[i];
    d_[k] = before_[k] = sum;
  }
  resolvent().solve(d_);
  for (size_t k = 0; k < d_.size(); ++k) {
    const Complex4 e = d_[k] - before_[k];  // the solve without the identity
    for (size_t i = 0; i < s_; ++i) {
      const phs::Pack4 x = back_[i].re * e.re - back_[i].im * e.im;
      r[k * s_ + i] += (x[0] + x[1]) + (x[2] + x[3]);
    }
  }
}

std::int64_t SimplifiedNewton::evaluations() const {
  return (dense_ ? dense_->evaluations() : 0) + (krylov_ ? krylov_->evaluations() : 0);
}

void SimplifiedNewton::carry(Archive& a) {
  int solver = int(frozen_);
  a(solver);
  a(t_);
  a(h_);
  a(x_);
  a(turns_);
  if (!a.loads()) return;
  if (std::find(solvers_.begin(), solvers_.end(), Solver(solver)) == solvers_.end())
    forget();
  else
    freeze(Solver(solver), t_, h_, std::vector(x_), std::vector(turns_));
}

}  // namespace porthos::integrators
