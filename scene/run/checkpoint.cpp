#include "scene/run/checkpoint.h"

#include <fmt/format.h>

#include <cstring>

#include "phs/error.h"
#include "scene/files/digest.h"
#include "scene/files/files.h"

namespace porthos::scene {
namespace fs = std::filesystem;
namespace {

// state.bin: magic, format version, length of the content, content, SHA-256 (hex) of everything
// before it. Little-endian.
constexpr char magic[8] = {'P', 'o', 'r', 't', 'h', 'o', 's', '\n'};
constexpr std::uint64_t format_version = 7;  // 7: jumps of the error
constexpr size_t head_size = 24, checksum_size = 64;

fs::path file_in(const fs::path& folder) { return folder / "state.bin"; }
fs::path file_before(const fs::path& folder) { return folder / "state.old"; }

template <class T>
void put(std::string& out, T value) {
  static_assert(sizeof(T) == 8);
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}
void put(std::string& out, const std::string& text) {
  put(out, std::uint64_t(text.size()));
  out += text;
}
template <class T>
void put(std::string& out, const std::vector<T>& values) {
  put(out, std::uint64_t(values.size()));
  for (const T& v : values) put(out, v);
}

class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : rest_(bytes) {}
  template <class T>
  void get(T& value) {
    static_assert(sizeof(T) == 8);
    std::memcpy(&value, take(sizeof value), sizeof value);
  }
  void get(std::string& text) {
    const size_t n = count(1);
    text.assign(take(n), n);
  }
  template <class T>
  void get(std::vector<T>& values) {
    values.resize(count(sizeof(T)));
    for (T& v : values) get(v);
  }
  size_t count(size_t item) {
    std::uint64_t n = 0;
    get(n);
    if (n > rest_.size() / item) throw InvalidArgument("the checkpoint's content is inconsistent");
    return n;
  }

 private:
  const char* take(size_t n) {
    if (n > rest_.size()) throw InvalidArgument("the checkpoint's content is inconsistent");
    const char* at = rest_.data();
    rest_.remove_prefix(n);
    return at;
  }
  std::string_view rest_;
};

std::string content_of(const Checkpoint& c) {
  std::string out;
  put(out, std::uint64_t(c.fingerprint.size()));
  for (const auto& [name, value] : c.fingerprint) {
    put(out, name);
    put(out, value);
  }
  put(out, std::int64_t(c.outcome));
  put(out, c.state.x);
  put(out, c.state.lo);
  put(out, c.state.turns);
  put(out, c.state.step);
  put(out, c.state.origin);
  put(out, c.state.origin_lo);
  put(out, c.state.origin_step);
  put(out, c.memory);
  put(out, c.cost.steps);
  put(out, c.cost.evaluations);
  put(out, c.cost.sweeps);
  put(out, c.cost.factorisations);
  put(out, c.statistics);
  put(out, c.log.records);
  put(out, c.log.digest);
  put(out, c.cpu_s);
  put(out, c.wall_s);
  return out;
}

/// Integers of a checkpoint are counts that a run can reach, so that sums of them do not overflow.
void require_within_reach(const Checkpoint& c) {
  constexpr std::int64_t most = std::int64_t(1) << 53;
  const auto check = [&](std::int64_t n, std::int64_t least) {
    if (n < least || n > most)
      throw InvalidArgument(
          fmt::format("the checkpoint's content is inconsistent: it has {} for a "
                      "count, expected {} to {}",
                      n, least, most));
  };
  for (const auto n : {c.state.step, c.state.origin_step, c.cost.steps, c.cost.evaluations,
                       c.cost.sweeps, c.cost.factorisations, c.log.records})
    check(n, 0);
  for (const auto n : c.state.turns) check(n, -most);
}

Checkpoint parse(std::string_view content) {
  Checkpoint c;
  ByteReader in(content);
  c.fingerprint.resize(in.count(16));
  for (auto& [name, value] : c.fingerprint) {
    in.get(name);
    in.get(value);
  }
  std::int64_t outcome = 0;
  in.get(outcome);
  if (outcome < 0 || outcome > std::int64_t(integrators::Outcome::jammed))
    throw InvalidArgument("the checkpoint's content is inconsistent");
  c.outcome = static_cast<integrators::Outcome>(outcome);
  in.get(c.state.x);
  in.get(c.state.lo);
  in.get(c.state.turns);
  in.get(c.state.step);
  in.get(c.state.origin);
  in.get(c.state.origin_lo);
  in.get(c.state.origin_step);
  in.get(c.memory);
  in.get(c.cost.steps);
  in.get(c.cost.evaluations);
  in.get(c.cost.sweeps);
  in.get(c.cost.factorisations);
  in.get(c.statistics);
  in.get(c.log.records);
  in.get(c.log.digest);
  in.get(c.cpu_s);
  in.get(c.wall_s);
  require_within_reach(c);
  return c;
}

Checkpoint checkpoint_in(const fs::path& path) {
  const std::string bytes = scene::read_file(path);
  if (bytes.size() < head_size)
    throw InvalidArgument(fmt::format("the checkpoint {} is truncated: it has {} bytes",
                                      path.string(), bytes.size()));
  if (std::memcmp(bytes.data(), magic, sizeof magic) != 0)
    throw InvalidArgument(fmt::format("{} is not a checkpoint of Porthos", path.string()));

  std::uint64_t version = 0, length = 0;
  ByteReader head(std::string_view(bytes).substr(sizeof magic));
  head.get(version);
  head.get(length);
  if (version != format_version)
    throw InvalidArgument(
        fmt::format("the checkpoint {} has format version {}, this program reads version {}",
                    path.string(), version, format_version));
  const size_t present = bytes.size() - head_size;
  if (present < checksum_size || present - checksum_size < length)
    throw InvalidArgument(
        fmt::format("the checkpoint {} is truncated: it has {} bytes, expected {}", path.string(),
                    bytes.size(), length + head_size + checksum_size));
  const std::string_view signed_part(bytes.data(), bytes.size() - checksum_size);
  if (sha256(signed_part) != std::string_view(bytes).substr(signed_part.size()))
    throw InvalidArgument(
        fmt::format("the checkpoint {} is damaged: its checksum does not fit", path.string()));
  return parse(signed_part.substr(head_size));
}

}  // namespace

void write_checkpoint(const fs::path& folder, const Checkpoint& c) {
  const std::string content = content_of(c);
  std::string out(magic, sizeof magic);
  put(out, format_version);
  put(out, content);
  write_aside(file_in(folder), out + sha256(out));
  // A file system without hard links keeps one checkpoint only.
  std::error_code ignored;
  fs::remove(file_before(folder), ignored);
  fs::create_hard_link(file_in(folder), file_before(folder), ignored);
  put_in_place(file_in(folder));
}

bool has_checkpoint(const fs::path& folder) { return fs::exists(file_in(folder)); }

bool has_checkpoint_before(const fs::path& folder) { return fs::exists(file_before(folder)); }

void return_to_checkpoint_before(const fs::path& folder) {
  if (std::rename(file_before(folder).c_str(), file_in(folder).c_str()) != 0)
    cannot_write(file_in(folder));
}

Checkpoint read_checkpoint(const fs::path& folder) {
  if (!has_checkpoint(folder))
    throw InvalidArgument("there is no checkpoint in " + folder.string());
  return checkpoint_in(file_in(folder));
}

Checkpoint read_checkpoint_before(const fs::path& folder) {
  return checkpoint_in(file_before(folder));
}

}  // namespace porthos::scene
