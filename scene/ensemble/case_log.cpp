#include "scene/ensemble/case_log.h"

#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <string>

#include "phs/error.h"
#include "scene/files/files.h"

namespace porthos::scene {
namespace {

constexpr const char* first_line = "porthos cases 1";

/// The head of a log: a line per entry of the fingerprint, and the size of a row.
std::string head_of(const NamedTexts& fingerprint, const CaseLayout& l) {
  std::string text = fmt::format("{}\n{}\n{}\n", first_line, l.size(), fingerprint.size());
  for (const auto& [name, value] : fingerprint) text += name + "\t" + value + "\n";
  return text;
}

std::string line_of(std::FILE* f) {
  std::string line;
  for (int c; (c = std::fgetc(f)) != EOF && c != '\n';) line += char(c);
  return line;
}

/// Whether a file holds less than its head: it is new, or its writer was killed.
bool is_begun_head(std::FILE* f, const std::string& head) {
  std::string there(head.size(), '\0');
  std::rewind(f);
  there.resize(std::fread(there.data(), 1, there.size(), f));
  return there.size() < head.size() && head.compare(0, there.size(), there) == 0;
}

}  // namespace

CaseLog::CaseLog(const std::filesystem::path& path, const CaseLayout& layout,
                 const NamedTexts& fingerprint)
    : path_(path), layout_(layout) {
  file_.reset(std::fopen(path.c_str(), "a+b"));
  if (!file_) cannot_write(path);
  if (flock(fileno(file_.get()), LOCK_EX | LOCK_NB) != 0) {
    if (errno != EWOULDBLOCK) cannot_write(path, "lock");
    throw InvalidArgument("another process is writing into " + path.string());
  }
  const std::string head = head_of(fingerprint, layout);
  std::FILE* const f = file_.get();
  if (is_begun_head(f, head)) {
    if (ftruncate(fileno(f), 0) != 0) cannot_write(path);
    if (std::fwrite(head.data(), 1, head.size(), f) != head.size()) cannot_write(path);
    begin_ = end_ = Place(head.size());
    sync();
    return;
  }
  std::rewind(f);
  const auto damaged = [&] {
    throw InvalidArgument(path.string() + " is no log of cases, or its head is damaged");
  };
  if (line_of(f) != first_line) damaged();
  const std::string size = line_of(f), count = line_of(f);
  NamedTexts before;
  for (int i = std::atoi(count.c_str()); i > 0 && i < 1000; --i) {
    const std::string line = line_of(f);
    const size_t tab = line.find('\t');
    if (tab == std::string::npos) damaged();
    before.emplace_back(line.substr(0, tab), line.substr(tab + 1));
  }
  if (const auto changes = difference(before, fingerprint); !changes.empty())
    throw InvalidArgument(fmt::format("{} is of another ensemble: {}", path.string(), changes));
  if (size != std::to_string(layout.size())) damaged();
  begin_ = std::ftell(f);
  find_end();
  if (ftruncate(fileno(f), end_) != 0) cannot_write(path);
}

void CaseLog::find_end() {
  std::vector<double> row(layout_.size());
  end_ = begin_;
  std::fseek(file_.get(), begin_, SEEK_SET);
  for (Place next = begin_ + bytes();
       std::fread(row.data(), sizeof(double), row.size(), file_.get()) == row.size();
       next += bytes())
    if (layout_.sound(row))
      end_ = next;
    else
      ++damaged_;
}

CaseLog::Place CaseLog::append(std::span<const double> row) {
  // Passed to the operating system at once: a killed process loses no finished case.
  if (std::fseek(file_.get(), 0, SEEK_END) != 0 ||
      std::fwrite(row.data(), sizeof(double), row.size(), file_.get()) != row.size() ||
      std::fflush(file_.get()) != 0)
    cannot_write(path_);
  const Place at = end_;
  end_ += bytes();
  return at;
}

void CaseLog::sync() {
  if (std::fflush(file_.get()) != 0) cannot_write(path_);
  if (fsync(fileno(file_.get())) != 0 && errno != EINVAL) cannot_write(path_);
}

void CaseLog::read(Place place, std::span<double> row) const {
  if (std::fseek(file_.get(), place, SEEK_SET) != 0 ||
      std::fread(row.data(), sizeof(double), row.size(), file_.get()) != row.size())
    cannot_read(path_);
}

}  // namespace porthos::scene
