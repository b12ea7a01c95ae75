#pragma once
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "mechanics/urdf.h"

/// The contents of a URDF file, before the check that it is a tree. Private to the reader:
/// urdf_file.cpp makes a File from XML, urdf.cpp a mechanism from a File.
namespace porthos::mechanics::urdf {

inline std::string named(std::string_view s) { return "'" + std::string(s) + "'"; }

/// The file's name and the notes about it.
class Log {
 public:
  explicit Log(std::string file) : file_(std::move(file)) {}

  const std::string& file() const { return file_; }
  std::string at(int line) const { return file_ + ":" + std::to_string(line); }
  [[noreturn]] void fail(int line, const std::string& text) const {
    throw InvalidArgument(at(line) + ": " + text);
  }
  [[noreturn]] void fail(const std::string& text) const {
    throw InvalidArgument(file_ + ": " + text);
  }
  void note(int line, std::string text) { notes_.push_back({at(line), std::move(text)}); }
  /// For frequent remarks: one note for all of a kind, at the line of the first.
  void count(int line, const std::string& kind, const char* fate) {
    ++tallies_.try_emplace(kind + ": " + fate, Tally{line, 0}).first->second.times;
  }
  std::vector<UrdfNote> notes() const {
    auto all = notes_;
    for (const auto& [text, t] : tallies_)
      all.push_back({at(t.line), std::to_string(t.times) + " x " + text});
    return all;
  }

 private:
  struct Tally {
    int line, times;
  };
  std::string file_;
  std::vector<UrdfNote> notes_;
  std::map<std::string, Tally> tallies_;
};
struct Link {
  std::string name;
  int line;
  std::optional<MassProperties> mass;
};

struct Joint {
  int line = 0;
  std::string parent, child;
  JointSpec spec;
  Pose placement;
};

struct File {
  std::string name;
  std::vector<Link> links;
  std::vector<Joint> joints;
  std::vector<Coupling> mimics;
};
/// Reads XML. Errors within a single tag are refused here, errors of the whole file later.
File read_file(Log& log, const std::string& text, const UrdfOptions& options);

}  // namespace porthos::mechanics::urdf
