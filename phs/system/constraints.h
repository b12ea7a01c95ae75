#pragma once
#include <cstddef>
#include <span>
#include <string>

#include "phs/error.h"
#include "phs/scalars/scalar.h"
#include "phs/system/description.h"

/// Constraints as a part of the port-Hamiltonian contract (a pH-DAE):
///
///   x' = (J - R) e + G u - B(x) λ,   0 = g(x),   0 = B(x)ᵀ e,   e = ∂H/∂x
///
/// B(x) λ is the gradient of g along the positions, moved to the momenta: (0, (∂g/∂q)ᵀ λ) in a
/// canonical state. The constraint port has the effort λ and the flow Bᵀe = d/dt g, which is zero:
/// the structure stays skew, and the port transmits no power.
///
/// Two kinds of rows differ. A row that rolls (ConstraintBlock::rolling) restricts rates and no
/// positions: Bᵀe = 0 for some Bᵀ that is no gradient, and its g is always 0. A row that moves
/// (ConstraintBlock::moving) has g(x, t): then Bᵀe = -∂g/∂t, and the port puts in the power
/// λᵀ ∂g/∂t.
namespace porthos::phs {

/// The constraints of one System object (System::constraints), evaluated in the same scalar. It
/// works at the point that place() was called for last. One object per thread; several objects of
/// one system are independent. Nothing allocates but delassus().
template <class T>
class Constraints {
 public:
  using In = std::span<const T>;
  using Out = std::span<T>;

  virtual ~Constraints() = default;
  /// The number of rows m, dependent ones included.
  virtual int count() const = 0;
  /// The time of rows that move, for what follows [s].
  virtual void set_time(const T& t) = 0;
  /// Moves to x (size nx) and writes g(x), size m.
  virtual void place(In x, Out g) = 0;
  /// Bλ = B λ. @param lambda  size m;  Bl written, size nx (zero except at momenta)
  virtual void forces(In lambda, Out Bl) = 0;
  /// g' = Bᵀ e. @param e  efforts, size nx;  g_dot written, size m
  virtual void rates(In e, Out g_dot) = 0;
  /// g' += ∂g/∂t, of rows that move.
  virtual void add_drift(Out g_dot) = 0;

  /// What the multipliers λ (size m) exert, ConstraintBlock::reactions of each block in turn.
  virtual void exerted(In lambda, Out reactions) const = 0;

  /// D = G H_pp Gᵀ (Delassus), where g' = G q' : dense, for checks. D written, m × m row-major.
  virtual void delassus(In x, Out D) = 0;
  /// Factors D here and now, block by block. It chooses independent rows by pivoting. Call it on
  /// the manifold only, because off it dependent rows look independent. It works for one state at a
  /// time. @return the rank @throws std::logic_error for lanes
  virtual int factor(In x) = 0;
  /// The rank that factor() found.
  virtual int rank() const = 0;
  /// Whether factor() chose this row.
  virtual bool uses(int row) const = 0;
  /// r ← a solution λ of D λ = r, with λ = 0 for rows not in use. Size m.
  virtual void solve(Out r) const = 0;
  /// solve() for several right-hand sides, with the bits that each has alone. @param r  m × n
  ///   row-major: one right-hand side per column
  virtual void solve_all(Out r, int n) const = 0;
  /// Replaces the solution of D λ = r that solve() gave by the shortest one. Size m.
  virtual void shorten(Out lambda) const = 0;
  /// Whether D λ = r has only one value for this row.
  virtual bool unique(int row) const = 0;
  /// The smallest pivot in use, relative to what its row could give: where it falls towards 0, the
  /// loops come close to a singular position.
  virtual double smallest_pivot() const = 0;

  /// As System::set_turn_angles.
  virtual void set_turn_angles(In) {}
};

/// @throws InvalidArgument if the system has constraints: "<what> takes no constraints, and ..."
inline void refuse_constraints(const Description& d, const std::string& what) {
  if (d.constraints.empty()) return;
  throw InvalidArgument(what + " takes no constraints, and '" + d.name + "' has '" +
                        d.constraints.front().name + "'");
}

}  // namespace porthos::phs
