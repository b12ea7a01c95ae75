#pragma once
#include <array>
#include <memory>

#include "contact/detail/gaps.h"
#include "mechanics/hamiltonian_field.h"

namespace porthos::contact {

/// Two directions across the unit normal n, the first near `along` if that is not along n.
template <class T>
std::array<Vec3<T>, 2> directions_across(const Vec3<T>& n, const Vec3<T>& along) {
  using phs::sqrt;
  const auto part = [&](const Vec3<T>& v) { return fma(T(-dot(n, v)), n, v); };
  Vec3<T> t = part(along);
  for (const Vec3<T>& axis : {Vec3<T>{T(1.0), T(0.0), T(0.0)}, Vec3<T>{T(0.0), T(1.0), T(0.0)}})
    if (!(dot(t, t) > T(0.1) * dot(along, along))) t = part(axis);
  t = T(T(1.0) / T(sqrt(dot(t, t)))) * t;
  return {t, cross(n, t)};
}

/// The rigid contacts of a model as a list of gaps g(q), with their rates and gradients: first
/// every point of every pair, then the limits of stops.
///
/// A row is a gap, along its normal, or one of two directions across the normal of a gap that has
/// friction: v = t · (velocity of B relative to A) and its gradient.
template <class T>
class RigidGaps {
 public:
  explicit RigidGaps(const ContactModel& model)
      : m_(model.mechanism()),
        kept_(std::make_shared<const ContactModel::Placed>(model.all_rigid())),
        placed_(*kept_),
        gaps_(m_, placed_, Ends::off),
        p_(size_t(m_.nq())) {
    const size_t stops = placed_.stops.size(), contacts = model.rigid().size() - stops;
    for (size_t k = 0; k < placed_.pairs.size(); ++k) {
      const auto& pair = placed_.pairs[k];
      for (size_t i = pair.first; i < pair.first + pair.points; ++i) {
        if (model.rigid()[pair.contact].friction > 0) rubbing_.push_back(all_.size());
        all_.push_back({pair.contact, k, i, false});
      }
    }
    for (size_t s = 0; s < stops; ++s)
      for (size_t side = 0; side < 2; ++side)
        if (std::isfinite(side == 0 ? placed_.stops[s].lower : placed_.stops[s].upper))
          all_.push_back({contacts + s, s, 2 * s + side, true});
    across_.resize(rubbing_.size());
  }
  size_t count() const { return all_.size(); }
  /// The gaps that have friction.
  const std::vector<size_t>& rubbing() const { return rubbing_; }
  /// Row i, 0 or 1, of the directions of gap rubbing()[j].
  size_t across(size_t j, size_t i) const { return count() + 2 * j + i; }
  /// All rows.
  size_t rows() const { return count() + 2 * rubbing_.size(); }
  /// The contact or stop of a gap, an index of ContactModel::rigid().
  size_t rigid(size_t k) const { return all_[k].rigid; }

  void set_turn_angles(std::span<const T> angles) { gaps_.set_turn_angles(angles); }
  void place(std::span<const T> q) { gaps_.place(q); }
  T gap(size_t k) const {
    const Gap& g = all_[k];
    return g.stop ? -gaps_.depth[g.at] : gaps_.touch[g.at].gap;
  }
  const Vec3<T>& normal(size_t k) const { return gaps_.touch[all_[k].at].n; }
  /// Directions of gap rubbing()[j] from now on, across its normal, unit.
  void set_across(size_t j, const std::array<Vec3<T>, 2>& t) { across_[j] = t; }
  /// The rates of all bodies with momenta p; after place() at the same q.
  void move(std::span<const T> q, std::span<const T> p) {
    mechanics::rates_from_momenta<T>(m_, gaps_.w, q, p);
  }
  /// Of a row, at the last move().
  T rate(size_t k) const {
    const Gap& g = of(k);
    if (!g.stop) return dot(direction(k), gaps_.apart(g.of, g.at));
    const T& v = gaps_.w.rate[placed_.stops[g.of].v];
    return g.at % 2 == 0 ? v : -v;
  }
  /// Of gap k, a contact, at the last move(): velocity of B relative to A across its normal.
  Vec3<T> slip(size_t k) const {
    const Vec3<T> v = gaps_.apart(all_[k].of, all_[k].at);
    return fma(T(-dot(normal(k), v)), normal(k), v);
  }
  const std::vector<T>& joint_rates() const { return gaps_.w.rate; }
  /// The row's gradient as momenta p. Valid until the next call.
  std::span<const T> gradient(size_t k, std::span<const T> q) {
    const Gap& g = of(k);
    gaps_.begin_forces();
    if (g.stop)
      gaps_.force[placed_.stops[g.of].v] = T(g.at % 2 == 0 ? 1.0 : -1.0);
    else
      gaps_.push_apart(g.of, g.at, direction(k));
    gaps_.collect();
    mechanics::passes::lift(m_, q.data(), gaps_.force.data(), p_.data());
    return p_;
  }

