#pragma once
#include <array>
#include <bit>

#include "contact/detail/cone.h"
#include "contact/detail/rigid_gaps.h"

namespace porthos::contact {

/// The rigid contacts that take part in a step of time stepping, with their rows G: along the
/// normal, and along two directions across it where there is friction. A row is kept for the trees
/// of bodies that it touches, so n bodies with c contacts need O(n + c) numbers.
class StepContacts {
 public:
  /// A gap that may close in the step.
  struct Point {
    size_t gap;      ///< of all gaps
    size_t rows;     ///< 1 or 3
    Vec3d impulse;   ///< of the step, world axes: on B, and its opposite on A; of a stop (P, 0, 0)
    size_t cluster;  ///< which others it can press on: those with the same number, a tree's
    double ahead;    ///< mean velocity that closes a gap which the free step leaves open; else 0
    Vec3d moved, along;  ///< of Cones: the last change of the impulse, and a conjugate direction
    std::array<Vec3d, 3> axes;  ///< the normal, and two across it
    FrictionCone cone;          ///< of half the effect of an impulse
    Vec3d before;               ///< velocity of B relative to A at the start, in `axes`
    Vec3d free;                 ///< mean velocity without the changes of impulses, in `axes`
    struct Part {
      size_t tree, v, q;  ///< where its numbers begin
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
        placed_(model.placed_rigid()),
        gaps_(m_, placed_),
        q_(size_t(m_.nq())),
        p_(q_.size()) {
    const auto& nodes = m_.nodes();
    std::vector<size_t> tree(nodes.size());
    of_freedom_.resize(size_t(m_.nv()));
    for (size_t i = 0; i < nodes.size(); ++i) {
      const mechanics::Node& n = nodes[i];
      if (n.parent < 0) {
        tree[i] = trees_.size();
        trees_.emplace_back();
      } else {
        tree[i] = tree[size_t(n.parent)];
      }
      mechanics::visit_joint(n.type, [&](auto J) {
        for (int k = 0; k < decltype(J)::nv; ++k) {
          trees_[tree[i]].v.push_back(size_t(n.v + k));
          of_freedom_[size_t(n.v + k)] = tree[i];
        }
        for (int k = 0; k < decltype(J)::nq; ++k) trees_[tree[i]].q.push_back(size_t(n.q + k));
      });
    }
    const auto of_node = [&](int node) { return node < 0 ? nowhere : tree[size_t(node)]; };
    for (size_t k = 0; k < placed_.pairs.size(); ++k) {
      const auto& pair = placed_.pairs[k];
      for (size_t i = pair.first; i < pair.first + pair.points; ++i)
        all_.push_back({pair.contact, k, i, false, of_node(pair.node_a), of_node(pair.node_b)});
    }
    const size_t contacts = rigid_.size() - placed_.stops.size();
    for (size_t s = 0; s < placed_.stops.size(); ++s)
      for (size_t side = 0; side < 2; ++side)
        if (std::isfinite(side == 0 ? placed_.stops[s].lower : placed_.stops[s].upper))
          all_.push_back(
              {contacts + s, s, 2 * s + side, true, of_freedom_[placed_.stops[s].v], nowhere});
    end_.resize(all_.size());
    used_.resize(trees_.size());
    cluster_.resize(trees_.size());
    place_of_.resize(2 * placed_.pairs.size());
  }

  size_t count() const { return all_.size(); }
  /// The contact or stop of a gap, an index of ContactModel::rigid().
  size_t rigid(size_t gap) const { return all_[gap].rigid; }
  void set_turn_angles(std::span<const double> angles) { gaps_.set_turn_angles(angles); }

