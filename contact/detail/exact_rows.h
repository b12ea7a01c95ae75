#pragma once
#include "contact/detail/coulomb.h"
#include "contact/detail/rigid_gaps.h"

namespace porthos::contact {

/// Rows of rigid contacts at a state in 113 bits, and what takes their rates and gaps to 0.
class ExactRows : public RigidRows<phs::Quad> {
 public:
  using Quad = phs::Quad;
  using State = phs::State;

  explicit ExactRows(const ContactModel& model)
      : RigidRows(model),
        m_(model.mechanism()),
        nq_(size_t(m_.nq())),
        angles_(size_t(m_.angle_count())),
        x_(2 * nq_),
        rates_(size_t(m_.nv())),
        moved_(nq_) {
    const size_t most = gaps.rows();
    independent_.reserve(most);
    axes_.reserve(most);
    rubs.reserve(most);
  }
  std::span<const Quad> q() const { return std::span(x_).first(nq_); }
  std::span<const Quad> p() const { return std::span(x_).subspan(nq_); }

  /// Takes a state, and the gaps there.
  void place(const State& s) {
    for (size_t i = 0; i < 2 * nq_; ++i) x_[i] = Quad(s.x[i]) + s.lo[i];
    for (size_t i = 0; i < angles_.size(); ++i)
      angles_[i] = Quad(double(s.turns[i])) * (Quad(phs::two_pi_hi) + phs::two_pi_lo);
    gaps.set_turn_angles(angles_);
    gaps.place(q());
  }
  using RigidRows::evaluate;
  /// v and W of `rows`.
  void evaluate() { evaluate(q(), p()); }

  /// Adds to the gaps in `rows` the directions across those with friction, as rows and as rubs.
  /// The first direction is that of the slip, or near along(gap) if there is none.
  /// wanted(gap): whether its directions are
  template <class Wanted, class Along>
  void add_across(const std::vector<double>& mu, Wanted wanted, Along along) {
    rubs.clear();
    const size_t normals = rows.size();
    gaps.move(q(), p());
    for (size_t j = 0; j < gaps.rubbing().size(); ++j) {
      const size_t k = gaps.rubbing()[j];
      const auto at = std::find(rows.begin(), rows.begin() + long(normals), k);
      if (at == rows.begin() + long(normals) || !wanted(k)) continue;
      const Vec3<Quad> slip = gaps.slip(k);
      const Vec3d near = along(k);
      gaps.set_across(j,
                      directions_across(gaps.normal(k), dot(slip, slip) > Quad(1e-40)
                                                            ? slip
                                                            : Vec3<Quad>{near.x, near.y, near.z}));
      rubs.push_back({size_t(at - rows.begin()), rows.size(), mu[k], true});
      rows.push_back(gaps.across(j, 0));
      rows.push_back(gaps.across(j, 1));
    }
  }
  /// v := W⁻¹ v; rows that depend on others, or cannot move, get 0. W is overwritten.
  void solve() {
    const size_t m = rows.size();
    axes_.clear();
    for (const Rubbing& r : rubs) {
      axes_.emplace_back(std::span(W), m, r.across, W[r.normal * (m + 1)]);
      axes_.back().turn(v[r.across], v[r.across + 1]);
    }
    std::vector<char>& used = independent_;
    used.assign(m, 1);
    for (size_t i = 0; i < m; ++i) {  // L D Lᵀ in place
      const Quad whole = W[i * m + i];
      for (size_t j = 0; j < i; ++j) {
        if (!used[j]) continue;
        for (size_t k = 0; k < j; ++k)
          if (used[k]) W[i * m + j] -= W[i * m + k] * W[j * m + k] * W[k * m + k];
        W[i * m + j] /= W[j * m + j];
      }
      for (size_t k = 0; k < i; ++k)
        if (used[k]) W[i * m + i] -= W[i * m + k] * W[i * m + k] * W[k * m + k];
      used[i] = W[i * m + i] > Quad(1e-12) * whole;
      if (!used[i]) v[i] = Quad(0.0);
      for (size_t k = 0; used[i] && k < i; ++k)
        if (used[k]) v[i] -= W[i * m + k] * v[k];
    }
    for (size_t i = m; i-- > 0;) {
      if (!used[i]) continue;
      v[i] /= W[i * m + i];
      for (size_t k = i + 1; k < m; ++k)
        if (used[k]) v[i] -= W[k * m + i] * v[k];
    }
    for (size_t i = 0; i < rubs.size(); ++i)
      axes_[i].back(v[rubs[i].across], v[rubs[i].across + 1]);
  }
  /// p += Gᵀ λ.
  void push(State& s, std::span<const Quad> lambda) const {
    for (size_t j = 0; j < nq_; ++j) {
      Quad sum = x_[nq_ + j];
      for (size_t i = 0; i < lambda.size(); ++i) sum += lambda[i] * gradient(i)[j];
      s.x[nq_ + j] = double(sum);
      s.lo[nq_ + j] = double(sum - Quad(s.x[nq_ + j]));
    }
  }
  /// q -= M⁻¹ Gᵀ λ.
  void pull(State& s, std::span<const Quad> lambda) {
    rates_.assign(rates_.size(), Quad(0.0));
    for (size_t i = 0; i < lambda.size(); ++i)
      for (size_t j = 0; j < rates_.size(); ++j) rates_[j] -= lambda[i] * pushed(i)[j];
    mechanics::coordinate_rates<Quad>(m_, q(), rates_, moved_);
    for (size_t j = 0; j < nq_; ++j) phs::compensated_add(s.x[j], s.lo[j], double(moved_[j]));
  }

  std::vector<Rubbing> rubs;  ///< of add_across(), in rows; those that solve() knows

 private:
  const mechanics::Mechanism& m_;
  size_t nq_;
  std::vector<Quad> angles_, x_, rates_, moved_;
  std::vector<char> independent_;
  std::vector<PrincipalAxes<Quad>> axes_;
};

}  // namespace porthos::contact
