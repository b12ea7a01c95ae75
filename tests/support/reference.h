#pragma once
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/places.h"

/// Reference cases and models, tests/data/README.md.
namespace porthos::test {

inline std::filesystem::path data_file(const std::string& path) {
  return std::filesystem::path(PORTHOS_SOURCE_DIR) / "tests/data" / path;
}

inline nlohmann::json read_json(const std::filesystem::path& path) {
  std::ifstream in(path);
  return nlohmann::json::parse(in);
}

}  // namespace porthos::test
