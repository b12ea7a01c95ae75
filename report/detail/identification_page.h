#pragma once
#include <filesystem>
#include <nlohmann/json.hpp>

namespace porthos::report {

using Json = nlohmann::ordered_json;

/// The page's data of a folder that porthos identify wrote; what cannot be read is named under
/// "missing".
Json identification_page(const std::filesystem::path& folder);
bool holds_identification(const std::filesystem::path& folder);

}  // namespace porthos::report
