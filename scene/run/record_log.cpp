#include "scene/run/record_log.h"

#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cmath>

#include "phs/error.h"
#include "scene/files/files.h"

namespace porthos::scene {
namespace {

constexpr size_t buffer_size = 1 << 18;

}  // namespace

void digest_into(std::uint64_t& digest, std::span<const double> words) {
  for (const double w : words) {
    digest = (digest ^ std::bit_cast<std::uint64_t>(w)) * 0x100000001b3u;
    digest ^= digest >> 29;
  }
}

std::int64_t integer(double bits) { return std::bit_cast<std::int64_t>(bits); }

const std::vector<LedgerColumn>& ledger_columns() {
  static const std::vector<LedgerColumn> all{{"orbital_energy", "J"},
                                             {"orbital_defect", "J"},
                                             {"coupling_energy", "J"},
                                             {"coupling_defect", "J"},
                                             {"harmonics_energy", "J"},
                                             {"harmonics_defect", "J"},
                                             {"angular_momentum_defect", "kg m^2/s"}};
  return all;
}

RecordLayout::RecordLayout(const Scene& scene, const Assembly& assembly)
    : RecordLayout(assembly.model->description(), scene.extrema, output_columns(scene, assembly),
                   scene.low_words) {}

RecordLayout::RecordLayout(const phs::Description& d, Extrema extrema, std::vector<OutputColumn> of,
                           bool with_low)
    : nx(size_t(d.nx)),
      turns(0),
      storages(d.storages.size()),
      powers(d.powers.size()),
      reactions(size_t(d.reaction_count())),
      ledgers(0),
      outputs(std::move(of)),
      low_words(with_low) {
  for (const auto& b : d.blocks) {
    turns += b.kind == phs::BlockKind::angle;
    if (b.name == "orbit.position") ledgers = ledger_columns().size();
  }
  const auto watch = [&](size_t from, size_t to) {
    for (; from < to; ++from) watched.push_back(from);
  };
  if (extrema != Extrema::none) watch(x(), turn());
  if (extrema == Extrema::all) watch(energy(), work());
  if (extrema != Extrema::none) {
    watch(work(), sweeps());
    watch(ledger(), extrema == Extrema::all ? low() : output());
  }
}

size_t RecordLayout::extreme(size_t column, size_t after) const {
  const auto at = size_t(std::ranges::find(watched, column) - watched.begin());
  return at < watched.size() ? plain() + after + at : column;
}

size_t RecordLayout::output_count() const {
  size_t n = 0;
  for (const OutputColumn& o : outputs) n += o.size;
  return n;
}

void fill_record(const RecordLayout& l, double time, const phs::State& s, const Measured& m,
                 std::span<const double> works, double energy_error, std::int64_t sweeps,
                 std::span<const double> reactions, std::span<const double> ledgers,
                 std::span<const double> outputs, std::span<double> row) {
  row[0] = std::bit_cast<double>(s.step);
  row[l.time()] = time;
  std::copy(s.x.begin(), s.x.end(), row.begin() + long(l.x()));
  for (size_t i = 0; i < l.turns; ++i) row[l.turn() + i] = std::bit_cast<double>(s.turns[i]);
  row[l.energy()] = energy_error;
  for (size_t k = 0; k < 3; ++k) {
    row[l.linear() + k] = m.linear[k];
    row[l.angular() + k] = m.angular[k];
  }
  row[l.quaternion()] = m.quaternion_norm;
  std::copy(m.stored_J.begin(), m.stored_J.end(), row.begin() + long(l.stored()));
  std::copy(works.begin(), works.end(), row.begin() + long(l.work()));
  row[l.sweeps()] = double(sweeps);
  std::copy(reactions.begin(), reactions.end(), row.begin() + long(l.reaction()));
  std::copy(ledgers.begin(), ledgers.end(), row.begin() + long(l.ledger()));
  std::copy(outputs.begin(), outputs.end(), row.begin() + long(l.output()));
  if (l.low_words) std::copy(s.lo.begin(), s.lo.end(), row.begin() + long(l.low()));
}

void turns_of(const RecordLayout& l, std::span<const double> row, std::span<std::int64_t> turns) {
  for (size_t i = 0; i < turns.size(); ++i) turns[i] = integer(row[l.turn() + i]);
}

Window::Window(const phs::Description& d, const RecordLayout& layout)
    : layout_(layout), turn_(layout.watched.size(), 0) {
  low_.resize(turn_.size());
  high_.resize(turn_.size());
  size_t turn = layout.turn();
  for (const auto& b : d.blocks)
    if (b.kind == phs::BlockKind::angle) {
      for (size_t k = 0; k < turn_.size(); ++k)
        if (layout.watched[k] == layout.x() + size_t(b.at)) turn_[k] = turn;
      ++turn;
    }
  restart();
}

void Window::restart() {
  std::fill(low_.begin(), low_.end(), HUGE_VAL);
  std::fill(high_.begin(), high_.end(), -HUGE_VAL);
}

void Window::see(std::span<const double> row) {
  for (size_t k = 0; k < turn_.size(); ++k) {
    double value = row[layout_.watched[k]];
    if (turn_[k] > 0) value += double(integer(row[turn_[k]])) * phs::two_pi_hi;
    low_[k] = std::fmin(low_[k], value);
    high_[k] = std::fmax(high_[k], value);
  }
}

void Window::put(std::span<double> row) const {
  std::copy(low_.begin(), low_.end(), row.begin() + long(layout_.plain()));
  std::copy(high_.begin(), high_.end(), row.begin() + long(layout_.plain() + low_.size()));
}

std::vector<double> Window::memory() const {
  auto m = low_;
  m.insert(m.end(), high_.begin(), high_.end());
  return m;
}

void Window::restore(std::span<const double> m) {
  require_size("memory of the extrema", m.size(), 2 * low_.size());
  std::copy_n(m.begin(), low_.size(), low_.begin());
  std::copy_n(m.begin() + long(low_.size()), high_.size(), high_.begin());
}

RecordLog::RecordLog(const std::filesystem::path& path, const RecordLayout& layout)
    : path_(path), layout_(layout) {
  open("a+b");
  if (ftruncate(fileno(file_.get()), 0) != 0) cannot_write(path_);
}

RecordLog::RecordLog(const std::filesystem::path& path, const RecordLayout& layout,
                     const LogMark& mark)
    : path_(path), layout_(layout), mark_(mark) {
  open("r+b");
  const size_t record = (layout.size() + 1) * sizeof(double);
  const auto present = std::filesystem::file_size(path);
  if (mark.records < 0 || present / record < static_cast<std::uintmax_t>(mark.records))
    throw InvalidArgument(
        fmt::format("{} is truncated: it has {} bytes, the checkpoint needs {} records of {} bytes",
                    path.string(), present, mark.records, record));
  RecordReader reader(path, layout);
  std::vector<double> rows;
  while (reader.mark().records < mark.records)
    reader.read(rows, size_t(std::min<std::int64_t>(4096, mark.records - reader.mark().records)));
  if (reader.mark().digest != mark.digest)
    throw InvalidArgument(path.string() +
                          " is damaged: its records do not fit the checkpoint's digest");
  const auto bytes = static_cast<off_t>(mark.records) * static_cast<off_t>(record);
  if (ftruncate(fileno(file_.get()), bytes) != 0) cannot_write(path_);
  if (std::fseek(file_.get(), 0, SEEK_END) != 0) cannot_write(path_);
}

void RecordLog::open(const char* mode) {
  file_.reset(std::fopen(path_.c_str(), mode));
  if (!file_) cannot_write(path_);
  std::setvbuf(file_.get(), nullptr, _IOFBF, buffer_size);
  if (flock(fileno(file_.get()), LOCK_EX | LOCK_NB) == 0) return;
  if (errno == EWOULDBLOCK)
    throw InvalidArgument("another run is writing into " +
                          path_.parent_path().parent_path().string());
  cannot_write(path_, "lock");
}

void RecordLog::append(std::span<const double> row) {
  digest_into(mark_.digest, row);
  if (std::fwrite(row.data(), sizeof(double), row.size(), file_.get()) != row.size() ||
      std::fwrite(&mark_.digest, sizeof mark_.digest, 1, file_.get()) != 1)
    cannot_write(path_);
  ++mark_.records;
}

void RecordLog::flush() {
  if (std::fflush(file_.get()) != 0) cannot_write(path_);
}

void RecordLog::sync() {
  flush();
  if (fsync(fileno(file_.get())) != 0 && errno != EINVAL) cannot_write(path_);  // EINVAL: a device
}

RecordReader::RecordReader(const std::filesystem::path& path, const RecordLayout& layout)
    : path_(path), layout_(layout), file_(std::fopen(path.c_str(), "rb")) {
  if (!file_) cannot_read(path_);
}

/// The next sound rows; `damaged_` if one behind them is not.
size_t RecordReader::next(std::vector<double>& rows, size_t most) {
  const size_t n = layout_.size();
  rows.resize(most * (n + 1));
  const size_t got = std::fread(rows.data(), (n + 1) * sizeof(double), most, file_.get());
  if (std::ferror(file_.get())) cannot_read(path_);
  for (size_t i = 0; i < got; ++i) {
    const auto row = std::span<const double>(rows).subspan(i * (n + 1), n);
    std::uint64_t digest = mark_.digest;
    digest_into(digest, row);
    if (std::bit_cast<std::uint64_t>(rows[i * (n + 1) + n]) != digest) {
      damaged_ = true;
      return i;
    }
    mark_ = {mark_.records + 1, digest};
    std::copy(row.begin(), row.end(), rows.begin() + long(i * n));
  }
  return got;
}

size_t RecordReader::read(std::vector<double>& rows, size_t most) {
  const size_t got = next(rows, most);
  if (damaged_)
    throw InvalidArgument(fmt::format("{} is damaged at record {}: its checksum does not fit",
                                      path_.string(), mark_.records));
  rows.resize(got * layout_.size());
  return got;
}

std::string RecordReader::read_sound() {
  std::vector<double> rows;
  while (!damaged_ && next(rows, 4096) > 0) {
  }
  if (!damaged_) return {};
  return fmt::format("{} is damaged at record {}: the {} records before it are sound",
                     path_.string(), mark_.records, mark_.records);
}

}  // namespace porthos::scene
