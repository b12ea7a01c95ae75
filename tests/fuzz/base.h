#pragma once
#include <map>
#include <string>

#include "tests/run/scenes.h"

namespace porthos::test::fuzz {

/// Scenes and results that the readers find beside the file they read. Made at the first call, gone
/// at the end of the program.
class Base {
 public:
  Base();
  const Case& arm() const { return arm_; }
  /// A finished run of the arm, and one that was stopped after half of its steps.
  fs::path finished() const { return folder_ / "finished"; }
  fs::path stopped() const { return folder_ / "stopped"; }
  /// Puts the files of a finished or a stopped run back as they were.
  void restore_finished() const;
  void restore_stopped() const;
  /// What a file of theirs had at first. path: below the folder
  const std::string& kept(const std::string& path) const { return kept_.at(folder_ / path); }
  /// A file of the folder with these bytes.
  std::string file(const std::string& name, const std::string& bytes) const;
  fs::path operator/(const std::string& name) const { return folder_ / name; }

 private:
  void restore(const fs::path& folder) const;
  TemporaryFolder folder_;
  Case arm_;
  std::map<fs::path, std::string> kept_;
};
const Base& base();

/// Bytes of the repository: a file below its root.
std::string from_source(const std::string& path);

}  // namespace porthos::test::fuzz
