#include "energy_shaping/laws/computed_torque.h"

#include <fmt/format.h>

#include <numeric>

#include "mechanics/momentum.h"
#include "mechanics/rnea.h"

namespace porthos::energy_shaping {
namespace {

struct InverseDynamics {
  std::shared_ptr<const mechanics::MechanicalModel> plant;
  std::shared_ptr<const Trajectory> trajectory;
  std::vector<double> kp, kd;

  template <class T>
  auto evaluator() const {
    const auto& m = plant->mechanism();
    const auto n = size_t(m.nv());
    return [self = *this, &m, n, w = mechanics::Workspace<T>(m), q = std::vector<T>(n),
            v = std::vector<T>(n), a = std::vector<T>(n),
            rate = std::vector<T>(n)](T t, std::span<const T> x, std::span<T> u) mutable {
      self.trajectory->at(t, std::span<T>(q), std::span<T>(v), std::span<T>(a));
      mechanics::rates_from_momenta<T>(m, w, x.first(n), x.subspan(n, n));
      rate = w.rate;
      for (size_t i = 0; i < n; ++i)
        a[i] = a[i] - T(self.kd[i]) * (rate[i] - v[i]) - T(self.kp[i]) * (x[i] - q[i]);
      for (T& y : u) y = T(0.0);
      mechanics::rnea<T>(m, w, x.first(n), rate, a, {}, u.first(n));
      for (const auto& j : m.joint_properties()) {
        T& y = u[size_t(j.v)];
        y = y + T(j.stiffness) * (x[size_t(j.q)] - T(j.rest)) + T(j.damping) * rate[size_t(j.v)];
      }
    };
  }
};

}  // namespace

std::vector<PortLaw> computed_torque(std::shared_ptr<const mechanics::MechanicalModel> plant,
                                     std::shared_ptr<const Trajectory> trajectory,
                                     std::vector<double> kp, std::vector<double> kd) {
  const PdPlus same_conditions(plant, trajectory, kp, kd);
  std::vector<int> all(kp.size());
  std::iota(all.begin(), all.end(), 0);
  const auto& d = plant->description();
  return port_laws(InverseDynamics{plant, std::move(trajectory), std::move(kp), std::move(kd)}, d,
                   all);
}

}  // namespace porthos::energy_shaping
