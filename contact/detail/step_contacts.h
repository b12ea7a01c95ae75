#pragma once
#include <array>
#include <cstdint>

#include "contact/detail/cone.h"
#include "contact/detail/near_pairs.h"
#include "contact/detail/rigid_gaps.h"
#include "contact/detail/tree_solve.h"

namespace porthos::contact {

/// The rigid contacts that take part in a step of time stepping, with their rows G: along the
/// normal, and along two directions across it where there is friction. A row is kept for the trees
/// of bodies that it touches, so n bodies with c contacts need O(n + c) numbers.
class StepContacts {
 public:
  struct Gap {
    std::uint64_t gap;  ///< its number among all gaps, the same in every step
    size_t rigid;       ///< its contact or stop, an index of ContactModel::rigid()
    bool stop;
    size_t of, at;  ///< of: its pair or stop; at: its point, or 2 stop + side
  };
  /// A gap that may close in the step.
  struct Point : Gap {
    size_t rows;     ///< 1 or 3
    Vec3d impulse;   ///< of the step, world axes: on B, and its opposite on A; of a stop (P, 0, 0)
    size_t cluster;  ///< which others it can press on: those with the same number, a tree's
    double ahead;    ///< mean velocity that closes a gap which the free step leaves open; else 0
    Vec3d moved, along;  ///< of Cones: the last change of the impulse, and a conjugate direction
    std::array<Vec3d, 3> axes;  ///< the normal, and two across it
    FrictionCone cone;          ///< of half the effect of an impulse
    Vec3d before;               ///< velocity of B relative to A at the start, in `axes`
    Vec3d free;                 ///< mean velocity without the changes of impulses, in `axes`
    Vec3d target;               ///< of Cones: the mean velocity that the law is about
    struct Part {
      size_t tree, v, q;  ///< where its numbers begin
      size_t first, n;    ///< the freedoms of the tree among all, by trees
    };
    std::array<Part, 2> part;
    size_t parts;
    Vec3d in_axes(const Vec3d& u) const {
      return {dot(axes[0], u), dot(axes[1], u), dot(axes[2], u)};
    }
    Vec3d in_world(const Vec3d& u) const { return u.x * axes[0] + u.y * axes[1] + u.z * axes[2]; }
  };

  explicit StepContacts(const ContactModel& model)
      : m_(model.mechanism()),
        rigid_(model.rigid()),
        near_(model),
        gaps_(m_, near_.placed(), Ends::off),
        q_(size_t(m_.nq())),
        p_(q_.size()),
        rate_(size_t(m_.nv())),
        end_seat_(gaps_.seat.size()),
        of_node_(m_.nodes().size()) {
    for (size_t i = 0; i < of_node_.size(); ++i) {
      const mechanics::Node& n = m_.nodes()[i];
      of_node_[i] = n.parent < 0 ? trees_.size() : of_node_[size_t(n.parent)];
      if (n.parent < 0) trees_.emplace_back();
      Tree& tree = trees_[of_node_[i]];
      tree.nodes.push_back(i);
      mechanics::visit_joint(n.type, [&](auto J) {
        for (int k = 0; k < decltype(J)::nv; ++k) tree.v.push_back(size_t(n.v + k));
        for (int k = 0; k < decltype(J)::nq; ++k) tree.q.push_back(size_t(n.q + k));
      });
    }
    of_freedom_.resize(size_t(m_.nv()));
    size_t first = 0;
    for (size_t k = 0; k < trees_.size(); ++k) {
      trees_[k].first = std::exchange(first, first + trees_[k].v.size());
      for (const size_t v : trees_[k].v) of_freedom_[v] = k;
    }
    cluster_.resize(trees_.size());
  }

  /// Above every Point::gap.
  std::uint64_t count() const {
    return near_.numbers() * most_points + 2 * near_.placed().stops.size();
  }
  /// At most so many impulses are kept from step to step. Bodies of many corners may have more.
  size_t most_remembered() const {
    const auto most = 16 * near_.placed().seats.size() + 2 * near_.placed().stops.size();
    return size_t(std::min<std::uint64_t>(count(), most));
  }
  void set_turn_angles(std::span<const double> angles) { gaps_.set_turn_angles(angles); }

