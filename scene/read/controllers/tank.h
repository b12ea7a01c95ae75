#pragma once
#include <optional>
#include <vector>

#include "phs/network/network.h"
#include "scene/read/schema.h"

namespace porthos::scene {

class Table;

/// A store of energy that pays for a controller: [controller.tank].
struct EnergyTank {
  double level;                 ///< at the start [J]
  phs::Network::Tank bounds{};  ///< of its level
};
/// The key tank, and its table.
std::vector<SchemaKey> tank_keys();
std::vector<SchemaTable> tank_tables();
std::optional<EnergyTank> read_tank(const Table& t);

}  // namespace porthos::scene
