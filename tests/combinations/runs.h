#pragma once
#include <filesystem>
#include <string>

#include "tests/combinations/features.h"

namespace porthos::test::combinations {

/// What became of a pair: it ran and its verdict is pass, or one of the two.
struct Seen {
  std::string refusal;  ///< the sentence before the first step
  /// anything that may not be: a verdict that is no pass, a refusal in the middle of a run
  std::string trouble;
  bool runs() const { return refusal.empty() && trouble.empty(); }
};

/// What the report of a feature shows of it: a text of summary.json, empty where it has none of its
/// own.
std::string shown_of(const Feature& f);

/// Writes scene.toml and model.urdf. @return the path of the scene
std::string write_scene(const std::filesystem::path& folder, const SceneTexts& texts);

/// Runs a pair in a folder of its own.
Seen run_pair(const Feature& a, const Feature& b, const Settings& more = {});

/// Whether a refusal of a pair names both: by a word of its own, or of what it stands on.
bool names_both(const std::string& sentence, const Feature& a, const Feature& b);

}  // namespace porthos::test::combinations