  /// Takes the gaps that are closed at q, or at `end`, where the bodies would go in the step h
  /// without contacts, or would be if only one of the two went there.
  /// impulse(gap): that to begin with
  template <class Impulse>
  void choose(std::span<const double> q, std::span<const double> end, double h,
              const Impulse& impulse) {
    gaps_.place_bodies(end);
    std::copy(gaps_.seat.begin(), gaps_.seat.end(), end_seat_.begin());
    end_depth_ = gaps_.depth;
    gaps_.place_bodies(q);
    near_.find(gaps_.seat, end_seat_);
    gaps_.place_pairs();
    points.clear();
    const auto take = [&](const Gap& one, double start, double at_end, double reach) {
      const bool closes = std::min(start, at_end) <= 0;
      if (!closes && !(start <= reach)) return;
      Point each{};
      static_cast<Gap&>(each) = one;
      each.ahead = closes ? 0 : -start / std::fabs(h);
      each.rows = rigid_[each.rigid].friction > 0 ? 3 : 1;
      each.impulse = impulse(each.gap);
      each.axes = {Vec3d{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
      belong(each);
      points.push_back(each);
    };
    const auto& [seats, pairs, stops, count] = near_.placed();
    std::array<Touch<double>, most_points> at_end;
    for (size_t k = 0; k < pairs.size(); ++k) {
      const auto& [contact, a, b, first, n] = pairs[k];
      const Pose &A = end_seat_[a], &B = end_seat_[b];
      touches<double>(seats[a].shape, seats[b].shape, {A.R, B.R, B.r - A.r},
                      std::span(at_end).first(n), Ends::off);
      const double reach = NearPairs::moved(gaps_.seat[a], A) + NearPairs::moved(gaps_.seat[b], B);
      for (size_t i = 0; i < n; ++i)
        take({.gap = near_.number(k) * most_points + i,
              .rigid = contact,
              .stop = false,
              .of = k,
              .at = first + i},
             gaps_.touch[first + i].gap, at_end[i].gap, reach);
    }
    for (size_t k = 0; k < 2 * stops.size(); ++k) {
      const auto& stop = stops[k / 2];
      if (std::isfinite(k % 2 == 0 ? stop.lower : stop.upper))
        take({.gap = near_.numbers() * most_points + k,
              .rigid = rigid_.size() - stops.size() + k / 2,
              .stop = true,
              .of = k / 2,
              .at = k},
             -gaps_.depth[k], -end_depth_[k], 0);
    }
    cluster();
  }
  size_t clusters() const { return trees_.size(); }  ///< above every Point::cluster

  /// The rows at q, and what impulses along them do. q_dot: rates of the coordinates at the start.
  /// The velocities there are taken by these rows too: those of points of one body agree with each
  /// other and with the step.
  void place(std::span<const double> q, std::span<const double> q_dot) {
    std::copy(q.begin(), q.end(), q_.begin());
    gaps_.place_bodies(q);
    size_t v = 0, at_q = 0;
    for (Point& each : points) {
      if (!each.stop) {
        if (&each == points.data() || (&each)[-1].stop || (&each)[-1].of != each.of)
          gaps_.place_pair(each.of);
        const auto across = directions_across<double>(gaps_.touch[each.at].n, each.axes[1]);
        each.axes = {gaps_.touch[each.at].n, across[0], across[1]};
      }
      for (size_t i = 0; i < each.parts; ++i) {
        const Tree& tree = trees_[each.part[i].tree];
        each.part[i] = {each.part[i].tree, v, at_q, tree.first, tree.v.size()};
        v += each.rows * tree.v.size();
        at_q += each.rows * tree.q.size();
      }
    }
    for (auto* rows : {&G_, &pushed_}) rows->resize(std::max(rows->size(), v));
    if (lifted_.size() < at_q) lifted_.resize(at_q);
    std::fill(p_.begin(), p_.end(), 0.0);
    mechanics::rates_from_momenta<double>(m_, gaps_.w, q_, p_);  // factors the masses
    for (Point& each : points) {
      for (size_t i = 0; i < each.parts; ++i)
        for (size_t row = 0; row < each.rows; ++row) find_row(each, each.part[i], row);
      weigh(each);
      each.before = lifted_rates(each, q_dot);
    }
  }

  /// Of every point, at the q of place(): the mean velocity where the mean coordinate rates are
  /// q_dot and the mean momenta still change by `change`.
  void free_velocities(std::span<const double> q_dot, std::span<const double> change) {
    mechanics::rates_from_momenta<double>(m_, gaps_.w, q_, change);
    size_t at = 0;
    for (const Tree& tree : trees_)
      for (const size_t v : tree.v) rate_[at++] = gaps_.w.rate[v];
    for (Point& each : points) each.free = rates(each, rate_) + lifted_rates(each, q_dot);
  }
  /// v += half of what an impulse of a point, in its axes, does to joint rates, by trees.
  void add_rates(const Point& each, const Vec3d& impulse, std::span<double> v) const {
    const Vec3d half = 0.5 * impulse;
    for (size_t k = 0; k < each.parts; ++k) {
      const auto& part = each.part[k];
      const double* const M = pushed_.data() + part.v;
      double* const x = v.data() + part.first;
      const auto add = [&](size_t n) {
        if (each.rows == 1)
          for (size_t i = 0; i < n; ++i) x[i] += half.x * M[i];
        else
          for (size_t i = 0; i < n; ++i)
            x[i] += half.x * M[i] + half.y * M[n + i] + half.z * M[2 * n + i];
      };
      part.n == 6 ? add(6) : add(part.n);  // a size that is known is faster
    }
  }
  /// G v of a point, in its axes.
  Vec3d rates(const Point& each, std::span<const double> v) const {
    Vec3d u{0, 0, 0};
    for (size_t k = 0; k < each.parts; ++k) {
      const auto& part = each.part[k];
      const double *const G = G_.data() + part.v, *const x = v.data() + part.first;
      const auto add = [&](size_t n) {
        for (size_t i = 0; i < n; ++i) u.x += G[i] * x[i];
        if (each.rows == 1) return;
        for (size_t i = 0; i < n; ++i) {
          u.y += G[n + i] * x[i];
          u.z += G[2 * n + i] * x[i];
        }
      };
      part.n == 6 ? add(6) : add(part.n);
    }
    return u;
  }
  /// p += Gᵀ P of a point.
  void add_momenta(const Point& each, std::span<double> p) const {
    const Vec3d impulse = each.in_axes(each.impulse);
    over_parts(each, [&](const Tree& tree, size_t row, size_t, size_t at_q) {
      for (size_t i = 0; i < tree.q.size(); ++i)
        p[tree.q[i]] += impulse[int(row)] * lifted_[at_q + i];
    });
  }

  std::vector<Point> points;  ///< of the last choose()

 private:
  /// Bodies that joints connect, with their freedoms and coordinates.
  struct Tree {
    std::vector<size_t> nodes, v, q;
    size_t first = 0;  ///< of its freedoms, by trees
  };

  /// The trees that a point touches.
  void belong(Point& each) const {
    each.parts = 0;
    const auto add = [&](size_t tree) {
      if (each.parts == 0 || each.part[0].tree != tree) each.part[each.parts++].tree = tree;
    };
    if (each.stop) return add(of_freedom_[near_.placed().stops[each.of].v]);
    const auto [a, b] = gaps_.nodes(each.of);
    if (a >= 0) add(of_node_[size_t(a)]);
    if (b >= 0) add(of_node_[size_t(b)]);
  }
  Vec3d lifted_rates(const Point& each, std::span<const double> q_dot) const {
    double u[3] = {0, 0, 0};
    over_parts(each, [&](const Tree& tree, size_t row, size_t, size_t at_q) {
      for (size_t i = 0; i < tree.q.size(); ++i) u[row] += lifted_[at_q + i] * q_dot[tree.q[i]];
    });
    return {u[0], u[1], u[2]};
  }
  void cluster() {
    for (size_t i = 0; i < cluster_.size(); ++i) cluster_[i] = i;
    const auto root = [&](size_t i) {
      while (cluster_[i] != i) i = cluster_[i] = cluster_[cluster_[i]];
      return i;
    };
    for (const Point& each : points)
      if (each.parts == 2) cluster_[root(each.part[0].tree)] = root(each.part[1].tree);
    for (Point& each : points) each.cluster = root(each.part[0].tree);
  }
  /// A row of a point in one tree, with the masses factored in gaps_.w.
  void find_row(const Point& each, const typename Point::Part& part, size_t row) {
    const Tree& tree = trees_[part.tree];
    for (const size_t v : tree.v) gaps_.force[v] = 0;
    if (each.stop) {
      gaps_.force[near_.placed().stops[each.of].v] = each.at % 2 == 0 ? 1 : -1;
    } else {
      for (const size_t i : tree.nodes) gaps_.w.g[i] = mechanics::passes::zero_force<double>();
      gaps_.push_apart(each.of, each.at, each.axes[row]);
      gaps_.collect(tree.nodes);
    }
    const size_t v = part.v + row * tree.v.size(), at_q = part.q + row * tree.q.size();
    for (size_t j = 0; j < tree.v.size(); ++j) G_[v + j] = gaps_.force[tree.v[j]];
    for (const size_t i : tree.nodes) {
      const mechanics::Node& n = m_.nodes()[i];
      mechanics::visit_joint(n.type, [&](auto J) {
        decltype(J)::lift(q_.data() + n.q, gaps_.force.data() + n.v, p_.data() + n.q);
      });
    }
    for (size_t j = 0; j < tree.q.size(); ++j) lifted_[at_q + j] = p_[tree.q[j]];
    solve_tree<double>(m_, gaps_.w, tree.nodes, gaps_.force.data());
    for (size_t j = 0; j < tree.v.size(); ++j) pushed_[v + j] = gaps_.w.rate[tree.v[j]];
  }
  template <class F>
  void over_parts(const Point& each, const F& f) const {
    for (size_t i = 0; i < each.parts; ++i) {
      const Tree& tree = trees_[each.part[i].tree];
      for (size_t row = 0; row < each.rows; ++row)
        f(tree, row, each.part[i].v + row * tree.v.size(), each.part[i].q + row * tree.q.size());
    }
  }
  /// The cone of a point, whose axes across turn to those that it wants.
  void weigh(Point& each) {
    double A[3][3] = {};
    for (size_t k = 0; k < each.parts; ++k) {
      const Tree& tree = trees_[each.part[k].tree];
      const size_t n = tree.v.size();
      for (size_t i = 0; i < each.rows; ++i)
        for (size_t j = 0; j < each.rows; ++j)
          for (size_t l = 0; l < n; ++l)
            A[i][j] += 0.5 * G_[each.part[k].v + i * n + l] * pushed_[each.part[k].v + j * n + l];
    }
    const double mu = rigid_[each.rigid].friction, nn = A[0][0];
    if (each.rows == 1 || !(nn > 0)) {
      each.cone = FrictionCone(nn, 0, 0, 0, 0, 0);
      return;
    }
    const double s11 = A[1][1] - A[0][1] * A[0][1] / nn, s22 = A[2][2] - A[0][2] * A[0][2] / nn,
                 s12 = 0.5 * (A[1][2] + A[2][1]) - A[0][1] * A[0][2] / nn;
    const double angle = 0.5 * std::atan2(2 * s12, s11 - s22), c = std::cos(angle),
                 s = std::sin(angle);
    const auto turn = [&](auto& x, auto& y) {
      const auto first = c * x + s * y, second = c * y - s * x;
      x = first, y = second;
    };
    turn(each.axes[1], each.axes[2]);
    for (size_t k = 0; k < each.parts; ++k) {
      const Tree& tree = trees_[each.part[k].tree];
      const size_t n = tree.v.size(), nq = tree.q.size();
      for (size_t l = 0; l < n; ++l)
        for (auto* rows : {&G_, &pushed_})
          turn((*rows)[each.part[k].v + n + l], (*rows)[each.part[k].v + 2 * n + l]);
      for (size_t l = 0; l < nq; ++l)
        turn(lifted_[each.part[k].q + nq + l], lifted_[each.part[k].q + 2 * nq + l]);
    }
    double a1 = A[0][1], a2 = A[0][2];
    turn(a1, a2);
    each.cone = FrictionCone(nn, a1, a2, c * c * s11 + 2 * c * s * s12 + s * s * s22,
                             c * c * s22 - 2 * c * s * s12 + s * s * s11, mu);
  }

  const mechanics::Mechanism& m_;
  const std::vector<ContactModel::Rigid>& rigid_;
  NearPairs near_;
  Gaps<double> gaps_;
  std::vector<double> q_, p_, rate_;  ///< rate_: of the freedoms, by trees
  std::vector<Pose> end_seat_;        ///< the surfaces at the end of the free step
  std::vector<double> end_depth_;
  std::vector<Tree> trees_;
  std::vector<size_t> of_node_, of_freedom_;  ///< the tree of each
  std::vector<size_t> cluster_;               ///< of trees: the next one on the way to its root
  std::vector<double> G_, pushed_, lifted_;   ///< Gᵀ as joint forces, M⁻¹Gᵀ, Gᵀ as momenta
};

}  // namespace porthos::contact
