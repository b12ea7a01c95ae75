#pragma once
#include <map>
#include <optional>
#include <string>

#include "space/environment.h"

namespace porthos::scene {

class Table;

/// [planet] and [orbit] of a scene, docs/space.md.
struct OrbitScene {
  space::Environment environment;
  space::PointState<double> start;      ///< of the centre of mass
  std::string splitting = "lobatto4c";  ///< see space::split_schemes()
  std::string epoch;                    ///< as stated; empty: none
  /// Of the Sun, the Moon and the dipole on mean paths, by their keys, at the start of the first
  /// leg [rad].
  std::map<std::string, double> longitudes;
  std::string where;  ///< "file:line:column" of [orbit]
};

/// Reads [orbit] and [planet]; empty if there is neither. @throws InvalidArgument as read_scene()
std::optional<OrbitScene> read_orbit(const Table& scene);

struct StartFrom;

/// Counts the time of an orbit from the record that a run goes on from.
/// @throws InvalidArgument with file and line for an epoch that is not the first run's
void go_on_in_orbit(const StartFrom& from, OrbitScene& orbit);

}  // namespace porthos::scene
