#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <chrono>

#include "scene/ensemble/ensemble.h"
#include "scene/files/files.h"

namespace porthos::scene {
namespace fs = std::filesystem;

Part part_of(const std::string& text) {
  Part p{0, 0};
  const char *at = text.data(), *const end = at + text.size();
  const auto k = std::from_chars(at, end, p.k);
  const bool slash = k.ec == std::errc() && k.ptr != end && *k.ptr == '/';
  const auto n = slash ? std::from_chars(k.ptr + 1, end, p.n) : k;
  if (!slash || n.ec != std::errc() || n.ptr != end)
    throw InvalidArgument(
        fmt::format("--part: part is '{}', expected K/N, such as 1/8 to 8/8", text));
  if (p.n < 1 || p.n > 1'000'000 || p.k < 1 || p.k > p.n)
    throw InvalidArgument(
        fmt::format("--part: part is {}/{}, expected 1/N to N/N, N at most a million", p.k, p.n));
  return p;
}

CaseStore::CaseStore(const Ensemble& ensemble, const fs::path& out, Part part, bool resume)
    : ensemble_(ensemble),
      folder_(out / "parts"),
      part_(part),
      place_(size_t(ensemble.cases().cases)) {
  const auto cases = ensemble.cases().cases;
  if (part.n > cases)
    throw InvalidArgument(fmt::format(
        "--part: {} parts of {} cases, expected at most one part per case", part.n, cases));
  of_part_ = (cases - part.k) / part.n + 1;
  make_folder(folder_);
  const fs::path own = folder_ / fmt::format("{}_of_{}.bin", part.k, part.n);
  std::vector<fs::path> paths;
  for (const auto& entry : fs::directory_iterator(folder_))
    if (entry.path().extension() == ".bin") paths.push_back(entry.path());
  std::sort(paths.begin(), paths.end());
  const bool begun = std::find(paths.begin(), paths.end(), own) != paths.end();
  if (!resume && (begun || (part.whole() && !paths.empty())))
    throw InvalidArgument(
        fmt::format("{} holds an unfinished ensemble: use --resume to continue it, or remove {}",
                    folder_.parent_path().string(), folder_.string()));
  if (part.whole())  // the whole continues the logs of the parts
    for (const auto& path : paths)
      if (path != own)
        logs_.push_back(std::make_unique<CaseLog>(path, ensemble.layout(), ensemble.identity()));
  logs_.push_back(std::make_unique<CaseLog>(own, ensemble.layout(), ensemble.identity()));
  own_ = logs_.back().get();
  for (size_t i = 0; i < logs_.size(); ++i) take_in(int(i));
}

void CaseStore::take_in(int log) {
  const CaseLayout& l = ensemble_.layout();
  logs_[size_t(log)]->each([&](std::span<const double> row, CaseLog::Place at) {
    const std::int64_t i = integer(row[l.index]);
    if (i < 0 || i >= ensemble_.cases().cases)
      throw InvalidArgument(logs_[size_t(log)]->path().string() + " has a case out of range");
    if (has(i)) return;
    place_[size_t(i)] = {log, at};
    ++done_;
    if (part_.has(i)) ++part_done_;
  });
}

void CaseStore::add(std::span<const double> row) {
  const std::int64_t i = integer(row[ensemble_.layout().index]);
  if (has(i)) return;  // done twice, same bits
  place_[size_t(i)] = {int(logs_.size()) - 1, own_->append(row)};
  ++done_;
  if (part_.has(i)) ++part_done_;
}

std::int64_t CaseStore::missing(std::int64_t from) const {
  from += (part_.k - 1 - from % part_.n + part_.n) % part_.n;
  for (; from < ensemble_.cases().cases; from += part_.n)
    if (!has(from)) return from;
  return -1;
}

std::string CaseStore::damage() const {
  std::string text;
  for (const auto& log : logs_)
    if (log->damaged() > 0)
      add_to_list(text, fmt::format("{} rows of {}", log->damaged(), log->path().string()));
  return text.empty() ? text : text + " were damaged: their cases were run again";
}

void CaseStore::read(std::int64_t index, std::span<double> row) const {
  const Where& w = place_[size_t(index)];
  logs_[size_t(w.log)]->read(w.place, row);
}

void CaseStore::require_complete() const {
  const std::int64_t cases = ensemble_.cases().cases;
  if (done_ == cases) return;
  std::vector<std::int64_t> first;
  for (std::int64_t i = 0; i < cases && first.size() < 5; ++i)
    if (!has(i)) first.push_back(i);
  throw InvalidArgument(fmt::format(
      "{} lacks {} of {} cases (the first: {}): run the parts that are missing, or use --resume",
      folder_.string(), cases - done_, cases, fmt::join(first, ", ")));
}

std::string CaseStore::remove() {
  logs_.clear();
  own_ = nullptr;
  return remove_unneeded(folder_);
}

namespace {

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace

CaseProgress::CaseProgress(const CaseStore& store, const EnsembleOptions& options)
    : store_(store), options_(options), before_(store.part_done()), start_(now()) {}

double CaseProgress::spent() const { return now() - start_; }

void CaseProgress::report_progress() {
  if (!options_.progress || now() - last_ < 0.25) return;
  last_ = now();
  const double here = double(store_.part_done() - before_);
  const double left = double(store_.of_part() - store_.part_done());
  options_.progress(double(store_.part_done()) / double(store_.of_part()), spent(),
                    spent() * left / std::max(1.0, here));
}

EnsembleReport run_ensemble(const Ensemble& ensemble, const EnsembleOptions& o) {
  CaseStore store(ensemble, o.out, o.part, o.resume || o.join);
  if (o.join) {
    store.require_complete();
    return finish_ensemble(ensemble, store, o);
  }
  CaseProgress progress(store, o);
  const std::int64_t before = store.part_done();
  std::int64_t from = 0;
  double synced = 0;
  ensemble.work(
      [&] {
        const std::int64_t i = from < 0 ? -1 : store.missing(from);
        from = i < 0 ? -1 : i + 1;
        return i;
      },
      [&](std::span<const double> row) {
        store.add(row);
        progress.report_progress();
        if (progress.spent() - synced > 5) {
          store.sync();
          synced = progress.spent();
        }
      },
      {.threads = o.threads, .lanes = o.lanes, .stop = o.stop});
  store.sync();
  const double wall = progress.spent();
  const std::int64_t run = store.part_done() - before;
  EnsembleReport r = finish_ensemble(ensemble, store, o);
  r.wall_s = wall;
  r.run_here = run;
  r.interrupted = store.part_done() < store.of_part() && !r.complete;
  return r;
}

}  // namespace porthos::scene
