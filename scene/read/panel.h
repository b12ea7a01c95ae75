#pragma once
#include <vector>

#include "mechanics/panel.h"

namespace porthos::scene {

class Table;

/// Reads the [[panel]] tables. @throws InvalidArgument as read_scene()
std::vector<mechanics::Panel> read_panels(const Table& scene);

}  // namespace porthos::scene
