#include <algorithm>

#include "mechanics/constraints/constraint_set.h"
#include "mechanics/constraints/delassus-inl.h"
#include "mechanics/constraints/loop_rows-inl.h"
#include "mechanics/hamiltonian_field.h"
#include "mechanics/passes-inl.h"
#include "phs/scalars/lane.h"

namespace porthos::mechanics {
namespace {

using constraint_detail::RowWrench;

/// The largest number of rows of a loop.
constexpr int most_rows = 6;

template <class T>
class MechanismConstraints final : public phs::Constraints<T> {
  using In = std::span<const T>;
  using Out = std::span<T>;
  struct Placed {
    Transform<T> X;  ///< frame b in frame a
    std::array<RowWrench<T>, most_rows> rows;
  };

 public:
  MechanismConstraints(const Mechanism& m, const ConstraintSet& set)
      : m_(m),
        set_(set),
        w_(m),
        nq_(size_t(m.nq())),
        q_(nq_),
        tau_(size_t(m.nv())),
        loops_(set.loops().size()),
        turned_(set.couplings().size()),
        driven_(turned_.size()),
        delassus_(m, set) {
    renew_turns();
    set_time(T(0.0));
  }

  int count() const override { return set_.count(); }

  void set_time(const T& t) override {
    for (size_t i = 0; i < driven_.size(); ++i)
      if (const auto& c = set_.couplings()[i]; c.position)
        driven_[i] = {(*c.position)(t), (*c.rate)(t)};
  }

  void place(In x, Out g) override {
    std::copy_n(x.begin(), nq_, q_.begin());
    passes::place_joints(m_, w_, q_.data());
    for (size_t i = 0; i < loops_.size(); ++i) {
      const auto& loop = set_.loops()[i];
      const Transform<T> a = pose_of(loop.path_a, loop.pose_a);
      const Transform<T> b = pose_of(loop.path_b, loop.pose_b);
      Placed& p = loops_[i];
      p.X = {{a.R.tmul(b.R.x), a.R.tmul(b.R.y), a.R.tmul(b.R.z)}, a.R.tmul(b.r - a.r)};
      constraint_detail::evaluate_rows(loop, p.X, p.rows.data());
      for (int r = 0; r < loop.size; ++r) g[size_t(loop.at + r)] = p.rows[size_t(r)].g;
    }
    for (size_t i = 0; i < turned_.size(); ++i) {
      const auto& c = set_.couplings()[i];
      T sum(0.0), turned = turned_[i].hi;
      for (const auto& t : c.terms) sum = sum + T(t.factor) * q_[size_t(t.q)];
      if (c.position) turned = turned - driven_[i].position;
      g[size_t(c.at)] = (sum + turned) + turned_[i].lo;
    }
  }

  void forces(In lambda, Out Bl) override {
    std::fill(tau_.begin(), tau_.end(), T(0.0));
    for (size_t i = 0; i < loops_.size(); ++i) {
      const auto& loop = set_.loops()[i];
      const Ends<T> ends = on_ends(loops_[i].X, wrench(i, lambda));
      add_joint_forces(loop.path_a, converted<T>(loop.pose_a).to_parent(ends.a));
      add_joint_forces(loop.path_b, converted<T>(loop.pose_b).to_parent(ends.b));
    }
    for (const auto& c : set_.couplings())
      for (const auto& t : c.terms) {
        T& tau = tau_[size_t(t.v)];
        tau = tau + T(t.factor) * lambda[size_t(c.at)];
      }
    std::fill_n(Bl.begin(), nq_, T(0.0));
    passes::lift(m_, q_.data(), tau_.data(), Bl.data() + nq_);
  }

  void rates(In e, Out g_dot) override {
    passes::transposed_lift(m_, q_.data(), e.data() + nq_, tau_.data());
    for (size_t i = 0; i < loops_.size(); ++i) {
      const auto& loop = set_.loops()[i];
      const Motion<T> a = twist_of(loop.path_a, loop.pose_a);
      Motion<T> b = twist_of(loop.path_b, loop.pose_b);
      const Transform<T>& X = loops_[i].X;
      b = b - X.to_child(a);
      const Motion<T> relative{X.R * b.w, X.R * b.v};
      for (int r = 0; r < loop.size; ++r)
        g_dot[size_t(loop.at + r)] = dot(relative, loops_[i].rows[size_t(r)].w);
    }
    for (const auto& c : set_.couplings()) {
      T sum(0.0);
      for (const auto& t : c.terms) sum = sum + T(t.factor) * tau_[size_t(t.v)];
      g_dot[size_t(c.at)] = sum;
    }
  }

