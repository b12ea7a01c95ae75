#pragma once
#include <algorithm>
#include <span>
#include <vector>

#include "phs/functions/tank.h"
#include "phs/network/detail/network_plan.h"

namespace porthos::phs {

/// α(E) of a tank.
template <class T>
T share_of(const Network::Plan::Tank& k, const T& E) {
  return tank_share(E, k.least, k.most);
}

/// What flows through the tanks of a network. With e the efforts (∂H/∂E = 1, or what a discrete
/// gradient has for it), a controller acts as u += α κ e_E and E' = -α κ·y, which is skew.
template <class T>
class TankFlows {
  using In = std::span<const T>;
  using Out = std::span<T>;

 public:
  explicit TankFlows(const Network::Plan& p) : p_(p), drawn_(p.tanks.size()) {}

  /// Begins at the flows y of efforts e, with the dampers.
  void begin(In e, const std::vector<T>& y, std::vector<T>& v) {
    std::fill(drawn_.begin(), drawn_.end(), T(0.0));
    for (const auto& f : p_.filling) {
      const T part = T(1 - f.fill) + T(f.fill) * e[size_t(p_.tanks[size_t(f.tank)].x)];
      for (size_t k = 0; k < f.rows.size(); ++k) {
        const auto row = size_t(f.rows[k]);
        v[row] = v[row] - T(f.d[k]) * part * y[row];
        draw(f.tank, T(-f.fill * f.d[k]) * y[row] * y[row]);
      }
    }
  }
  /// The factor α e_E of a law with the power κ·y; 1 without a tank.
  T factor(int tank, In x, In e) const {
    if (tank < 0) return T(1.0);
    const auto& k = p_.tanks[size_t(tank)];
    return share_of(k, x[size_t(k.x)]) * e[size_t(k.x)];
  }
  /// The same of a law with a tank, which pays.
  T pay(int tank, In x, In e, const T& power) {
    const auto& k = p_.tanks[size_t(tank)];
    const T share = share_of(k, x[size_t(k.x)]);
    draw(tank, share * power);
    return share * e[size_t(k.x)];
  }
  /// To dE/dt.
  void add_rates(In x, In e, Out dx) const {
    for (size_t i = 0; i < p_.tanks.size(); ++i) {
      T& to = dx[size_t(p_.tanks[i].x)];
      to = to - drawn_[i] - valve(i, x) * e[size_t(p_.tanks[i].x)];
    }
  }
  /// The losses of dampers, then those of valves, from place k on. @return the place after them
  size_t powers(In x, In e, const std::vector<T>& y, Out values, size_t k) const {
    for (const auto& f : p_.filling) {
      T lost(0.0);
      for (size_t j = 0; j < f.rows.size(); ++j) {
        const T& rate = y[size_t(f.rows[j])];
        lost = lost + T((1 - f.fill) * f.d[j]) * rate * rate;
      }
      values[k++] = lost;
    }
    for (size_t i = 0; i < p_.tanks.size(); ++i) {
      const T& own = e[size_t(p_.tanks[i].x)];
      values[k++] = valve(i, x) * own * own;
    }
    return k;
  }

 private:
  void draw(int tank, const T& power) { drawn_[size_t(tank)] = drawn_[size_t(tank)] + power; }
  /// What leaves tank i through its valve.
  T valve(size_t i, In x) const {
    const auto& k = p_.tanks[i];
    return tank_overflow(x[size_t(k.x)], k.least, k.most, -drawn_[i]);
  }

  const Network::Plan& p_;
  std::vector<T> drawn_;  ///< by tank: the power that leaves it
};

}  // namespace porthos::phs
