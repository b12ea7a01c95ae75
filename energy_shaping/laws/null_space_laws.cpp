// The law of a null-space posture in parts, for a network that has its dampers and its tank.
#include <algorithm>

#include "energy_shaping/laws/detail/null_space_projector.h"

namespace porthos::energy_shaping {
namespace {

/// K_n (q - q_n)
template <class T>
void pull(const NullSpacePosture& p, std::span<const T> q, std::span<T> f) {
  for (size_t i = 0; i < p.rest.size(); ++i) f[i] = T(p.stiffness[i]) * (q[i] - T(p.rest[i]));
}

struct SpringLaw {
  std::shared_ptr<const NullSpaceLoop> loop;

  template <class T>
  auto evaluator() const {
    const auto& p = loop->posture();
    const size_t n = p.rest.size();
    return [keep = loop, task = loop->task().template loop<T>(), at_rest = std::vector<T>(2 * n),
            f = std::vector<T>(n), n, &p](T t, std::span<const T> x, std::span<T> u) mutable {
      std::copy_n(x.begin(), n, at_rest.begin());  // without rates the task's dampers do nothing
      task->law(t, at_rest, u);
      pull<T>(p, x, f);
      for (size_t i = 0; i < n; ++i) u[i] = u[i] - f[i];
    };
  }
};

struct ProjectionLaw {
  std::shared_ptr<const NullSpaceLoop> loop;

  template <class T>
  auto evaluator() const {
    const auto& p = loop->posture();
    const size_t n = p.rest.size();
    return [keep = loop, projector = NullSpaceProjector<T>(*loop), f = std::vector<T>(n), n, &p](
               T, std::span<const T> x, std::span<T> u) mutable {
      projector.place(x.first(n));
      pull<T>(p, x, f);
      std::fill(u.begin(), u.end(), T(0.0));
      projector.felt(f.data(), u.data());
    };
  }
};

}  // namespace

std::vector<PortLaw> spring_laws(std::shared_ptr<const NullSpaceLoop> loop) {
  const auto& plant = loop->plant().description();
  const auto at = loop->actuated();
  return port_laws(SpringLaw{std::move(loop)}, plant, at);
}

std::vector<PortLaw> projection_laws(std::shared_ptr<const NullSpaceLoop> loop) {
  const auto& plant = loop->plant().description();
  const auto at = loop->actuated();
  return port_laws(ProjectionLaw{std::move(loop)}, plant, at);
}

}  // namespace porthos::energy_shaping
