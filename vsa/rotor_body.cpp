#include "vsa/rotor_body.h"

#include <fmt/format.h>

#include "phs/error.h"

namespace porthos::vsa {
std::string add_rotor(mechanics::MechanismBuilder& b, const std::string& joint,
                      const RotorBody& rotor) {
  if (!(rotor.inertia > 0 && rotor.inertia < HUGE_VAL))
    throw InvalidArgument(fmt::format("rotor at '{}': inertia is {}, expected more than 0 kg m^2",
                                      joint, rotor.inertia));
  for (const auto& carried : b.bodies()) {
    if ((carried.joint.name.empty() ? carried.name : carried.joint.name) != joint) continue;
    mechanics::BodySpec s;
    s.name = s.joint.name = joint + "_rotor";
    s.parent = carried.parent;
    s.joint.type = "continuous";
    s.placement = carried.placement;
    const auto axis = s.joint.axis = rotor.axis.value_or(carried.joint.axis);
    // J about the axis a, J_t across: J_t (1 - aaᵀ) + J aaᵀ
    const double size2 = dot(axis, axis);
    const double across = rotor.transverse > 0 ? rotor.transverse : rotor.inertia;
    const auto entry = [&](int i, int j) {
      return (i == j ? across : 0) + (rotor.inertia - across) * axis[i] * axis[j] / size2;
    };
    s.mass.mass = rotor.mass;
    s.mass.inertia = {entry(0, 0), entry(0, 1), entry(0, 2), entry(1, 1), entry(1, 2), entry(2, 2)};
    b.add(std::move(s));
    return joint + "_rotor.torque";
  }
  throw InvalidArgument(
      fmt::format("rotor at '{}': there is no such joint, expected one that was added", joint));
}

}  // namespace porthos::vsa
