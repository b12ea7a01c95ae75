#pragma once
#include <algorithm>
#include <cstring>
#include <span>
#include <stdexcept>
#include <type_traits>
#include <vector>

#include "mechanics/constraints/constraint_set.h"
#include "mechanics/constraints/unit_wrench-inl.h"
#include "mechanics/passes-inl.h"
#include "phs/linear_algebra/block_cholesky.h"

namespace porthos::mechanics::constraint_detail {

/// A matrix with one value per lane. Lanes choose no rows, so it has no factors.
template <class T>
class LanesOfMatrix {
 public:
  explicit LanesOfMatrix(const phs::BlockPattern& p) : a_(p.elements(), T(0.0)) {}
  std::span<T> elements() { return a_; }
  int factor(std::span<const double>) { refuse(); }
  int rank() const { refuse(); }
  bool uses(int) const { refuse(); }
  bool unique(int) const { refuse(); }
  double smallest_pivot() const { refuse(); }
  void solve(std::span<T>) const { refuse(); }
  void shorten(std::span<T>) const { refuse(); }

 private:
  [[noreturn]] static void refuse() {
    throw std::logic_error("the Delassus matrix of lanes is not factored");
  }
  std::vector<T> a_;
};

/// The Delassus matrix D = G M⁻¹ Gᵀ of a set, sparse, and its factors.
///
/// M⁻¹ = Σ over freedoms of the articulated elimination. A row's unit wrenches β move up to the
/// root: u_k = S_kᵀ β, β ← β - K_k u_k at every freedom, with the K and D that the factor of the
/// field left in the workspace. Then D_rs = Σ_k u_k^r u_k^s / D_k over the freedoms that move
/// both rows: no sweep down, and no element where there are none.
template <class T>
class Delassus {
  using Cholesky = std::conditional_t<phs::is_pack<T>, LanesOfMatrix<T>, phs::BlockCholesky<T>>;
  using Rows = RowLanes<T>;
  using S = typename Rows::S;

 public:
  Delassus(const Mechanism& m, const ConstraintSet& set)
      : m_(m),
        pattern_(set.pattern()),
        factors_(pattern_),
        bound_(size_t(set.count()), 0.0),
        x_(bound_.size(), T(0.0)),
        sides_(std::is_same_v<T, double> ? bound_.size() : 0),
        beta_(m.nodes().size()),
        reach_(beta_.size()),
        lever_(beta_.size()),
        axes_(size_t(m.nv())),
        of_terms_(size_t(m.nv()), T(0.0)) {
    for (const Node& n : m.nodes())
      visit_joint(n.type, [&](auto J) {
        unroll<decltype(J)::nv>([&](auto k) {
          Motion<double> axis = passes::zero_motion<double>();
          decltype(J)::template add<k>(n, 1.0, axis);
          axes_[size_t(n.v + k)] = {length_of(axis.w), length_of(axis.v)};
        });
      });
    for (int b = 0; b < int(set.blocks().size()); ++b) add_block(set, b);
    u_.assign(elements_of_u_, S(T(0.0)));
    scaled_ = u_;
    for (int b = 0; b < int(blocks_.size()); ++b) add_meeting(b, b);
    for (const auto& [a, b] : set.neighbours()) {
      const bool later = pattern_.place(a) > pattern_.place(b);
      add_meeting(later ? a : b, later ? b : a);
    }
  }

  /// D from the unit wrenches of all rows: each_row(add) calls add(UnitWrench) for every row. w:
  /// factored at the same q.
  template <class EachRow>
  void sweep_rows(const EachRow& each_row, const Workspace<T>& w) {
    for (size_t i = 0; i < lever_.size(); ++i) lever_[i] = length_of(w.X[i].r);
    each_row([&](const UnitWrench<S>& unit) { sweep(unit, w); });
    const auto elements = factors_.elements();
    std::fill(elements.begin(), elements.end(), T(0.0));  // factors have more than D
    for (const Meeting& meeting : meetings_) multiply(meeting);
  }

