#pragma once
#include <algorithm>
#include <cmath>
#include <span>
#include <stdexcept>
#include <type_traits>
#include <vector>

#include "mechanics/constraints/constraint_set.h"
#include "mechanics/passes-inl.h"
#include "phs/linear_algebra/pivoted_cholesky.h"

namespace porthos::mechanics::constraint_detail {

/// The size of a scalar; 0 in lanes, which choose no rows.
template <class T>
double size_of(const T& x) {
  if constexpr (phs::is_pack<T>)
    return 0;
  else
    return std::fabs(phs::to_double(x));
}

/// Upper bounds of a wrench's moment and force: what they could be if nothing lay in line.
struct Reach {
  double moment = 0, force = 0;

  void operator+=(const Reach& r) {
    moment += r.moment;
    force += r.force;
  }
  /// About a point at the distance r.
  Reach moved(double r) const { return {moment + r * force, force}; }
};

/// A wrench on a frame of a node, in the node's axes about its origin.
template <class T>
struct OnNode {
  int node = -1;  ///< -1: the world
  Force<T> wrench;
  Reach reach;

  OnNode() = default;
  OnNode(int on, const Transform<T>& frame, const Force<T>& w)
      : node(on),
        wrench(frame.to_parent(w)),
        reach(Reach{std::sqrt(size_of(dot(w.n, w.n))), std::sqrt(size_of(dot(w.f, w.f)))}.moved(
            std::sqrt(size_of(dot(frame.r, frame.r))))) {}
};

/// What one unit of a row's multiplier does: wrenches on two nodes, and joint forces.
template <class T>
struct UnitWrench {
  int row;
  std::span<const int> above;  ///< every node below which it acts, leaves first
  std::span<const ConstraintSet::Term> terms;
  OnNode<T> a, b;
};

/// A matrix with one value per lane. Lanes choose no rows, so it has no factors.
template <class T>
class LanesOfMatrix {
 public:
  explicit LanesOfMatrix(size_t n) : n_(n), a_(n * n, T(0.0)) {}
  T& at(size_t i, size_t j) { return a_[i * n_ + j]; }
  int factor(std::span<const double>) { refuse(); }
  bool uses(size_t) const { refuse(); }
  bool unique(size_t) const { refuse(); }
  double smallest_pivot() const { refuse(); }
  void solve(std::span<T>) const { refuse(); }
  void shorten(std::span<T>) const { refuse(); }

 private:
  [[noreturn]] static void refuse() {
    throw std::logic_error("the Delassus matrix of lanes is not factored");
  }
  size_t n_;
  std::vector<T> a_;
};

/// The Delassus matrix D = G M⁻¹ Gᵀ of a set, by groups, and its factors.
///
/// M⁻¹ = Σ over freedoms of the articulated elimination. A row's unit wrenches β move up to the
/// root: u_k = S_kᵀ β, β ← β - U_k u_k / D_k at every freedom, with the U and D that the factor of
/// the field left in the workspace. Then D_rs = Σ_k u_k^r u_k^s / D_k: no sweep down.
template <class T>
class Delassus {
  using Cholesky = std::conditional_t<phs::is_pack<T>, LanesOfMatrix<T>, phs::PivotedCholesky<T>>;

 public:
  Delassus(const Mechanism& m, const ConstraintSet& set)
      : m_(m), set_(set), beta_(m.nodes().size()), reach_(beta_.size()) {
    place_of_.resize(size_t(set.count()));
    slot_of_.assign(size_t(m.nv()), -1);
    for (size_t g = 0; g < set.groups().size(); ++g) {
      const auto& group = set.groups()[g];
      for (size_t r = 0; r < group.rows.size(); ++r)
        place_of_[size_t(group.rows[r])] = {int(g), int(r)};
      for (size_t k = 0; k < group.freedoms.size(); ++k)
        slot_of_[size_t(group.freedoms[k])] = int(k);
      parts_.push_back({std::vector<T>(group.rows.size() * group.freedoms.size(), T(0.0)),
                        std::vector<double>(group.rows.size(), 0.0), Cholesky(group.rows.size()),
                        std::vector<T>(group.rows.size(), T(0.0))});
    }
  }

  /// D from the unit wrenches of all rows: each_row(add) calls add(UnitWrench) for every row. w:
  /// factored at the same q.
  template <class EachRow>
  void sweep_rows(const EachRow& each_row, const Workspace<T>& w) {
    each_row([&](const UnitWrench<T>& unit) { sweep(unit, w); });
    for (size_t g = 0; g < parts_.size(); ++g) multiply(parts_[g], set_.groups()[g], w);
  }

