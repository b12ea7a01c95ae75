#pragma once
#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>

namespace porthos::report {

using Json = nlohmann::ordered_json;

/// The data of a page that is not of a run: what every page has, and what could not be read.
class PageParts {
 public:
  PageParts(const char* kind, const std::filesystem::path& folder)
      : data{{"format", 1},
             {"kind", kind},
             {"folder", folder.filename().string()},
             {"summary", nullptr},
             {"comparison", nullptr},
             {"phases", Json::array()},
             {"model_notes", Json::array()},
             {"texts", {{"scene", ""}, {"model", ""}}},
             {"missing", Json::array()}} {}

  Json data;

  /// Calls f(); if it fails, `what` and its message go to "missing".
  template <class F>
  void attempt(const char* what, const F& f) {
    try {
      f();
    } catch (const std::exception& e) {
      data["missing"].push_back(fmt::format("{}: {}", what, e.what()));
    }
  }
  /// The data with its status.
  Json finished() {
    const bool complete = data["missing"].empty();
    data["status"] = {{"state", complete ? "complete" : "damaged"},
                      {"text", complete ? "" : "Part of the results could not be read."}};
    return std::move(data);
  }
};

}  // namespace porthos::report
