#pragma once
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "phs/system/description.h"
#include "phs/system/state.h"
#include "scene/assemble/outputs.h"
#include "scene/files/files.h"
#include "scene/run/measure.h"

namespace porthos::scene {

/// Columns of the space ledgers, see space::SpaceLedgers::now(); none if not in orbit.
struct LedgerColumn {
  const char *name, *unit;
};
const std::vector<LedgerColumn>& ledger_columns();

/// A record is a row of 8-byte numbers: step (bits of an integer), time, x, turns (integers too),
/// energy error [J], errors of linear and angular momentum (3 each), quaternion norm error, stored
/// energies [J], works [J], sweeps of the implicit iteration since the start, the reactions of
/// constraints, the ledgers of a spacecraft in orbit, the outputs of the scene, and low words. The
/// smallest and the largest value of each watched column over the steps since the previous record
/// follow (angles with their turns).
struct RecordLayout {
  size_t nx, turns, storages, powers, reactions, ledgers;
  std::vector<OutputColumn> outputs;
  bool low_words;
  std::vector<size_t> watched;  ///< columns
  RecordLayout(const phs::Description& d, Extrema extrema, std::vector<OutputColumn> outputs = {},
               bool low_words = false);
  RecordLayout(const Scene& scene, const Assembly& assembly);
  size_t time() const { return 1; }
  size_t x() const { return 2; }
  size_t turn() const { return 2 + nx; }
  size_t energy() const { return turn() + turns; }
  size_t linear() const { return energy() + 1; }
  size_t angular() const { return energy() + 4; }
  size_t quaternion() const { return energy() + 7; }
  size_t stored() const { return energy() + 8; }
  size_t work() const { return stored() + storages; }
  size_t sweeps() const { return work() + powers; }
  size_t reaction() const { return sweeps() + 1; }
  size_t ledger() const { return reaction() + reactions; }
  size_t output() const { return ledger() + ledgers; }
  size_t low() const { return output() + output_count(); }
  size_t plain() const { return low() + (low_words ? nx : 0); }  ///< a row without extrema
  size_t output_count() const;
  size_t size() const { return plain() + 2 * watched.size(); }
  /// Where a row has the smallest and the largest value of a column since the record before it; the
  /// column itself if it is not watched.
  size_t least(size_t column) const { return extreme(column, 0); }
  size_t largest(size_t column) const { return extreme(column, watched.size()); }

 private:
  size_t extreme(size_t column, size_t after) const;
};

/// Fills one row. works: of each of the system's powers since the start; `energy_error` includes
/// them. reactions, ledgers, outputs: as many numbers as the layout has of each. row: written,
/// layout.plain() numbers.
void fill_record(const RecordLayout& layout, double time, const phs::State& state,
                 const Measured& m, std::span<const double> works, double energy_error,
                 std::int64_t sweeps, std::span<const double> reactions,
                 std::span<const double> ledgers, std::span<const double> outputs,
                 std::span<double> row);

/// The turns of a row's angle blocks. turns: written, layout.turns of them.
void turns_of(const RecordLayout& layout, std::span<const double> row,
              std::span<std::int64_t> turns);

/// The extrema of the current window.
class Window {
 public:
  Window(const phs::Description& d, const RecordLayout& layout);
  bool watches() const { return !low_.empty(); }
  void restart();
  /// Updates the extrema by a row of the layout from fill_record(); only its watched columns are
  /// read.
  void see(std::span<const double> row);
  void put(std::span<double> row) const;

  std::vector<double> memory() const;
  void restore(std::span<const double> memory);

 private:
  RecordLayout layout_;
  std::vector<size_t> turn_;  ///< per watched column, column of its turns; 0: no angle
  std::vector<double> low_, high_;
};

/// FNV-1a over 8-byte words, 64 bits: finds every change of one word, and detects damage, not
/// manipulation. digest: continued from its value.
void digest_into(std::uint64_t& digest, std::span<const double> words);
inline constexpr std::uint64_t digest_of_nothing = 0xcbf29ce484222325u;

/// The extent of a log when a checkpoint was written. digest: of all its records, in their order.
struct LogMark {
  std::int64_t records = 0;
  std::uint64_t digest = digest_of_nothing;
};

/// Append-only file of records. Each is followed by the digest of the log up to it. While it is
/// open no other process can open it.
class RecordLog {
 public:
  /// Starts an empty log, or continues one: checks the records up to the mark and cuts off those
  /// behind it.
  /// @throws IoError if the file cannot be written, InvalidArgument if it is in use, damaged, or
  /// too short for the mark
  RecordLog(const std::filesystem::path& path, const RecordLayout& layout);
  RecordLog(const std::filesystem::path& path, const RecordLayout& layout, const LogMark& mark);

  void append(std::span<const double> row);
  void flush();  ///< hands everything to the operating system
  void sync();   ///< and brings it to the disk
  const LogMark& mark() const { return mark_; }

 private:
  void open(const char* mode);
  std::filesystem::path path_;
  RecordLayout layout_;
  std::unique_ptr<std::FILE, FileCloser> file_;
  LogMark mark_;
};

/// Reads a log in chunks.
class RecordReader {
 public:
  /// @throws InvalidArgument "cannot read <path>: ..."
  RecordReader(const std::filesystem::path& path, const RecordLayout& layout);
  /// The next rows, at most `most`; 0 at the end. rows: without their digests.
  /// @throws InvalidArgument if a digest does not fit: names the record
  size_t read(std::vector<double>& rows, size_t most);
  /// What was read so far and found sound.
  const LogMark& mark() const { return mark_; }
  /// Reads up to the end, or to the first damaged record. @returns what is wrong with it, or ""
  std::string read_sound();

 private:
  size_t next(std::vector<double>& rows, size_t most);
  bool damaged_ = false;
  LogMark mark_;
  std::filesystem::path path_;
  RecordLayout layout_;
  std::unique_ptr<std::FILE, FileCloser> file_;
};

/// Calls f(row) for every record of a log, a row of the layout. @throws as RecordReader
template <class F>
void each_record(const std::filesystem::path& log, const RecordLayout& layout, F f) {
  RecordReader reader(log, layout);
  std::vector<double> rows;
  while (const size_t n = reader.read(rows, 4096))
    for (size_t i = 0; i < n; ++i)
      f(std::span<const double>(rows).subspan(i * layout.size(), layout.size()));
}

/// The integer whose bits a record holds.
std::int64_t integer(double bits);

}  // namespace porthos::scene