  /// D dense, of the last sweep. @param D  m × m row-major
  void write(std::span<T> D) {
    const size_t m = bound_.size();
    std::fill(D.begin(), D.end(), T(0.0));
    for (const Meeting& t : meetings_)
      each_element(t, [&](int i, int j, const T& element) {
        const size_t r = size_t(blocks_[size_t(t.a)].row + i),
                     s = size_t(blocks_[size_t(t.b)].row + j);
        D[r * m + s] = D[s * m + r] = element;
      });
  }
  int factor() { return factors_.factor(bound_); }
  int rank() const { return factors_.rank(); }
  bool uses(int row) const { return factors_.uses(place_[size_t(row)]); }
  bool unique(int row) const { return factors_.unique(place_[size_t(row)]); }
  double smallest_pivot() const { return factors_.smallest_pivot(); }
  void solve(std::span<T> r) const { solve_column(r.data(), 1); }
  /// @param r  m × n row-major: a right-hand side per column
  void solve_all(std::span<T> r, int n) const {
    constexpr int width = phs::lanes<phs::Pack8>;
    if constexpr (std::is_same_v<T, double>) {
      for (int k = 0; k < n; k += width) solve_in_lanes(r.data() + k, n, std::min(n - k, width));
    } else {
      for (int k = 0; k < n; ++k) solve_column(r.data() + k, n);
    }
  }
  void shorten(std::span<T> r) const {
    by_place(r.data(), 1, [&](std::span<T> x) { factors_.shorten(x); });
  }

 private:
  /// The rows of a constraint and the freedoms that move them.
  struct Block {
    int row, rows;
    std::vector<int> freedoms;  ///< ascending
    size_t u;                   ///< offset of its rows × freedoms, rows in lanes
  };
  /// Freedoms that move two blocks, as successive indices in both.
  struct Common {
    int in_a, in_b, count;
  };
  struct Meeting {
    int a, b;  ///< place of a >= place of b
    phs::BlockPattern::Location to;
    size_t begin, end;  ///< in common_
  };

  void add_block(const ConstraintSet& set, int b) {
    const auto& rows = set.blocks()[size_t(b)];
    Block block{rows.at, rows.size, {}, elements_of_u_};
    const auto above = set.above(b);
    for (size_t i = above.size(); i-- > 0;) {
      const Node& n = m_.nodes()[size_t(above[i])];
      visit_joint(n.type, [&](auto J) {
        for (int k = 0; k < decltype(J)::nv; ++k) block.freedoms.push_back(n.v + k);
      });
    }
    elements_of_u_ += size_t((rows.size + Rows::width - 1) / Rows::width) * block.freedoms.size();
    for (int r = 0; r < rows.size; ++r) {
      place_.push_back(pattern_.place(b) + r);
      block_of_.push_back(b);
    }
    blocks_.push_back(std::move(block));
  }
  void add_meeting(int a, int b) {
    Meeting t{a, b, pattern_.locate(a, b), common_.size(), 0};
    const auto &in_a = blocks_[size_t(a)].freedoms, &in_b = blocks_[size_t(b)].freedoms;
    for (size_t i = 0, j = 0; i < in_a.size() && j < in_b.size();) {
      if (in_a[i] != in_b[j]) {
        ++(in_a[i] < in_b[j] ? i : j);
        continue;
      }
      Common run{int(i), int(j), 0};
      for (; i < in_a.size() && j < in_b.size() && in_a[i] == in_b[j]; ++i, ++j) ++run.count;
      common_.push_back(run);
    }
    t.end = common_.size();
    meetings_.push_back(t);
  }
  template <class Apply>
  void each_element(const Meeting& t, const Apply& apply) {
    T* const to = factors_.elements().data() + t.to.offset;
    for (int i = 0; i < blocks_[size_t(t.a)].rows; ++i)
      for (int j = 0; j < (t.a == t.b ? i + 1 : blocks_[size_t(t.b)].rows); ++j)
        apply(i, j, to[size_t(i) * t.to.stride + size_t(j)]);
  }

  /// Applies to one column of n.
  template <class Apply>
  void by_place(T* r, int n, const Apply& apply) const {
    for (size_t i = 0; i < place_.size(); ++i) x_[size_t(place_[i])] = r[i * size_t(n)];
    apply(std::span<T>(x_));
    for (size_t i = 0; i < place_.size(); ++i) r[i * size_t(n)] = x_[size_t(place_[i])];
  }
  void solve_column(T* r, int n) const {
    by_place(r, n, [&](std::span<T> x) { factors_.solve(x); });
  }
  /// Up to eight columns of n at once; lanes beyond them are zero.
  void solve_in_lanes(T* r, int n, int columns) const {
    const size_t bytes = size_t(columns) * sizeof(T);
    for (size_t i = 0; i < place_.size(); ++i) {
      phs::Pack8 x(0.0);
      std::memcpy(&x, r + i * size_t(n), bytes);
      sides_[size_t(place_[i])] = x;
    }
    factors_.solve(std::span<phs::Pack8>(sides_));
    for (size_t i = 0; i < place_.size(); ++i)
      std::memcpy(r + i * size_t(n), &sides_[size_t(place_[i])], bytes);
  }

