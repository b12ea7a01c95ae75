#pragma once
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "phs/description.h"
#include "scene/provenance.h"
#include "scene/record_log.h"

namespace porthos::scene {

/// What is kept of a case of an ensemble: a row of 8-byte numbers, integers by their bits, the last a digest of the others.
struct CaseLayout {
  size_t columns, nx, turns;
  CaseLayout(size_t columns_, const phs::Description& d);

  static constexpr size_t index = 0, status = 1, steps = 2, passed = 3;  // integers
  static constexpr size_t energy_initial = 4, energy_scale = 5, energy_abs = 6, energy = 7,
                          energy_rms = 8, linear = 9, angular = 10, quaternion = 11;
  static constexpr size_t inputs = 12;
  size_t x() const { return inputs + columns; }
  size_t low() const { return x() + nx; }
  size_t turn() const { return low() + nx; }  ///< integers
  size_t digest() const { return turn() + turns; }
  size_t size() const { return digest() + 1; }

  /// Completes a row by its digest.
  void seal(std::span<double> row) const;
  bool sound(std::span<const double> row) const;
};

/// How a case ended: an integrators::Outcome, or that it could not begin.
inline constexpr int case_refused = 4;
const char* case_status(int status);

/// Append-only file of the cases that are done, in the order they were. While it is open no second process can open it.
/// What a crash left of a row at its end is cut off: that case is done again.
class CaseLog {
 public:
  /// Starts a log, or continues one.
  /// @throws InvalidArgument if the file cannot be written, is in use, or of another ensemble (names what differs)
  CaseLog(const std::filesystem::path& path, const CaseLayout& layout,
          const NamedTexts& fingerprint);

  /// Where a row begins [bytes].
  using Place = std::int64_t;
  Place append(std::span<const double> row);
  void sync();
  void read(Place place, std::span<double> row) const;
  /// Every sound row there was: seen(row, place).
  template <class Seen>
  void each(Seen seen) const {
    std::vector<double> row(layout_.size());
    for (Place p = begin_; p < end_; p += bytes()) read(p, row), seen(row, p);
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  Place bytes() const { return Place(layout_.size() * sizeof(double)); }
  void find_end();
  std::filesystem::path path_;
  CaseLayout layout_;
  std::unique_ptr<std::FILE, FileCloser> file_;
  Place begin_ = 0, end_ = 0;
};

}  // namespace porthos::scene
