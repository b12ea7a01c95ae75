#pragma once
#include <array>
#include <string>
#include <vector>

#include "mechanics/builder.h"
#include "phs/system/state.h"
#include "scene/read/scene.h"

/// Code shared by building a model and setting its start. Private to scene/assemble.
namespace porthos::scene {

[[noreturn]] void refuse_start(const std::string& name, const JointStart& start,
                               const std::string& why);

/// A locked joint, or a coordinate of one.
bool is_locked(const Scene& scene, const std::string& name);

/// The numbers of a record of another run, by the blocks of this model.
struct FromRecord {
  phs::State state;
  std::vector<bool> known;             ///< of x: whether the record has it
  std::vector<std::string> left_over;  ///< states of the record that this model does not have
};
/// @param mechanical  size of the mechanism's state, which must be there
/// @throws InvalidArgument with file and line, naming the blocks that are missing
FromRecord numbers_of(const StartFrom& from, const phs::Description& system, int mechanical);
/// Sets what the record knows, with its low words and turns.
void put_exactly(const FromRecord& from, phs::State& s);

/// Coordinates and rates at the start.
struct Start {
  std::vector<double> q, v;
};
/// The start of a mechanism whose parts the events of the other run had joined: all of them apart,
/// moving as one. Turns stay in the record.
/// @throws InvalidArgument with file and line: the mechanism has no such parts, or lacks states
Start taken_apart(const StartFrom& from, const mechanics::MechanismBuilder& parts);

/// What is told of a start that is a record. own: its kinetic energy by this model, with and
/// without the motion of the centre of mass [J]; orbit: of the scene, or null.
std::string note_of(const StartFrom& from, const FromRecord& record,
                    const std::array<double, 2>& own, const OrbitScene* orbit,
                    const mechanics::MechanismBuilder& parts);

}  // namespace porthos::scene
