#pragma once
#include <string>
#include <vector>

#include "energy_shaping/certify/certify.h"

namespace porthos::energy_shaping {

/// "40 % of its limit", the largest share of an input; empty: there are no limits.
std::string share_of_limits(const std::vector<double>& peak, const std::vector<double>& limits);
/// ", start 2", where there are several.
std::string of_start(const CertifyOptions& o, size_t s);
/// The runs of the plant from each start, and on the other plants.
/// @param limited_from  H_d from which the limits act; infinite: not known
void certify_runs(const ClosedLoop& loop, const CertifyOptions& options, double limited_from,
                  Certificate& certificate);

}  // namespace porthos::energy_shaping
