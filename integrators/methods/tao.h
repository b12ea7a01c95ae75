#pragma once
#include "integrators/core/integrator.h"
#include "integrators/tables/composition_tables.h"

namespace porthos::integrators {

struct Entry;

/// Tao's explicit method for a Hamiltonian that is not separable (Phys. Rev. E 94, 043303, 2016).
/// The phase space is doubled, (q, p) and a copy (x, y), with
///   H(q, y) + H(x, p) + (ω/2) Σ (m |q - x|² + |p - y|²/m)
/// whose three parts have explicit flows φA, φB and φC; φC rotates the differences by 2ωt. The
/// binding ω keeps the copies together; Tao's weights are m = 1. One step of order 2 is φA(h/2)
/// φB(h/2) φC(h) φB(h/2) φA(h/2).
///
/// The code uses the mean z of the two copies and d = copy - original, so the binding affects d
/// alone and the turns of angles z alone. The state of a run is z; its memory is d, which starts at
/// 0. Only the map of (z, d) is symplectic and symmetric. A map of the state that resets or drops d
/// is neither. Linear invariants of z are conserved.
template <class T>
class TaoMap {
 public:
  /// gamma: the composition of order-2 steps; omega [1/s]
  TaoMap(const phs::Model&, const CompositionTable* composition, double omega);

  /// Moves (z + lo, d) by h from time t.
  void advance(phs::System<T>&, T t, T h, std::span<T> z, std::span<T> lo, std::span<T> d);
  /// Weights m: for each number of q the reciprocal mean of ∂²H/∂p² over its block at the zero
  /// configuration, so that the binding compares coordinates and momenta in their own units.
  const std::vector<T>& weights() const { return m_; }
  std::int64_t evaluations_a_step() const;

 private:
  void weigh(const phs::Model&);
  void flow_of_half(phs::System<T>&, T sign, T t, T dt, std::span<T> z, std::span<T> lo,
                    std::span<T> d);
  void bind(T dt, std::span<T> d) const;

  std::vector<phs::Quad> gamma_;
  double omega_;
  std::vector<T> m_, x_, f_;
};

/// ω is Options::binding, or 20/s as in Tao's examples. It should exceed the fastest rate of the
/// system, but the error grows with it.
template <class T>
std::unique_ptr<BasicIntegrator<T>> make_tao(const Declaration&, const CompositionTable*,
                                             const phs::Model&, T h, const Options&);

std::vector<Entry> tao_entries();

}  // namespace porthos::integrators
