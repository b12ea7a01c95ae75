#pragma once
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

/// Reference cases kept beside the repository. A test that needs one skips with a clear message where it is absent.
namespace porthos::test {

inline std::filesystem::path shared(const std::string& path) {
  return std::filesystem::path(PORTHOS_SHARED_DIR) / path;
}

inline nlohmann::json read_json(const std::filesystem::path& path) {
  std::ifstream in(path);
  return nlohmann::json::parse(in);
}

#define PORTHOS_NEEDS_SHARED(path)                                           \
  if (!std::filesystem::exists(porthos::test::shared(path)))                 \
  GTEST_SKIP() << "needs the reference file " << porthos::test::shared(path) \
               << ", which stands beside the repository"

}  // namespace porthos::test
