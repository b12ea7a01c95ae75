#pragma once
#include <array>
#include <cmath>
#include <utility>

#include "contact/detail/step_contacts.h"

namespace porthos::contact {

/// The impulses of a few points of one cluster by Newton's method on Alart and Curnier's equations,
///   P_n = max(0, λ_n),  P_t = λ_t, no longer than μ max(0, λ_n),  λ = P - ρ w(P),
/// inside a proximal iteration, w(P) + δ (P - P of the last round): the points of a rigid body can
/// press against each other in ways that move nothing, so w alone does not tell P. Where they
/// contradict each other a little, sweeps drive that inner stress on for thousands of times until
/// a point slides or parts; here δ does in a round or two.
///
/// Sources: Alart, Curnier 1991; Rockafellar 1976. Cost: O(n³) of n points a pass, no allocation.
class ConeNewton {
 public:
  static constexpr size_t most = 16;  ///< points

  void clear() { n_ = 0; }
  /// @return whether there was room
  bool add(StepContacts::Point& point, double mu) {
    if (n_ == most) return false;
    points_[n_] = &point;
    mu_[n_] = mu;
    ++n_;
    return true;
  }
  /// Changes the impulses, and with them v, what the changes do to joint rates.
  /// @param wanted  largest velocity [m/s] by which the law may fail
  /// @param unit  nv numbers of room
  /// @return whether the law holds; if not the impulses stay
  bool solve(const StepContacts& contacts, double wanted, std::span<double> v,
             std::span<double> unit) {
    enough_ = wanted;
    weigh(contacts, v, unit);
    std::array<Vec3d, most> P = P_;
    double strength = 1e-7;
    bool found = false;
    for (int round = 0; round < 40 && !found; ++round) {
      const auto before = P;
      weight(strength);
      if (!pass(P, before)) {
        P = before;
        if (strength > 1) return false;
        strength *= 30;
        continue;
      }
      double moved = 0;
      for (size_t i = 0; i < n_; ++i) moved = std::max(moved, norm(P[i] - before[i]));
      found = delta_ * moved <= enough_;
      strength = std::max(least, strength / 10);
    }
    if (!found) return false;
    for (size_t i = 0; i < n_; ++i) {
      contacts.add_rates(*points_[i], P[i] - P_[i], v);
      points_[i]->impulse = points_[i]->in_world(P[i]);
    }
    return true;
  }

 private:
  static constexpr size_t size = 3 * most;
  static constexpr double least = 1e-12;  ///< δ in parts of the largest of A

