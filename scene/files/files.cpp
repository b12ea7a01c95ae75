#include "scene/files/files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

#include "phs/error.h"

namespace porthos::scene {
namespace fs = std::filesystem;
namespace {

using Stream = std::unique_ptr<std::FILE, FileCloser>;

}  // namespace

void cannot_read(const fs::path& path) {
  const int error = errno;
  throw_unreadable(fmt::format("cannot read {}: {}", path.string(), std::strerror(error)), error);
}
void cannot_write(const fs::path& path, const char* verb) {
  throw IoError(fmt::format("cannot {} {}: {}", verb, path.string(), std::strerror(errno)));
}

fs::path phase_folder(const fs::path& folder, std::size_t k) {
  return folder / fmt::format("phase_{}", k);
}

void make_folder(const fs::path& folder) {
  std::error_code e;
  fs::create_directories(folder, e);
  if (!e && !fs::is_directory(folder)) e = std::make_error_code(std::errc::not_a_directory);
  if (e) throw IoError(fmt::format("cannot make the folder {}: {}", folder.string(), e.message()));
}

std::string remove_unneeded(const std::filesystem::path& folder) {
  std::error_code e;
  std::filesystem::remove_all(folder, e);
  return e ? fmt::format("{} cannot be removed ({}): the results are complete without it",
                         folder.string(), e.message())
           : "";
}

std::string read_file(const fs::path& path) {
  const Stream f(std::fopen(path.c_str(), "rb"));
  if (!f) cannot_read(path);
  std::string content;
  char part[1 << 16];
  while (const size_t n = std::fread(part, 1, sizeof part, f.get())) content.append(part, n);
  if (std::ferror(f.get())) cannot_read(path);
  return content;
}

fs::path aside(const fs::path& path) { return path.string() + ".new"; }

void write_aside(const fs::path& path, std::string_view content) {
  const fs::path name = aside(path);
  const Stream f(std::fopen(name.c_str(), "wb"));
  if (!f) cannot_write(path);
  if (std::fwrite(content.data(), 1, content.size(), f.get()) != content.size() ||
      std::fflush(f.get()) != 0 || fsync(fileno(f.get())) != 0)
    cannot_write(path);
}

void sync_to_disk(const fs::path& path) {
  const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) cannot_write(path);
  // EINVAL: this file system does not do it for folders.
  const bool ok = fsync(fd) == 0 || errno == EINVAL;
  const int reason = errno;
  close(fd);
  errno = reason;
  if (!ok) cannot_write(path);
}

void put_in_place(const fs::path& path) {
  if (std::rename(aside(path).c_str(), path.c_str()) != 0) cannot_write(path);
  sync_to_disk(path.has_parent_path() ? path.parent_path() : fs::path("."));
}

void write_file(const fs::path& path, std::string_view content) {
  write_aside(path, content);
  put_in_place(path);
}

void write_together(const fs::path& folder,
                    const std::vector<std::pair<std::string, std::string>>& files) {
  make_folder(folder);
  for (const auto& [name, text] : files) write_aside(folder / name, text);
  for (const auto& [name, text] : files) put_in_place(folder / name);
}

}  // namespace porthos::scene