  void add_drift(Out g_dot) override {
    for (size_t i = 0; i < driven_.size(); ++i)
      if (const auto& c = set_.couplings()[i]; c.position)
        g_dot[size_t(c.at)] = g_dot[size_t(c.at)] - driven_[i].rate;
  }

  void exerted(In lambda, Out reactions) const override {
    size_t at = 0;
    for (size_t i = 0; i < loops_.size(); ++i) {
      const auto& loop = set_.loops()[i];
      if (loop.is_rod()) {
        reactions[at++] = lambda[size_t(loop.at)];
        continue;
      }
      const Force<T> w = passes::zero_force<T>() - wrench(i, lambda);
      for (int k = 0; k < 3; ++k) {
        reactions[at + size_t(k)] = w.n[k];
        reactions[at + size_t(3 + k)] = w.f[k];
      }
      at += 6;
    }
    for (const auto& c : set_.couplings())
      for (const auto& t : c.terms) reactions[at++] = T(-t.factor) * lambda[size_t(c.at)];
  }

  void delassus(In x, Out D) override {
    sweep(x);
    delassus_.write(D);
  }
  int factor(In x) override {
    sweep(x);
    return delassus_.factor();
  }
  int rank() const override { return delassus_.rank(); }
  bool uses(int row) const override { return delassus_.uses(row); }
  void solve(Out r) const override { delassus_.solve(r); }
  void solve_all(Out r, int n) const override { delassus_.solve_all(r, n); }
  void shorten(Out lambda) const override { delassus_.shorten(lambda); }
  bool unique(int row) const override { return delassus_.unique(row); }
  double smallest_pivot() const override { return delassus_.smallest_pivot(); }

  void set_turn_angles(In angles) override {
    if (std::equal(angles.begin(), angles.end(), w_.turn_angle.begin(), phs::identical<T>)) return;
    std::copy(angles.begin(), angles.end(), w_.turn_angle.begin());
    renew_turns();
  }

 private:
  struct Words {
    T hi = T(0.0), lo = T(0.0);
  };
  struct Told {
    T position = T(0.0), rate = T(0.0);
  };
  template <class S>
  struct Ends {
    Force<S> a, b;  ///< about the frames' origins, in their axes
  };

  /// Σ λ of its rows, on b about its origin, in a's axes.
  Force<T> wrench(size_t i, In lambda) const {
    const auto& loop = set_.loops()[i];
    Force<T> sum = passes::zero_force<T>();
    for (int r = 0; r < loop.size; ++r)
      sum += lambda[size_t(loop.at + r)] * loops_[i].rows[size_t(r)].w;
    return sum;
  }
  /// The frame in the axes of the common ancestor.
  Transform<T> pose_of(const std::vector<int>& path, const Pose& own) const {
    Transform<T> X = converted<T>(own);
    for (const int i : path) {
      const Node& n = m_.nodes()[size_t(i)];
      visit_joint(n.type, [&](auto J) { X = passes::to_parent<decltype(J)>(n, w_, size_t(i), X); });
    }
    return X;
  }
  /// Its twist relative to the common ancestor, with the joint rates in tau_.
  Motion<T> twist_of(const std::vector<int>& path, const Pose& own) const {
    Motion<T> V = passes::zero_motion<T>();
    for (size_t k = path.size(); k-- > 0;) {
      const size_t i = size_t(path[k]);
      const Node& n = m_.nodes()[i];
      visit_joint(n.type, [&](auto J) {
        if (k + 1 < path.size()) V = passes::to_child<decltype(J)>(n, w_, i, V);
        passes::add_joint_twist<decltype(J)>(n, tau_.data(), V);
      });
    }
    return converted<T>(own).to_child(V);
  }
  /// A wrench on b about its origin in a's axes, and its reaction, on both frames.
  template <class S>
  [[gnu::always_inline]] static Ends<S> on_ends(const Transform<S>& X, const Force<S>& w) {
    const Force<S> back{w.n + cross(X.r, w.f), w.f};
    return {passes::zero_force<S>() - back, {X.R.tmul(w.n), X.R.tmul(w.f)}};
  }
  [[gnu::always_inline]] void add_joint_forces(const std::vector<int>& path, Force<T> f) {
    for (const int i : path) {
      const Node& n = m_.nodes()[size_t(i)];
      visit_joint(n.type, [&](auto J) {
        unroll<decltype(J)::nv>([&](auto k) {
          T& tau = tau_[size_t(n.v + k)];
          tau = tau + decltype(J)::template project<k>(n, f);
        });
        if (i != path.back()) f = passes::to_parent<decltype(J)>(n, w_, size_t(i), f);
      });
    }
  }

