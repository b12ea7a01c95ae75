#pragma once
#include <string>
#include <vector>

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
  std::vector<bool> known;  ///< of x: whether the record has it
};
/// @param mechanical  size of the mechanism's state, which must be there
/// @throws InvalidArgument with file and line, naming the blocks that are missing
FromRecord numbers_of(const StartFrom& from, const phs::Description& system, int mechanical);
/// Sets what the record knows, with its low words and turns.
void put_exactly(const FromRecord& from, phs::State& s);

}  // namespace porthos::scene
