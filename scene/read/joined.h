#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "mechanics/builder.h"

namespace porthos::scene {

/// What the events of a run had joined and locked at one moment. It is a text of run.h5, so that
/// another run can go on from there.
struct Joined {
  /// A capture or a lock.
  struct Hold {
    std::string body, link;                                                ///< of a capture
    mechanics::Pose pose{mechanics::Mat3<double>::identity(), {0, 0, 0}};  ///< body in the link
    std::string joint;                                                     ///< of a lock
  };
  /// Of a coordinate that is locked.
  struct Value {
    std::vector<double> x, low;  ///< as in run.h5
    std::int64_t turns = 0;
  };
  std::vector<Hold> holds;              ///< in the order in which they happened
  std::map<std::string, Value> locked;  ///< by the names of the blocks of the state
  std::vector<std::string> others;      ///< events on latches and loops, as text() names them

  bool empty() const { return holds.empty() && others.empty(); }
};

/// As JSON.
std::string to_text(const Joined& joined);
/// @throws InvalidArgument if it is not what to_text() writes
Joined joined_of(const std::string& text);

}  // namespace porthos::scene