  void sweep(In x) {
    rates_from_momenta<T>(m_, w_, x.first(nq_), x.subspan(nq_, nq_));
    passes::place_axial_bodies(m_, w_);
    delassus_.sweep_rows([&](const auto& add) { each_row(add); }, w_);
  }
  /// Calls add() with the unit wrenches of all rows, those of a loop in lanes.
  template <class Add>
  void each_row(const Add& add) const {
    using Rows = constraint_detail::RowLanes<T>;
    using S = typename Rows::S;
    using Unit = constraint_detail::UnitWrench<S>;
    using On = constraint_detail::OnNode<S>;
    for (size_t i = 0; i < loops_.size(); ++i) {
      const auto& loop = set_.loops()[i];
      const auto X = converted<S>(loops_[i].X);
      for (int r = 0; r < loop.size; r += Rows::width) {
        const int rows = std::min(loop.size - r, Rows::width);
        auto w = passes::zero_force<S>();
        for (int l = 0; l < rows; ++l)
          for (int k = 0; k < 6; ++k) Rows::set(w[k], l, loops_[i].rows[size_t(r + l)].w[k]);
        const Ends<S> ends = on_ends(X, w);
        add(Unit{loop.at + r,
                 rows,
                 loop.above,
                 {},
                 On(loop.node_a, converted<S>(loop.pose_a), ends.a),
                 On(loop.node_b, converted<S>(loop.pose_b), ends.b)});
      }
    }
    for (const auto& c : set_.couplings()) add(Unit{c.at, 1, c.above, c.terms, On(), On()});
  }

  /// Σ factor 2π turns - offset of each coupling, in two words: whole turns cancel exactly.
  void renew_turns() {
    for (size_t i = 0; i < turned_.size(); ++i) {
      const auto& c = set_.couplings()[i];
      const auto sum_of = [&](auto turn_angle) {
        const phs::Quad two_pi = phs::Quad(phs::two_pi_hi) + phs::Quad(phs::two_pi_lo);
        phs::Quad sum = -phs::Quad(c.offset);
        for (const auto& t : c.terms) {
          if (t.turn < 0) continue;
          const double turns = std::round(turn_angle(size_t(t.turn)) / phs::two_pi_hi);
          sum += phs::Quad(t.factor) * turns * two_pi;
        }
        return sum;
      };
      if constexpr (phs::is_pack<T>) {
        for (int k = 0; k < phs::lanes<T>; ++k) {
          const phs::Quad sum = sum_of([&](size_t j) { return w_.turn_angle[j][k]; });
          turned_[i].hi.set(k, double(sum));
          turned_[i].lo.set(k, double(sum - phs::Quad(double(sum))));
        }
      } else {
        const phs::Quad sum = sum_of([&](size_t j) { return phs::to_double(w_.turn_angle[j]); });
        if constexpr (std::is_same_v<T, phs::Quad>) {
          turned_[i] = {sum, T(0.0)};
        } else {
          turned_[i] = {T(double(sum)), T(double(sum - phs::Quad(double(sum))))};
        }
      }
    }
  }

  const Mechanism& m_;
  const ConstraintSet& set_;
  Workspace<T> w_;
  size_t nq_;
  std::vector<T> q_, tau_;
  std::vector<Placed> loops_;
  std::vector<Words> turned_;
  std::vector<Told> driven_;  ///< by coupling
  constraint_detail::Delassus<T> delassus_;
};

}  // namespace

template <class T>
std::unique_ptr<phs::Constraints<T>> make_constraints(const Mechanism& m,
                                                      const ConstraintSet& set) {
  return std::make_unique<MechanismConstraints<T>>(m, set);
}
#define PORTHOS_INSTANTIATE(T)                                                        \
  template std::unique_ptr<phs::Constraints<T>> make_constraints<T>(const Mechanism&, \
                                                                    const ConstraintSet&);
PORTHOS_FOR_EACH_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::mechanics
