#pragma once
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "scene/ensemble/case_layout.h"
#include "scene/run/provenance.h"
#include "scene/run/record_log.h"

namespace porthos::scene {

/// Append-only file of the finished cases, in the order in which they finished. While it is open no
/// other process can open it. An incomplete row at its end, left by a crash, is removed. A row
/// whose digest does not fit is passed over. Their cases are run again.
class CaseLog {
 public:
  /// Starts a log, or continues one.
  /// @throws IoError if the file cannot be written, InvalidArgument if it is in use, or of another
  ///   ensemble (names what differs)
  CaseLog(const std::filesystem::path& path, const CaseLayout& layout,
          const NamedTexts& fingerprint);

  /// Where a row begins [bytes].
  using Place = std::int64_t;
  Place append(std::span<const double> row);
  void sync();
  void read(Place place, std::span<double> row) const;
  /// Calls seen(row, place) for every valid row.
  template <class Seen>
  void each(Seen seen) const {
    std::vector<double> row(layout_.size());
    for (Place p = begin_; p < end_; p += bytes()) {
      read(p, row);
      if (layout_.sound(row)) seen(row, p);
    }
  }
  std::int64_t damaged() const { return damaged_; }  ///< rows that were found so when it was opened
  const std::filesystem::path& path() const { return path_; }

 private:
  Place bytes() const { return Place(layout_.size() * sizeof(double)); }
  void find_end();
  std::filesystem::path path_;
  CaseLayout layout_;
  std::unique_ptr<std::FILE, FileCloser> file_;
  Place begin_ = 0, end_ = 0;
  std::int64_t damaged_ = 0;
};

}  // namespace porthos::scene
