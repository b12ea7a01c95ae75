// Magnetic torquers: the torque of a rod and the wheels it unloads.
#include "space/detail/parts_checks.h"
#include "space/gravity_gradient.h"

namespace porthos::space {

int free_base(const mechanics::Mechanism& m) {
  for (size_t i = 0; i < m.nodes().size(); ++i)
    if (m.nodes()[i].parent < 0 && m.nodes()[i].q == 0) {
      for (const auto& c : m.coordinates())
        if (c.node == int(i) && c.kind == phs::BlockKind::rotation && c.q == base_attitude)
          return int(i);
    }
  return -1;
}

template <class T>
Vec3<T> torque_of(const Torquer& rod, const std::vector<WheelAxis>& wheels, const T& t,
                  std::span<const T> x, size_t nq, const Vec3<T>& B) {
  const Vec3<T> d(rod.direction);
  T m(0.0);
  if (rod.dipole) {
    m = (*rod.dipole)(t);
  } else {
    Vec3<T> h{T(0.0), T(0.0), T(0.0)};
    for (const auto& w : wheels) h += x[nq + size_t(w.q)] * Vec3<T>(w.axis);
    const T tiny(1e-30), B2 = dot(B, B);
    m = T(rod.unload) * dot(d, cross(h, B)) / phs::max(B2, tiny);
  }
  if (rod.limit > 0) m = T(rod.limit) * phs::tanh(m / T(rod.limit));
  return m * cross(d, B);
}

#define PORTHOS_INSTANTIATE(T)                                                        \
  template Vec3<T> torque_of(const Torquer&, const std::vector<WheelAxis>&, const T&, \
                             std::span<const T>, size_t, const Vec3<T>&);
PORTHOS_FOR_EACH_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

std::vector<WheelAxis> wheel_axes(const mechanics::Mechanism& m, const std::string& who,
                                  const std::vector<std::string>& joints) {
  const int base = free_base(m);
  std::vector<WheelAxis> list;
  for (const auto& joint : joints) {
    const mechanics::JointCoordinates* found = nullptr;
    for (const auto& c : m.coordinates())
      if (c.name == joint && c.kind == phs::BlockKind::angle) found = &c;
    if (!found || base < 0 || m.nodes()[size_t(found->node)].parent != base)
      throw InvalidArgument(who + ": joint '" + joint +
                            "' does not turn on a free base, expected a wheel that does");
    list.push_back({found->q, m.nodes()[size_t(found->node)].placement.R.z});
  }
  return list;
}

}  // namespace porthos::space
