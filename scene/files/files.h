#pragma once
#include <cstdio>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

/// Files that survive a crash: they are written under a temporary name, flushed to the disk and
/// renamed.
namespace porthos::scene {

/// For std::unique_ptr<std::FILE, FileCloser>.
struct FileCloser {
  void operator()(std::FILE* f) const { std::fclose(f); }
};

/// Throw "cannot read <path>: <reason of the operating system>", from errno, as throw_unreadable(),
/// or for a file that cannot be written an IoError.
[[noreturn]] void cannot_read(const std::filesystem::path& path);
[[noreturn]] void cannot_write(const std::filesystem::path& path, const char* verb = "write");

/// Makes a folder and those above it. @throws IoError if that fails or a file is in the way.
void make_folder(const std::filesystem::path& folder);

/// Removes a folder that complete results do not need. @returns "", or in one sentence why it stays
std::string remove_unneeded(const std::filesystem::path& folder);

/// Where a run with events keeps its phase k, counted from 1: "<folder>/phase_<k>".
std::filesystem::path phase_folder(const std::filesystem::path& folder, std::size_t k);

/// The whole file. @throws InvalidArgument if it cannot be read.
std::string read_file(const std::filesystem::path& path);

/// The name under which a file is written until it is complete: "<path>.new".
std::filesystem::path aside(const std::filesystem::path& path);

/// Writes aside(path) and flushes it to the disk. @throws IoError as the three below
void write_aside(const std::filesystem::path& path, std::string_view content);

/// Flushes a file or the entries of a folder to the disk.
void sync_to_disk(const std::filesystem::path& path);

/// Writes a whole file. The old one, if any, stays until the new one is complete.
void write_file(const std::filesystem::path& path, std::string_view content);

/// Renames aside(path) to path and atomically replaces the file of that name, if any.
void put_in_place(const std::filesystem::path& path);

/// Writes files that belong together, name and content, into a folder, which it makes: all aside,
/// then all in place.
void write_together(const std::filesystem::path& folder,
                    const std::vector<std::pair<std::string, std::string>>& files);

}  // namespace porthos::scene
