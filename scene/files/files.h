#pragma once
#include <cstdio>
#include <filesystem>
#include <string>
#include <string_view>

/// Files that survive a crash: written aside, brought to the disk, renamed.
namespace porthos::scene {

/// For std::unique_ptr<std::FILE, FileCloser>.
struct FileCloser {
  void operator()(std::FILE* f) const { std::fclose(f); }
};

/// Throw "cannot read <path>: <reason of the operating system>", from errno: InvalidArgument, for
/// the path was given; IoError for what cannot be written.
[[noreturn]] void cannot_read(const std::filesystem::path& path);
[[noreturn]] void cannot_write(const std::filesystem::path& path, const char* verb = "write");

/// Makes a folder and those above it. @throws IoError if that fails or a file is in the way.
void make_folder(const std::filesystem::path& folder);

/// The whole file. @throws InvalidArgument if it cannot be read.
std::string read_file(const std::filesystem::path& path);

/// The name a file is written under until it is complete: "<path>.new".
std::filesystem::path aside(const std::filesystem::path& path);

/// Writes aside(path) and brings it to the disk. @throws IoError, as the three below
void write_aside(const std::filesystem::path& path, std::string_view content);

/// Brings a file or the entries of a folder to the disk.
void sync_to_disk(const std::filesystem::path& path);

/// A whole file: the old one, if any, stays until the new one is complete.
void write_file(const std::filesystem::path& path, std::string_view content);

/// Renames aside(path) to path; the file of that name, if any, is replaced in one go.
void put_in_place(const std::filesystem::path& path);

}  // namespace porthos::scene
