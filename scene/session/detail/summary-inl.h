#pragma once
#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "phs/error.h"
#include "scene/files/files.h"
#include "scene/session/results.h"

namespace porthos::scene {

/// What `use` makes of the summary of a finished run, a nlohmann::ordered_json.
/// @throws InvalidArgument as require_finished(), and naming the file where it is no JSON or lacks
/// what `use` asks of it
template <class Use>
auto of_summary(const std::filesystem::path& folder, Use use) {
  require_finished(folder);
  const auto path = folder / "summary.json";
  try {
    return use(nlohmann::ordered_json::parse(read_file(path)));
  } catch (const nlohmann::json::exception& e) {
    throw InvalidArgument(fmt::format("{} is damaged: {}", path.string(), e.what()));
  }
}

}  // namespace porthos::scene
