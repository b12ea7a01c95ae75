#pragma once
#include <string>
#include <vector>

/// Everything that reads a file, as functions of the file's bytes: for libFuzzer (fuzzer.cpp,
/// ./dev fuzz) and for the replay in the default tests (replay_test.cpp).
namespace porthos::test::fuzz {

/// A reader. It may refuse by InvalidArgument or IoError; anything else it throws is a defect.
struct Reader {
  std::string name;
  void (*read)(const std::string& bytes);
  std::vector<std::string> (*seeds)();  ///< inputs that it reads, to begin with
};

const std::vector<Reader>& readers();
/// @throws InvalidArgument if there is none of this name
const Reader& reader(const std::string& name);

/// Reads, and takes a refusal for an answer. @returns whether the reader refused
bool attempt(const Reader& reader, const std::string& bytes);

}  // namespace porthos::test::fuzz