 private:
  struct Gap {
    size_t rigid, of, at;  ///< of: its pair or stop; at: its point, or 2 stop + side
    bool stop;
  };
  const Gap& of(size_t row) const {
    return all_[row < count() ? row : rubbing_[(row - count()) / 2]];
  }
  const Vec3<T>& direction(size_t row) const {
    return row < count() ? normal(row) : across_[(row - count()) / 2][(row - count()) % 2];
  }

  const mechanics::Mechanism& m_;
  std::shared_ptr<const ContactModel::Placed> kept_;
  const ContactModel::Placed& placed_;
  Gaps<T> gaps_;
  std::vector<T> p_;
  std::vector<Gap> all_;
  std::vector<size_t> rubbing_;
  std::vector<std::array<Vec3<T>, 2>> across_;
};

/// Rows G_k with what they need together: W = G M⁻¹ Gᵀ.
template <class T>
class RigidRows {
 public:
  explicit RigidRows(const ContactModel& model)
      : gaps(model), nq_(size_t(model.mechanism().nq())), nv_(size_t(model.mechanism().nv())) {
    const size_t m = gaps.rows();
    W.reserve(m * m);
    G_.resize(m * nq_);
    pushed_.resize(m * nv_);
    v.reserve(m);
    rows.reserve(m);
  }
  /// Of `rows`, after gaps.place(q): rates v at the momenta p, then W.
  void evaluate(std::span<const T> q, std::span<const T> p) {
    v.resize(rows.size());
    gaps.move(q, p);
    for (size_t i = 0; i < rows.size(); ++i) v[i] = gaps.rate(rows[i]);
    weigh(q);
  }
  /// W of `rows`, after gaps.place(q).
  void weigh(std::span<const T> q) {
    const size_t m = rows.size();
    W.resize(m * m);
    for (size_t i = 0; i < m; ++i) {
      const auto g = gaps.gradient(rows[i], q);
      std::copy(g.begin(), g.end(), G_.begin() + long(i * nq_));
      gaps.move(q, g);
      for (size_t j = 0; j < m; ++j) W[i * m + j] = gaps.rate(rows[j]);
      const auto& rates = gaps.joint_rates();
      std::copy(rates.begin(), rates.end(), pushed_.begin() + long(i * nv_));
    }
    for (size_t i = 0; i < m; ++i)
      for (size_t j = 0; j < i; ++j) W[j * m + i] = W[i * m + j];
  }
  /// G_iᵀ of rows[i] as momenta, and M⁻¹ G_iᵀ as joint rates.
  std::span<const T> gradient(size_t i) const { return std::span(G_).subspan(i * nq_, nq_); }
  std::span<const T> pushed(size_t i) const { return std::span(pushed_).subspan(i * nv_, nv_); }

  RigidGaps<T> gaps;
  std::vector<size_t> rows;
  std::vector<T> v, W;

 private:
  size_t nq_, nv_;
  std::vector<T> G_, pushed_;
};

}  // namespace porthos::contact
