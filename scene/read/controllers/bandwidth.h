#pragma once
#include <string>
#include <vector>

#include "energy_shaping/loop/certificate.h"
#include "scene/read/schema.h"

namespace porthos::scene {

class Table;

/// The gains of a joint, stated as they are or by what its motion should be like.
struct JointGains {
  double stiffness = 0, damping = 0;
  double bandwidth = 0, damping_ratio = 1;  ///< [rad/s]; 0: stated as they are

  /// By energy_shaping::bandwidth_gains() if they follow from a bandwidth.
  /// @param mass  [kg m² | kg]; 1 for gains that are divided by it
  JointGains for_mass(double mass) const;
};

/// The keys bandwidth and damping_ratio. @param ratio  what ζ and m are
std::vector<SchemaKey> bandwidth_keys(const char* ratio);
/// Reads them, or the two that state the gains as they are.
/// @throws InvalidArgument "file:line: ..." if both are stated
JointGains read_gains(const Table& joint, const char* stiffness, const char* damping,
                      bool positive);
/// Tells gains that follow from a bandwidth in the certificate.
void report_gains(energy_shaping::Certificate& certificate, const std::string& joint,
                  const JointGains& gains);

}  // namespace porthos::scene
