#pragma once
#include <algorithm>
#include <memory>
#include <numbers>
#include <random>
#include <span>
#include <vector>

#include "energy_shaping/laws/joint_swing_up.h"
#include "mechanics/aba.h"
#include "mechanics/crba.h"

/// The laws of JointSwingUp and what they need of the plant.
namespace porthos::energy_shaping {

using SwingData = std::shared_ptr<const JointSwingUp::Data>;

/// What the law needs of the plant at a state.
template <class T>
class SwingPlant {
 public:
  explicit SwingPlant(const SwingData& data)
      : data_(data),
        m_(data->plant->mechanism()),
        w_(m_),
        system_(data->plant->template instantiate<T>()),
        tau_(size_t(m_.nv())),
        free_(tau_.size()),
        pushed_(tau_.size()),
        mass_(tau_.size() * tau_.size()) {}

  void look(std::span<const T> x) {
    const size_t n = tau_.size(), joint = data_->joint;
    const auto q = x.first(n);
    mechanics::rates_from_momenta<T>(m_, w_, q, x.subspan(n, n));
    const std::vector<T>& v = v_ = w_.rate;  // aba() overwrites the workspace
    rate = v[joint];
    energy = system_->hamiltonian(x);
    std::fill(tau_.begin(), tau_.end(), T(0.0));
    friction = T(0.0);
    for (const auto& j : m_.joint_properties()) {
      const auto k = size_t(j.v);
      tau_[k] = tau_[k] - T(j.stiffness) * (x[size_t(j.q)] - T(j.rest));
      if (k == joint)
        friction = friction + T(j.damping) * rate;  // the law cancels it
      else
        tau_[k] = tau_[k] - T(j.damping) * v[k];
    }
    mechanics::aba<T>(m_, w_, q, v, {tau_, {}}, free_);
    tau_[joint] = tau_[joint] + T(1.0);
    mechanics::aba<T>(m_, w_, q, v, {tau_, {}}, pushed_);
    acceleration = free_[joint];
    mobility = pushed_[joint] - free_[joint];
    if (data_->gains.pump > 0) look_at_rest(x);
  }

  T rate{}, energy{}, friction{};
  T acceleration{};  ///< a of the driven joint, without its friction
  T mobility{};      ///< m = (M⁻¹)_aa
  // of a pump only
  T inertia{};   ///< M_aa
  T coupling{};  ///< h = Σ M_ak q'_k of the other joints k
  T others{};    ///< E of the other joints: H without the motion of the driven one

 private:
  void look_at_rest(std::span<const T> x) {
    const size_t n = tau_.size(), joint = data_->joint;
    mechanics::crba<T>(m_, w_, x.first(n), mass_);
    inertia = mass_[joint * n + joint];
    const T p = x[n + joint];
    coupling = p - inertia * rate;
    others = energy - rate * p + T(0.5) * inertia * rate * rate;
  }

  SwingData data_;
  const mechanics::Mechanism& m_;
  mechanics::Workspace<T> w_;
  std::unique_ptr<phs::System<T>> system_;
  std::vector<T> tau_, v_, free_, pushed_, mass_;
};

/// The acceleration of the driven joint that a pump asks for.
template <class T>
T pumped(const JointSwingUp::Data& d, const SwingPlant<T>& plant, std::span<const T> x) {
  const T way = (plant.others - T(d.wanted)) * plant.coupling / T(d.soft);
  return T(d.gains.pump) * phs::max(phs::min(way, T(1.0)), T(-1.0)) -
         T(d.gains.stiffness) * (x[d.joint] - T(d.target)) - T(d.gains.damping) * plant.rate;
}

/// The torque of the driven joint, of a plant that has looked at x.
template <class T>
T swing_torque(const JointSwingUp::Data& d, const SwingPlant<T>& plant, std::span<const T> x) {
  const SwingUpGains& k = d.gains;
  const T off = plant.energy - T(d.wanted);
  T value = -T(k.energy) * off * plant.rate;
  if (k.pump > 0)
    value = (pumped(d, plant, x) - plant.acceleration) / plant.mobility;
  else if (k.inertia > 0)
    value = -(T(k.damping) * plant.rate + T(k.stiffness) * (x[d.joint] - T(d.target)) +
              T(k.inertia) * plant.acceleration) /
            (T(k.energy) * off + T(k.inertia) * plant.mobility);
  value = value + plant.friction;
  if (k.limit < HUGE_VAL) value = phs::max(phs::min(value, T(k.limit)), T(-k.limit));
  return value;
}

struct SwingLaw {
  SwingData data;

  template <class T>
  auto evaluator() const {
    return
        [d = data, plant = SwingPlant<T>(data)](T, std::span<const T> x, std::span<T> u) mutable {
          plant.look(x);
          for (T& all : u) all = T(0.0);
          u[d->joint] = swing_torque(*d, plant, x);
        };
  }
};

/// Sums of one kind that should be 0, over states: the worst relative to its largest part, where it
/// is. A state whose parts are all small counts as a thousandth of the largest.
class SumsOfZero {
 public:
  void add(std::initializer_list<double> parts, const std::vector<double>& x) {
    Sum s{0, 1e-300, x};
    for (const double p : parts) {
      s.off += p;
      s.scale = std::fmax(s.scale, std::fabs(p));
    }
    largest_ = std::fmax(largest_, s.scale);
    all_.push_back(std::move(s));
  }
  struct Worst {
    double value = 0;
    std::vector<double> where = {};
  };
  Worst worst() const {
    Worst w;
    for (const Sum& s : all_)
      if (const double off = std::fabs(s.off) / std::fmax(s.scale, 1e-3 * largest_); off > w.value)
        w = {off, s.x};
    return w;
  }

 private:
  struct Sum {
    double off, scale;
    std::vector<double> x;
  };
  std::vector<Sum> all_;
  double largest_ = 0;
};

/// Random positions about the upright: all angles, slides within 1 m. upright: (q, p)
class SwingPositions {
 public:
  SwingPositions(const JointSwingUp::Data& data, const std::vector<double>& upright)
      : upright_(upright), reach_(upright.size() / 2, 1.0), generator_(1), uniform_(-1, 1) {
    for (const auto& b : data.plant->description().blocks)
      if (b.kind == phs::BlockKind::angle) reach_[size_t(b.at)] = std::numbers::pi;
  }
  /// The next one in the q of x.
  void draw(std::vector<double>& x) {
    for (size_t k = 0; k < reach_.size(); ++k) x[k] = upright_[k] + uniform() * reach_[k];
  }
  double uniform() { return uniform_(generator_); }  ///< in (-1, 1)

 private:
  std::vector<double> upright_, reach_;
  std::mt19937_64 generator_;
  std::uniform_real_distribution<double> uniform_;
};

}  // namespace porthos::energy_shaping
