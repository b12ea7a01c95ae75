#pragma once
#include <memory>
#include <span>
#include <vector>

#include "planning/whole_body_law.h"
#include "scene/read/schema.h"

namespace porthos::scene {

class Table;

/// The table [controller.gait].
SchemaTable gait_table();
/// @param feet  how many there are: the contacts of the controller
planning::GaitDesign read_gait(const Table& t, size_t feet);

/// The gait of feet that stand as at the start. The supports get the attitudes that soles keep.
/// @param start  size nq, coordinates
/// @throws InvalidArgument: no feet, one of several links, ground that is not level; and as Gait()
std::shared_ptr<const planning::Gait> gait_of(const mechanics::Mechanism& m,
                                              const planning::GaitDesign& design,
                                              std::vector<planning::Support>& supports,
                                              std::span<const double> start);

}  // namespace porthos::scene
