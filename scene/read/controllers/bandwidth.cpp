#include "scene/read/controllers/bandwidth.h"

#include <fmt/format.h>

#include "energy_shaping/certify/sweep.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {

JointGains JointGains::for_mass(double mass) const {
  if (bandwidth == 0) return *this;
  const auto made = energy_shaping::bandwidth_gains(mass, bandwidth, damping_ratio);
  return {made.stiffness, made.damping, bandwidth, damping_ratio};
}

std::vector<SchemaKey> bandwidth_keys(const char* ratio) {
  using namespace keys;
  return {number("bandwidth", "rad/s", "none", "ω, instead of the two gains: m ω² and 2 ζ m ω"),
          number("damping_ratio", "1", "1", ratio)};
}

JointGains read_gains(const Table& joint, const char* stiffness, const char* damping,
                      bool positive) {
  JointGains g;
  if (joint.has("bandwidth")) {
    for (const char* key : {stiffness, damping})
      if (joint.has(key)) joint.fail(key, "is given besides bandwidth, expected one of both");
    g.bandwidth = joint.positive("bandwidth");
    g.damping_ratio = joint.has("damping_ratio") ? joint.positive("damping_ratio") : 1;
    return g;
  }
  if (joint.has("damping_ratio"))
    joint.fail("damping_ratio", "is given without bandwidth, expected both");
  g.stiffness = positive ? joint.positive(stiffness) : joint.not_negative(stiffness);
  g.damping = positive ? joint.positive(damping) : joint.not_negative(damping);
  return g;
}

void report_gains(energy_shaping::Certificate& certificate, const std::string& joint,
                  const JointGains& g) {
  if (g.bandwidth == 0) return;
  certificate.report(fmt::format("stiffness of {}", joint), g.stiffness,
                     fmt::format("damping {:.9g}, for {:g} rad/s and a damping ratio of {:g}",
                                 g.damping, g.bandwidth, g.damping_ratio),
                     {g.damping});
}

}  // namespace porthos::scene