  /// A, and w at the impulses to begin with.
  void weigh(const StepContacts& contacts, std::span<const double> v, std::span<double> unit) {
    largest_ = 0;
    delta_ = 0;
    for (size_t j = 0; j < n_; ++j) {
      P_[j] = points_[j]->in_axes(points_[j]->impulse);
      w_[j] = points_[j]->free + contacts.rates(*points_[j], v) - points_[j]->target;
      for (size_t row = 0; row < 3; ++row) {
        Vec3d e{0, 0, 0};
        (row == 0 ? e.x : row == 1 ? e.y : e.z) = 1;
        std::fill(unit.begin(), unit.end(), 0.0);
        if (row < points_[j]->rows) contacts.add_rates(*points_[j], e, unit);
        for (size_t i = 0; i < n_; ++i) {
          const Vec3d u = contacts.rates(*points_[i], unit);
          for (size_t k = 0; k < 3; ++k) A_[3 * i + k][3 * j + row] = u[int(k)];
        }
        largest_ = std::max(largest_, A_[3 * j + row][3 * j + row]);
      }
    }
  }
  /// δ becomes this part of the largest of A.
  void weight(double part) {
    const double more = part * largest_ - delta_;
    delta_ += more;
    for (size_t i = 0; i < 3 * n_; ++i) A_[i][i] += more;
    for (size_t i = 0; i < n_; ++i)
      rho_[i] = {1 / A_[3 * i][3 * i],
                 1 / std::max(A_[3 * i + 1][3 * i + 1], A_[3 * i + 2][3 * i + 2])};
  }
  /// Solves the law with δ (P - before). @return whether it does
  bool pass(std::array<Vec3d, most>& P, const std::array<Vec3d, most>& before) {
    for (int k = 0; k < 40; ++k) {
      const double off = linearise(P, before);
      if (off <= enough_) return true;
      if (!std::isfinite(off) || !eliminate()) return false;
      for (size_t i = 0; i < n_; ++i) {
        const Vec3d d{b_[3 * i], b_[3 * i + 1], b_[3 * i + 2]};
        P[i] = P[i] + (k % 8 == 7 ? 0.5 : 1.0) * d;  // where it goes to and fro
      }
    }
    return false;
  }
  /// Rows of the Jacobian and minus the equations. @return the largest of these, as a velocity
  double linearise(const std::array<Vec3d, most>& P, const std::array<Vec3d, most>& before) {
    double largest = 0;
    for (size_t i = 0; i < n_; ++i) {
      double w[3];  // w + δ (P - before), with δ in A_
      for (size_t k = 0; k < 3; ++k) {
        w[k] = w_[i][int(k)] + delta_ * (P_[i][int(k)] - before[i][int(k)]);
        for (size_t j = 0; j < n_; ++j)
          for (size_t l = 0; l < 3; ++l)
            w[k] += A_[3 * i + k][3 * j + l] * (P[j][int(l)] - P_[j][int(l)]);
      }
      const double along = P[i].x - rho_[i][0] * w[0], y = P[i].y - rho_[i][1] * w[1],
                   z = P[i].z - rho_[i][1] * w[2], across = std::hypot(y, z);
      double* const rows[3] = {J_[3 * i].data(), J_[3 * i + 1].data(), J_[3 * i + 2].data()};
      const size_t n = 3 * n_;
      for (auto* row : rows) std::fill(row, row + n, 0.0);
      double* const b = b_.data() + 3 * i;
      if (!(along > 0)) {  // parts
        for (size_t k = 0; k < 3; ++k) {
          rows[k][3 * i + k] = 1;
          b[k] = -P[i][int(k)];
        }
      } else {
        const double* const A[3] = {A_[3 * i].data(), A_[3 * i + 1].data(), A_[3 * i + 2].data()};
        for (size_t c = 0; c < n; ++c) rows[0][c] = rho_[i][0] * A[0][c];
        b[0] = -rho_[i][0] * w[0];
        if (points_[i]->rows == 1) {
          for (size_t k = 1; k < 3; ++k) {
            rows[k][3 * i + k] = 1;
            b[k] = -P[i][int(k)];
          }
        } else if (across <= mu_[i] * along) {  // sticks
          for (size_t c = 0; c < n; ++c)
            for (size_t k = 1; k < 3; ++k) rows[k][c] = rho_[i][1] * A[k][c];
          for (size_t k = 1; k < 3; ++k) b[k] = -rho_[i][1] * w[k];
        } else {  // P_t = μ λ_n τ
          const double t[2] = {y / across, z / across}, r = mu_[i] * along / across;
          for (size_t c = 0; c < n; ++c) {
            const double dn = (c == 3 * i) - rho_[i][0] * A[0][c],
                         d1 = (c == 3 * i + 1) - rho_[i][1] * A[1][c],
                         d2 = (c == 3 * i + 2) - rho_[i][1] * A[2][c], dt = t[0] * d1 + t[1] * d2;
            rows[1][c] = (c == 3 * i + 1) - mu_[i] * t[0] * dn - r * (d1 - t[0] * dt);
            rows[2][c] = (c == 3 * i + 2) - mu_[i] * t[1] * dn - r * (d2 - t[1] * dt);
          }
          b[1] = mu_[i] * along * t[0] - P[i].y;
          b[2] = mu_[i] * along * t[1] - P[i].z;
        }
      }
      for (size_t k = 0; k < 3; ++k) largest = std::max(largest, std::fabs(b[k]) / rho_[i][k > 0]);
    }
    return largest;
  }
  /// b = J⁻¹ b with row pivots. @return whether J is regular
  bool eliminate() {
    const size_t n = 3 * n_;
    for (size_t c = 0; c < n; ++c) {
      size_t best = c;
      for (size_t r = c + 1; r < n; ++r)
        if (std::fabs(J_[r][c]) > std::fabs(J_[best][c])) best = r;
      if (!(std::fabs(J_[best][c]) > 0)) return false;
      std::swap(J_[c], J_[best]);
      std::swap(b_[c], b_[best]);
      for (size_t r = c + 1; r < n; ++r) {
        const double f = J_[r][c] / J_[c][c];
        if (f == 0) continue;
        for (size_t k = c + 1; k < n; ++k) J_[r][k] -= f * J_[c][k];
        b_[r] -= f * b_[c];
      }
    }
    for (size_t c = n; c-- > 0;) {
      for (size_t k = c + 1; k < n; ++k) b_[c] -= J_[c][k] * b_[k];
      b_[c] /= J_[c][c];
    }
    return true;
  }

  size_t n_ = 0;
  std::array<StepContacts::Point*, most> points_;
  std::array<Vec3d, most> P_, w_;
  std::array<double, most> mu_;
  std::array<std::array<double, 2>, most> rho_;
  double delta_ = 0, largest_ = 0, enough_ = 0;
  std::array<std::array<double, size>, size> A_, J_;
  std::array<double, size> b_;
};

}  // namespace porthos::contact
