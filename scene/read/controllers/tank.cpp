#include "scene/read/controllers/tank.h"

#include <fmt/format.h>

#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {

std::vector<SchemaKey> tank_keys() {
  using namespace keys;
  return {table("tank", "controller.tank", "none", "of energy, which pays for what the law does")};
}

std::vector<SchemaTable> tank_tables() {
  using namespace keys;
  return {
      {"controller.tank",
       "[controller.tank]",
       "A tank of energy: the law supplies what is in it, and no more.",
       {number("level", "J", required, "at the start"),
        number("least", "J", "0", "where the law does nothing; it fades over a tenth of the way"),
        number("most", "J", "twice the level", "what would pass it is lost")}}};
}

std::optional<EnergyTank> read_tank(const Table& t) {
  if (!t.has("tank")) return {};
  const Table own = t.table("tank");
  const double level = own.positive("level");
  EnergyTank tank{level, {own.not_negative("least"), 2 * level}};
  if (own.has("most")) tank.bounds.most = own.positive("most");
  const auto [least, most] = tank.bounds;
  if (!(least < most && least <= level && level <= most))
    refuse(own.where(),
           fmt::format("{} has least {:g}, level {:g} and most {:g}, expected least <= "
                       "level <= most and least < most",
                       own.label(), least, level, most));
  return tank;
}

}  // namespace porthos::scene
