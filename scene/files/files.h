#pragma once
#include <cstdio>
#include <filesystem>
#include <string>
#include <string_view>

/// Files that survive a crash: written aside, brought to the disk, renamed.
namespace porthos::scene {

struct FileCloser {
  void operator()(std::FILE* f) const { std::fclose(f); }
};

/// Throws InvalidArgument "cannot <verb> <path>: <reason of the operating system>", from errno.
[[noreturn]] void cannot(const char* verb, const std::filesystem::path& path);

/// Makes a folder and those above it. @throws InvalidArgument if that fails or a file is in the
/// way.
void make_folder(const std::filesystem::path& folder);

/// The whole file. @throws InvalidArgument if it cannot be read.
std::string read_file(const std::filesystem::path& path);

/// The name a file is written under until it is complete: "<path>.new".
std::filesystem::path aside(const std::filesystem::path& path);

/// Writes aside(path) and brings it to the disk.
void write_aside(const std::filesystem::path& path, std::string_view content);

/// Brings a file or the entries of a folder to the disk.
void sync_to_disk(const std::filesystem::path& path);

/// Renames aside(path) to path; the file of that name, if any, is replaced in one go.
void put_in_place(const std::filesystem::path& path);

}  // namespace porthos::scene