  /// D dense, of the last sweep. @param D  m × m row-major
  void write(std::span<T> D) {
    const size_t m = size_t(set_.count());
    for (size_t r = 0; r < m; ++r)
      for (size_t s = 0; s < m; ++s) D[r * m + s] = element(place_of_[r], place_of_[s]);
  }
  int factor() {
    rank_ = 0;
    for (auto& p : parts_) rank_ += p.cholesky.factor(p.bound);
    return rank_;
  }
  int rank() const { return rank_; }
  bool uses(int row) const { return part(row).cholesky.uses(size_t(place_of_[size_t(row)].row)); }
  bool unique(int row) const {
    return part(row).cholesky.unique(size_t(place_of_[size_t(row)].row));
  }
  double smallest_pivot() const {
    double least = 1;
    for (const auto& p : parts_) least = std::min(least, p.cholesky.smallest_pivot());
    return least;
  }
  void solve(std::span<T> r) const {
    by_group(r, [](const auto& p, std::span<T> x) { p.cholesky.solve(x); });
  }
  void shorten(std::span<T> r) const {
    by_group(r, [](const auto& p, std::span<T> x) { p.cholesky.shorten(x); });
  }

 private:
  struct Place {
    int group, row;
  };
  T element(Place r, Place s) {
    if (r.group != s.group) return T(0.0);
    const auto [least, most] = std::minmax(r.row, s.row);
    return parts_[size_t(r.group)].cholesky.at(size_t(most), size_t(least));
  }
  struct Part {
    std::vector<T> u;           ///< rows × freedoms
    std::vector<double> bound;  ///< of the diagonal
    Cholesky cholesky;
    mutable std::vector<T> x;
  };
  const Part& part(int row) const { return parts_[size_t(place_of_[size_t(row)].group)]; }

  template <class Apply>
  void by_group(std::span<T> r, const Apply& apply) const {
    for (size_t g = 0; g < parts_.size(); ++g) {
      const auto& rows = set_.groups()[g].rows;
      auto& x = parts_[g].x;
      for (size_t i = 0; i < rows.size(); ++i) x[i] = r[size_t(rows[i])];
      apply(parts_[g], std::span<T>(x));
      for (size_t i = 0; i < rows.size(); ++i) r[size_t(rows[i])] = x[i];
    }
  }

  void sweep(const UnitWrench<T>& unit, const Workspace<T>& w) {
    const auto [g, r] = place_of_[size_t(unit.row)];
    Part& part = parts_[size_t(g)];
    const size_t freedoms = set_.groups()[size_t(g)].freedoms.size();
    T* const u = part.u.data() + size_t(r) * freedoms;
    std::fill_n(u, freedoms, T(0.0));
    for (const int i : unit.above) {
      beta_[size_t(i)] = passes::zero_force<T>();
      reach_[size_t(i)] = {};
    }
    for (const OnNode<T>* end : {&unit.a, &unit.b})
      if (end->node >= 0) {
        beta_[size_t(end->node)] += end->wrench;
        reach_[size_t(end->node)] += end->reach;
      }
    for (const auto& t : unit.terms) {
      T& own = u[slot_of_[size_t(t.v)]];
      own = own + T(t.factor);
    }
    double bound = 0;
    for (const int i : unit.above) {
      const Node& n = m_.nodes()[size_t(i)];
      Force<T>& beta = beta_[size_t(i)];
      visit_joint(n.type, [&](auto J) {
        unroll_descending<decltype(J)::nv>([&](auto k) {
          const size_t v = size_t(n.v + k);
          T& uk = u[slot_of_[v]];
          uk = uk + decltype(J)::template project<k>(n, beta);
          bound += most_of<decltype(J), k>(n, reach_[size_t(i)], uk) * size_of(w.D_inverse[v]);
          beta += (-(w.D_inverse[v] * uk)) * w.U[v];
        });
      });
      if (n.parent < 0) continue;
      const Transform<T>& X = w.X[size_t(i)];
      beta_[size_t(n.parent)] += X.to_parent(beta);
      reach_[size_t(n.parent)] += reach_[size_t(i)].moved(std::sqrt(size_of(dot(X.r, X.r))));
    }
    part.bound[size_t(r)] = bound;
  }
  /// The square of the largest joint force that the wrench could give, at least u².
  template <class J, int k>
  static double most_of(const Node& n, const Reach& reach, const T& u) {
    Motion<T> S = passes::zero_motion<T>();
    J::template add<k>(n, T(1.0), S);
    const double most = std::sqrt(size_of(dot(S.w, S.w))) * reach.moment +
                        std::sqrt(size_of(dot(S.v, S.v))) * reach.force;
    return std::max(most * most, size_of(u) * size_of(u));
  }

  void multiply(Part& p, const ConstraintSet::Group& group, const Workspace<T>& w) {
    const size_t m = group.rows.size(), n = group.freedoms.size();
    for (size_t i = 0; i < m; ++i)
      for (size_t j = 0; j <= i; ++j) {
        T sum(0.0);
        const T *a = p.u.data() + i * n, *b = p.u.data() + j * n;
        for (size_t k = 0; k < n; ++k)
          sum = sum + (a[k] * w.D_inverse[size_t(group.freedoms[k])]) * b[k];
        p.cholesky.at(i, j) = sum;
      }
  }

  const Mechanism& m_;
  const ConstraintSet& set_;
  std::vector<Force<T>> beta_;  ///< by node, of the row being swept
  std::vector<Reach> reach_;
  std::vector<Place> place_of_;
  std::vector<int> slot_of_;
  std::vector<Part> parts_;
  int rank_ = 0;
};

}  // namespace porthos::mechanics::constraint_detail
