#pragma once
#include <span>
#include <utility>
#include <vector>

#include "phs/linear_algebra/matrix.h"

/// Interconnections that neither store nor dissipate power: Dirac structures on n ports, kernel
/// form
///
///   D = { (f, e) : F f + E e = 0 },    F Eᵀ + E Fᵀ = 0,    rank [F|E] = n,
///
/// so that eᵀf = 0 on D, and D has the largest possible dimension. eᵀf is the power flowing in at
/// the ports.
namespace porthos::phs {

/// Violations of both conditions, relative to the size of [F|E].
struct DiracDefects {
  double power = 0;  ///< |F Eᵀ + E Fᵀ| / |[F|E]|²: 0 where eᵀf = 0
  double independence =
      0;  ///< smallest over largest singular value of [F|E]: > 0 where the n rows are independent
  bool holds() const { return power <= 1e-12 && independence > 1e-12; }
};

/// The defects of any F, E of one shape n × n.
DiracDefects dirac_defects(const Matrix& F, const Matrix& E);

/// A Dirac structure D = {(f, e): F f + E e = 0}: it conserves power and has the largest possible
/// dimension.
class Dirac {
 public:
  /// @throws InvalidArgument if F, E is not a Dirac structure; names the violated condition and by
  /// how much
  Dirac(Matrix F, Matrix E);

  int ports() const { return F_.rows; }
  const Matrix& F() const { return F_; }
  const Matrix& E() const { return E_; }
  DiracDefects defects() const { return dirac_defects(F_, E_); }
  /// |F f + E e| / |[F|E]|: 0 for (f, e) on D.
  double residual(std::span<const double> f, std::span<const double> e) const;

  /// e = K f with K skew; K = [0 -1; 1 0] is negative feedback u1 = -y2, u2 = y1.
  static Dirac feedback(const Matrix& K);
  /// One common effort, flows that sum to zero: Kirchhoff's current law.
  static Dirac zero_junction(int ports);
  /// One common flow, efforts that sum to zero: Kirchhoff's voltage law, d'Alembert.
  static Dirac one_junction(int ports);
  /// e1 = n e2, f2 = -n f1: a gear or a lever.
  static Dirac transformer(double n);
  /// e1 = r f2, e2 = -r f1: a motor between current and torque.
  static Dirac gyrator(double r);

 private:
  Matrix F_, E_;
};

/// How far two structures with equally many ports are from being the same set: |F_a E_bᵀ + E_a
/// F_bᵀ| relative to the sizes, because (f, e) = (E_bᵀλ, F_bᵀλ) runs through D_b.
double distance(const Dirac& a, const Dirac& b);

/// Joins port i of `a` to port j of `b` for each (i, j) of `shared`: e_i = e_j, f_i = -f_j. The
/// remaining ports, those of `a` first, again form a Dirac structure (Cervera, van der Schaft,
/// Baños 2007).
Dirac compose(const Dirac& a, const Dirac& b, const std::vector<std::pair<int, int>>& shared);

}  // namespace porthos::phs
