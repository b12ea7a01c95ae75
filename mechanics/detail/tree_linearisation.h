#pragma once
#include <algorithm>
#include <array>
#include <vector>

#include "mechanics/hamiltonian_field.h"
#include "mechanics/passes-inl.h"
#include "phs/system/resolvent.h"

namespace porthos::mechanics {

/// The point at which a mechanism's field is linearised: poses, twists and subtree momenta in world
/// axes, and for each body P, the response of its momentum to a variation. `weight`: there is
/// gravity, whose direction varies in the body's frame.
template <bool weight>
class TreeLinearisation {
 protected:
  using C = phs::Complex4;

  static constexpr int rows = weight ? 12 : 6;  ///< numbers in f = (δh, δg)
  static constexpr int cols = weight ? 9 : 6;   ///< numbers in s = (δV, δγ)
  using Up = std::array<C, rows>;
  using Down = std::array<C, cols>;

  struct Body {
    Transform<double> E;  ///< pose in the world, about the reference point
    Motion<double> V;
    Force<double> h, g;
    std::array<Down, rows> P;
  };

  TreeLinearisation(const Mechanism& m, const std::vector<double>& turn_angle)
      : m_(m), turn_angle_(turn_angle), nq_(size_t(m.nq())), w_(m), bodies_(m.nodes().size()) {}

  /// Sets the point of linearisation: poses, twists, subtree momenta and weights, and P of the
  /// single bodies.
  void move_to(std::span<const double> x) {
    std::copy(turn_angle_.begin(), turn_angle_.end(), w_.turn_angle.begin());
    rates_from_momenta<double>(m_, w_, x.first(nq_), x.subspan(nq_));
    passes::place_axial_bodies(m_, w_);
    const auto& nodes = m_.nodes();
    for (size_t i = 0; i < nodes.size(); ++i) {
      Body& b = bodies_[i];
      if (nodes[i].parent >= 0)
        b.E = bodies_[size_t(nodes[i].parent)].E * w_.X[i];
      else  // about the first root: far from the world's origin m r² would swamp the inertias
        b.E = {w_.X[i].R, w_.X[i].r - w_.X[0].r};
      b.V = b.E.to_parent(w_.V[i]);
      const auto I = to_parent(b.E, ArticulatedInertia<double>(nodes[i].inertia));
      b.h = I * b.V;
      b.g = I * Motion<double>{{0, 0, 0}, m_.gravity()};
      for (auto& row : b.P) row.fill(C(0.0));
      for (int k = 0; k < 6; ++k) {
        const Force<double> column = I * unit_twist(k);
        for (int a = 0; a < 6; ++a) {
          b.P[size_t(a)][size_t(k)] = C(column[a]);
          if constexpr (weight)
            if (k >= 3) b.P[size_t(6 + a)][size_t(3 + k)] = C(column[a]);
        }
      }
    }
    for (size_t i = nodes.size(); i-- > 0;)
      if (nodes[i].parent >= 0) {
        Body& parent = bodies_[size_t(nodes[i].parent)];
        parent.h += bodies_[i].h;
        parent.g += bodies_[i].g;
      }
  }
  Motion<double> carried(size_t i) const {
    const int parent = m_.nodes()[i].parent;
    return parent < 0 ? passes::zero_motion<double>() : bodies_[size_t(parent)].V;
  }
  /// The contribution of a displacement ζ of body i to s_i and to f_up.
  std::array<double, cols> shift_of_s(size_t i, const Motion<double>& zeta) const {
    const Motion<double> a = cross(carried(i), zeta);
    const Vec3<double> b = cross(m_.gravity(), zeta.w);
    std::array<double, cols> r;
    for (int k = 0; k < cols; ++k) r[size_t(k)] = k < 6 ? a[k] : b[k - 6];
    return r;
  }
  std::array<double, rows> shift_of_f(size_t i, const Motion<double>& zeta) const {
    const Force<double> a = cross(zeta, bodies_[i].h), b = cross(zeta, bodies_[i].g);
    std::array<double, rows> r;
    for (int k = 0; k < rows; ++k) r[size_t(k)] = k < 6 ? a[k] : b[k - 6];
    return r;
  }

  static Motion<double> unit_twist(int k) {
    auto m = passes::zero_motion<double>();
    m[k] = 1;
    return m;
  }

  Mechanism const& m_;
  const std::vector<double>& turn_angle_;
  size_t nq_;
  Workspace<double> w_;
  std::vector<Body> bodies_;
};

}  // namespace porthos::mechanics
