#pragma once
#include <functional>
#include <string>

#include "scene/assemble/assembly.h"

namespace porthos::scene {

/// Tells the notes on a scene's model, a line each. @param say  null: nobody listens
inline void tell_notes(const Assembly& assembly,
                       const std::function<void(const std::string& line)>& say) {
  for (const auto& note : assembly.notes)
    if (say) say("note on the model: " + note.where + ": " + note.text);
}

}  // namespace porthos::scene
