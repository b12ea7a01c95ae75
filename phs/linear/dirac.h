#pragma once
#include <span>
#include <utility>
#include <vector>

#include "phs/linear_algebra/matrix.h"

/// Interconnections that neither store nor lose power: Dirac structures on n ports in kernel form
///
///   D = { (f, e) : F f + E e = 0 },    F Eᵀ + E Fᵀ = 0,    rank [F|E] = n,
///
/// so that eᵀf = 0 on D and D is as large as that allows. eᵀf is the power flowing in at the ports.
namespace porthos::phs {

/// Both conditions as measured, relative to the size of [F|E].
struct DiracDefects {
  double power = 0;  ///< |F Eᵀ + E Fᵀ| / |[F|E]|²: 0 where eᵀf = 0
  double independence =
      0;  ///< smallest over largest singular value of [F|E]: > 0 where the n rows are independent
  bool holds() const { return power <= 1e-12 && independence > 1e-12; }
};

/// Of any F, E of one shape n × n.
DiracDefects dirac_defects(const Matrix& F, const Matrix& E);

/// A Dirac structure D = {(f, e): F f + E e = 0}: power conserving, and as large as such a set can
/// be.
class Dirac {
 public:
  /// Refuses what is not a Dirac structure and says which condition fails by how much.
  Dirac(Matrix F, Matrix E);

  int ports() const { return F_.rows; }
  const Matrix& F() const { return F_; }
  const Matrix& E() const { return E_; }
  DiracDefects defects() const { return dirac_defects(F_, E_); }
  /// |F f + E e| / |[F|E]|: 0 for (f, e) on D.
  double residual(std::span<const double> f, std::span<const double> e) const;

  /// e = K f with K skew; K = [0 -1; 1 0] is negative feedback u1 = -y2, u2 = y1.
  static Dirac feedback(const Matrix& K);
  /// One effort, flows that sum to zero: Kirchhoff's node.
  static Dirac zero_junction(int ports);
  /// One flow, efforts that sum to zero: Kirchhoff's loop, d'Alembert.
  static Dirac one_junction(int ports);
  /// e1 = n e2, f2 = -n f1: a gear, a lever.
  static Dirac transformer(double n);
  /// e1 = r f2, e2 = -r f1: a motor between current and torque.
  static Dirac gyrator(double r);

 private:
  Matrix F_, E_;
};

/// How far two structures on as many ports are from being the same set: |F_a E_bᵀ + E_a F_bᵀ| over
/// the sizes, as
/// (f, e) = (E_bᵀλ, F_bᵀλ) runs through D_b.
double distance(const Dirac& a, const Dirac& b);

/// Joins port i of `a` to port j of `b` for each (i, j) of `shared`: e_i = e_j, f_i = -f_j. The
/// ports left, those of `a` first, again form a Dirac structure (Cervera, van der Schaft, Baños
/// 2007).
Dirac compose(const Dirac& a, const Dirac& b, const std::vector<std::pair<int, int>>& shared);

}  // namespace porthos::phs
