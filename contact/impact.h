#pragma once
#include <span>
#include <vector>

#include "phs/scalars/scalar.h"

/// Rigid impacts without friction: what several contacts that touch do to their rates at one
/// instant.
namespace porthos::contact {

/// What happens if several rigid contacts meet at one instant.
///   reflections  while some of them approach, the motion is reflected at the plastic impact of
///                those alone (Smith, Kaufman, Vouga, Tamstorf, Grinspun 2012). A row of balls
///                passes the motion on to the last one.
///   moreau       all at once: v⁺ = -e v⁻ + (1+e) u, u plastic (Moreau 1988). A row of balls
///                moves on together, and the first comes back.
enum class Simultaneous { reflections, moreau };
const char* to_string(Simultaneous rule);

/// An impact in the space of the gaps: rates v = G q' (negative: they approach), impulses ι >= 0
/// along the gaps, v⁺ = v + W ι with W = G M⁻¹ Gᵀ. Loops that hold during the impact enter W alone.
///
/// The plastic impact leaves the rates u = argmin |q' - q'⁻| in the metric of the kinetic energy,
/// with G u >= 0: the complementarity problem 0 <= λ ⊥ v + W λ >= 0, solved by an active set, so
/// exactly. With restitution 0 <= e <= 1 each rule gives e times its elastic outcome plus 1 - e
/// times the plastic one, and no rule makes energy. Of contacts that push in one impact with
/// different e, the least counts. If no motion leaves all contacts, reflections do not end; what
/// is left is then a plastic impact.
template <class T>
class RigidImpact {
 public:
  /// most: contacts at one instant
  explicit RigidImpact(size_t most);

  /// Finds impulses and losses. Cost: m³ per plastic impact; reflections need a few of them.
  /// @param W  m × m row-major, symmetric, not negative; may be singular
  /// @param v  size m: rates of the gaps before [m/s | rad/s], then after the impact
  /// @param e  restitutions, size m
  /// @return whether anything approached; if not, v is unchanged and all impulses are 0
  bool solve(std::span<const T> W, std::span<T> v, std::span<const double> e, Simultaneous rule);

  /// ι of the last impact [N s | N m s], size m.
  std::span<const T> impulses() const { return std::span(iota_).first(m_); }
  /// Kinetic energy that each contact has lost [J], size m, never negative. Their sum is exact, and
  /// divided as ι·(-v⁻).
  std::span<const T> losses() const { return std::span(loss_).first(m_); }
  /// Plastic impacts that the last call has computed.
  int solved() const { return solved_; }

 private:
  /// λ of the plastic impact of the contacts in among_ at rates v.
  void plastic(std::span<const T> W, std::span<const T> v, std::span<T> lambda);
  bool solve_free(std::span<const T> W, std::span<const T> v);
  bool approaches(std::span<const T> v);
  void reflect(std::span<const T> W, std::span<T> v);
  void once(std::span<const T> W, std::span<T> v, std::span<const double> e, Simultaneous rule);
  void push(std::span<const T> W, std::span<const T> lambda, std::span<T> v) const;
  void book(std::span<const T> before, std::span<const T> after);

  size_t m_ = 0;
  int solved_ = 0;
  T least_;  ///< rates below it are rounding
  std::vector<T> iota_, loss_;
  std::vector<T> before_, elastic_, plastic_, sum_, lambda_, candidate_, factor_;
  std::vector<char> among_;   ///< contacts of the plastic impact
  std::vector<size_t> free_;  ///< of those, the ones that push
};

#define PORTHOS_EXTERN(T) extern template class RigidImpact<T>;
PORTHOS_EXTERN(double) PORTHOS_EXTERN(phs::Quad)
#undef PORTHOS_EXTERN

}  // namespace porthos::contact
