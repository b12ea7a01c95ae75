#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "scene/read/event.h"
#include "scene/read/joined.h"

namespace porthos::scene {

class Table;

/// A record of another run, with which a run starts: [initial] from.
struct StartFrom {
  struct Numbers {
    std::vector<double> x, low;  ///< low: zeros where they were not recorded
  };
  std::string folder;  ///< as the scene states it
  std::string where;   ///< "file:line:column"
  double time = 0;     ///< of the record [s]
  double elapsed = 0;  ///< up to then since the epoch of [orbit], over all runs before [s]
  /// Of [orbit]: its epoch, empty if it has none, and what acts (space::forces_of). Empty: not in
  /// orbit, or results of a version that did not say.
  std::optional<std::string> epoch;
  std::vector<std::string> forces;
  std::map<std::string, double> longitudes;  ///< as OrbitScene, of the first leg
  bool low_words = false;
  bool failed = false;  ///< its run failed, as its summary says
  /// Of the blocks of the state, by their names in run.h5.
  std::map<std::string, Numbers> state, momentum;
  std::map<std::string, std::int64_t> turns;  ///< by the names of the angles
  std::optional<double> kinetic;              ///< its kinetic energy [J]
  /// The texts of that run's scene, its model and its other files, as run.h5 has them.
  std::string scene_text, model_text, files_text;
  /// Where its joints of [model] lock were: locked_places().
  std::map<std::string, std::vector<double>> locked_at;
  /// What its events had joined and locked by then. Locked coordinates are in state and turns too,
  /// with no momentum.
  Joined joined;

  /// Of a coordinate of one number, full turns included [rad | m]; none if the record has it not.
  std::optional<double> position(const std::string& coordinate) const;
};

/// Reads the keys from and at of [initial]. beside: the folder of the scene file, to which a
/// relative path refers. @throws InvalidArgument with file and line: there is no such run, or no
/// record at the time
StartFrom read_start_from(const Table& initial, const std::string& beside);

/// The captures and locks that hold at the start, as events.
std::vector<Event> carried_events(const StartFrom& from);

/// Of results that are read again: leaves out the events of the scene that happened at its start,
/// and are carried in the first record of the run itself.
void leave_out(std::vector<Event>& events, const std::vector<Event>& carried);

/// All of it as text, for digests.
std::string text(const StartFrom& from);

}  // namespace porthos::scene