  void sweep(const UnitWrench<S>& unit, const Workspace<T>& w) {
    const Block& block = blocks_[size_t(block_of_[size_t(unit.row)])];
    size_t at = in_lanes(block, unit.row - block.row) + block.freedoms.size();  // they descend
    for (const int i : unit.above) {
      beta_[size_t(i)] = passes::zero_force<S>();
      reach_[size_t(i)] = {};
    }
    for (const OnNode<S>* end : {&unit.a, &unit.b})
      if (end->node >= 0) {
        beta_[size_t(end->node)] += end->wrench;
        reach_[size_t(end->node)] += end->reach;
      }
    for (const auto& t : unit.terms) of_terms_[size_t(t.v)] = of_terms_[size_t(t.v)] + T(t.factor);
    Size<S> bound(0.0);
    for (const int i : unit.above) {
      const Node& n = m_.nodes()[size_t(i)];
      Force<S>& beta = beta_[size_t(i)];
      visit_joint(n.type, [&](auto J) {
        unroll_descending<decltype(J)::nv>([&](auto k) {
          const size_t v = size_t(n.v + k);
          const S uk = S(of_terms_[v]) + decltype(J)::template project<k>(n, beta);
          of_terms_[v] = T(0.0);
          bound =
              bound + most_of(axes_[v], reach_[size_t(i)], uk) * Size<S>(size_of(w.D_inverse[v]));
          beta += (-uk) * broadcast(w.K[v]);
          u_[--at] = uk;
          scaled_[at] = uk * S(w.D_inverse[v]);
        });
      });
      if (n.parent < 0) continue;
      beta_[size_t(n.parent)] += converted<S>(w.X[size_t(i)]).to_parent(beta);
      reach_[size_t(n.parent)] += reach_[size_t(i)].moved(Size<S>(lever_[size_t(i)]));
    }
    if constexpr (!phs::is_pack<T>)
      for (int r = 0; r < unit.rows; ++r)
        bound_[size_t(place_[size_t(unit.row + r)])] = Rows::row(bound, r);
  }
  /// Where u of a block's row begins.
  static size_t in_lanes(const Block& block, int row) {
    return block.u + size_t(row / Rows::width) * block.freedoms.size();
  }
  static Force<S> broadcast(const Force<T>& f) { return {Vec3<S>(f.n), Vec3<S>(f.f)}; }
  /// The square of the largest joint force that the wrench could give, at least u².
  static Size<S> most_of(const Reach<double>& axis, const Reach<Size<S>>& reach, const S& u) {
    const Size<S> most = Size<S>(axis.moment) * reach.moment + Size<S>(axis.force) * reach.force;
    const Size<S> size = size_of(u);
    return phs::max(most * most, size * size);
  }

  void multiply(const Meeting& t) {
    const Block &a = blocks_[size_t(t.a)], &b = blocks_[size_t(t.b)];
    T* const to = factors_.elements().data() + t.to.offset;
    for (int i = 0; i < a.rows; ++i) {
      const S* const of_a = scaled_.data() + in_lanes(a, i);
      const int columns = t.a == t.b ? i + 1 : b.rows;
      for (int j = 0; j < columns; j += Rows::width) {
        const S* const of_b = u_.data() + in_lanes(b, j);
        S sum(T(0.0));
        for (size_t c = t.begin; c < t.end; ++c)
          for (int k = 0; k < common_[c].count; ++k)
            sum = sum + S(Rows::row(of_a[common_[c].in_a + k], i % Rows::width)) *
                            of_b[common_[c].in_b + k];
        for (int l = 0; l < Rows::width && j + l < columns; ++l)
          to[size_t(i) * t.to.stride + size_t(j + l)] = Rows::row(sum, l);
      }
    }
  }

  const Mechanism& m_;
  const phs::BlockPattern& pattern_;
  Cholesky factors_;
  std::vector<double> bound_;  ///< of the diagonal, by place
  mutable std::vector<T> x_;   ///< a right-hand side by place
  mutable std::vector<phs::Pack8> sides_;
  std::vector<int> place_, block_of_;  ///< by row
  std::vector<Block> blocks_;
  std::vector<Common> common_;
  std::vector<Meeting> meetings_;
  size_t elements_of_u_ = 0;
  std::vector<S> u_, scaled_;   ///< u_k^r and u_k^r / D_k
  std::vector<Force<S>> beta_;  ///< by node, of the rows being swept
  std::vector<Reach<Size<S>>> reach_;
  std::vector<Size<T>> lever_;       ///< by node: how far its origin is from its parent's
  std::vector<Reach<double>> axes_;  ///< by freedom: the lengths of S's rotation and translation
  std::vector<T> of_terms_;          ///< by freedom: joint forces of the row being swept
};

}  // namespace porthos::mechanics::constraint_detail
