#pragma once
#include "scene/plot/motion.h"

namespace porthos::scene {

/// Deflections, settings, stiffness and torques of the springs of records, and of their motors the
/// angles and torques, each a panel with any number of lines; empty ones are left out.
std::vector<TracePanel> spring_panels(const MotionRecords& records);

}  // namespace porthos::scene