  /// Takes the gaps that are closed at q, or at `end`, where the bodies would go in the step h
  /// without contacts, or would be if only one of the two went there.
  /// impulse(gap): that to begin with
  template <class Impulse>
  void choose(std::span<const double> q, std::span<const double> end, double h,
              const Impulse& impulse) {
    gaps_.place(end);
    for (size_t k = 0; k < all_.size(); ++k) end_[k] = gap(k);
    for (size_t k = 0; k < placed_.pairs.size(); ++k) {
      place_of_[2 * k] = gaps_.origin[k];
      place_of_[2 * k + 1] = gaps_.origin[k] + gaps_.d[k];
    }
    gaps_.place(q);
    points.clear();
    for (size_t k = 0; k < all_.size(); ++k) {
      const double start = gap(k);
      const bool closes = std::min(start, end_[k]) <= 0;
      if (!closes && !(start <= reach(all_[k]))) continue;
      Point each{};
      each.ahead = closes ? 0 : -start / std::fabs(h);
      each.gap = k;
      each.rows = rigid_[all_[k].rigid].friction > 0 ? 3 : 1;
      each.impulse = impulse(k);
      each.axes = {Vec3d{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
      points.push_back(each);
    }
    if (points.empty()) return;
    colour();
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
      const Gap& g = all_[each.gap];
      if (!g.stop) {
        gaps_.place_pair(g.of);
        const auto across = directions_across<double>(gaps_.touch[g.at].n, each.axes[1]);
        each.axes = {gaps_.touch[g.at].n, across[0], across[1]};
      }
      for (size_t i = 0; i < each.parts; ++i) {
        each.part[i].v = v;
        each.part[i].q = at_q;
        v += each.rows * trees_[each.part[i].tree].v.size();
        at_q += each.rows * trees_[each.part[i].tree].q.size();
      }
    }
    if (G_.size() < v) G_.resize(v), pushed_.resize(v);
    if (lifted_.size() < at_q) lifted_.resize(at_q);
    for (size_t c = 0; c < colours_; ++c)
      for (size_t row = 0; row < 3; ++row) push(c, row);
    for (Point& each : points) {
      weigh(each);
      each.before = lifted_rates(each, q_dot);
    }
  }

  /// Of every point, at the q of place(): the mean velocity where the mean coordinate rates are
  /// q_dot and the mean momenta still change by `change`.
  void free_velocities(std::span<const double> q_dot, std::span<const double> change) {
    mechanics::rates_from_momenta<double>(m_, gaps_.w, q_, change);
    for (Point& each : points) each.free = rates(each, gaps_.w.rate) + lifted_rates(each, q_dot);
  }
  /// v += half of what an impulse of a point, in its axes, does to joint rates.
  void add_rates(const Point& each, const Vec3d& impulse, std::span<double> v) const {
    over_parts(each, [&](const Tree& tree, size_t row, size_t at_v, size_t) {
      for (size_t i = 0; i < tree.v.size(); ++i)
        v[tree.v[i]] += 0.5 * impulse[int(row)] * pushed_[at_v + i];
    });
  }
  /// G v of a point, in its axes.
  Vec3d rates(const Point& each, std::span<const double> v) const {
    double u[3] = {0, 0, 0};
    over_parts(each, [&](const Tree& tree, size_t row, size_t at_v, size_t) {
      for (size_t i = 0; i < tree.v.size(); ++i) u[row] += G_[at_v + i] * v[tree.v[i]];
    });
    return {u[0], u[1], u[2]};
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
  static constexpr size_t nowhere = size_t(-1);
  struct Gap {
    size_t rigid, of, at;  ///< of: its pair or stop; at: its point, or 2 stop + side
    bool stop;
    size_t a, b;  ///< trees, or nowhere
  };
  /// The freedoms and coordinates of bodies that joints connect.
  struct Tree {
    std::vector<size_t> v, q;
  };

  double gap(size_t k) const {
    const Gap& g = all_[k];
    return g.stop ? -gaps_.depth[g.at] : gaps_.touch[g.at].gap;
  }
  Vec3d lifted_rates(const Point& each, std::span<const double> q_dot) const {
    double u[3] = {0, 0, 0};
    over_parts(each, [&](const Tree& tree, size_t row, size_t, size_t at_q) {
      for (size_t i = 0; i < tree.q.size(); ++i) u[row] += lifted_[at_q + i] * q_dot[tree.q[i]];
    });
    return {u[0], u[1], u[2]};
  }
  /// How far the two shapes of a gap go in the free step, together.
  double reach(const Gap& g) const {
    if (g.stop) return 0;
    return 1e-9 + norm(gaps_.origin[g.of] - place_of_[2 * g.of]) +
           norm(gaps_.origin[g.of] + gaps_.d[g.of] - place_of_[2 * g.of + 1]);
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
  /// Points of one colour touch different trees: their rows are found together.
  void colour() {
    std::fill(used_.begin(), used_.end(), 0);
    colour_.resize(points.size());
    colours_ = 0;
    for (size_t k = 0; k < points.size(); ++k) {
      const Gap& g = all_[points[k].gap];
      points[k].parts = 0;
      for (const size_t tree : {g.a, g.b})
        if (tree != nowhere && !(tree == g.b && g.a == g.b && points[k].parts == 1))
          points[k].part[points[k].parts++].tree = tree;
      std::uint64_t taken = 0;
      for (size_t i = 0; i < points[k].parts; ++i) taken |= used_[points[k].part[i].tree];
      size_t c = size_t(std::countr_one(taken));
      if (c < 64)
        for (size_t i = 0; i < points[k].parts; ++i)
          used_[points[k].part[i].tree] |= std::uint64_t(1) << c;
      else
        c = std::max(colours_, c);  // one of its own
      colour_[k] = c;
      colours_ = std::max(colours_, c + 1);
    }
  }
  /// A row of all points of a colour.
  void push(size_t colour, size_t row) {
    bool any = false;
    gaps_.begin_forces();
    for (size_t k = 0; k < points.size(); ++k) {
      if (colour_[k] != colour || row >= points[k].rows) continue;
      const Gap& g = all_[points[k].gap];
      if (g.stop)
        gaps_.force[placed_.stops[g.of].v] = g.at % 2 == 0 ? 1 : -1;
      else
        gaps_.push_apart(g.of, g.at, points[k].axes[row]);
      any = true;
    }
    if (!any) return;
    gaps_.collect();
    mechanics::passes::lift(m_, q_.data(), gaps_.force.data(), p_.data());
    mechanics::rates_from_momenta<double>(m_, gaps_.w, q_, p_);
    for (size_t k = 0; k < points.size(); ++k) {
      if (colour_[k] != colour || row >= points[k].rows) continue;
      for (size_t i = 0; i < points[k].parts; ++i) {
        const auto& part = points[k].part[i];
        const Tree& tree = trees_[part.tree];
        const size_t v = part.v + row * tree.v.size(), at_q = part.q + row * tree.q.size();
        for (size_t j = 0; j < tree.v.size(); ++j) {
          G_[v + j] = gaps_.force[tree.v[j]];
          pushed_[v + j] = gaps_.w.rate[tree.v[j]];
        }
        for (size_t j = 0; j < tree.q.size(); ++j) lifted_[at_q + j] = p_[tree.q[j]];
      }
    }
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
    const double mu = rigid_[all_[each.gap].rigid].friction, nn = A[0][0];
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
  const ContactModel::Placed& placed_;
  Gaps<double> gaps_;
  std::vector<double> q_, p_;
  std::vector<Gap> all_;
  std::vector<Tree> trees_;
  std::vector<size_t> of_freedom_;   ///< the tree of each
  std::vector<double> end_;          ///< of each gap
  std::vector<size_t> cluster_;      ///< of trees: the next one on the way to its root
  std::vector<Vec3d> place_of_;      ///< of the shapes of each pair, at the end of the free step
  std::vector<std::uint64_t> used_;  ///< by tree: colours of its points
  std::vector<size_t> colour_;       ///< of points
  size_t colours_ = 0;
  std::vector<double> G_, pushed_, lifted_;  ///< Gᵀ as joint forces, M⁻¹Gᵀ, Gᵀ as momenta
};

}  // namespace porthos::contact
