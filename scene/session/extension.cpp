#include "scene/session/extension.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstdlib>

#include "scene/assemble/steps.h"
#include "scene/compare/auto_method.h"
#include "scene/files/files.h"
#include "scene/files/hdf5_reader.h"
#include "scene/read/scene_texts.h"
#include "scene/run/checkpoint.h"
#include "scene/run/columns.h"

namespace porthos::scene {
namespace fs = std::filesystem;
namespace {

constexpr std::int64_t rows_a_piece = 4096;

/// The number at the start of a text of a fingerprint, "1000 s".
double number_in(const Checkpoint& c, const char* name) {
  for (const auto& [known, value] : c.fingerprint)
    if (known == name) return std::strtod(value.c_str(), nullptr);
  throw InvalidArgument(fmt::format("the checkpoint does not state its {}", name));
}

/// Writes the records of run.h5 as the log they came from.
LogMark log_again(const fs::path& file, const fs::path& log, const Scene& scene,
                  const Assembly& assembly) {
  const RecordLayout layout(scene, assembly);
  const auto columns = columns_of(assembly.model->description(), layout);
  const Hdf5Reader reader(file);
  const std::int64_t n = reader.dataset("time").size();
  std::vector<std::vector<std::int64_t>> integers(columns.size());
  for (size_t k = 0; k < columns.size(); ++k) {
    const auto& c = columns[k];
    if (reader.dataset(c.name).size() != n * std::int64_t(c.columns))
      throw InvalidArgument(fmt::format("{}: {} does not have {} rows", file.string(), c.name, n));
    if (!c.integer) continue;
    integers[k].resize(size_t(n) * c.columns);
    reader.read(c.name, integers[k].data());
  }
  RecordLog to(log, layout);
  std::vector<double> rows, piece;
  for (std::int64_t at = 0; at < n; at += rows_a_piece) {
    const auto here = size_t(std::min(rows_a_piece, n - at));
    rows.resize(here * layout.size());
    for (size_t k = 0; k < columns.size(); ++k) {
      const auto& c = columns[k];
      piece.resize(here * c.columns);
      if (!c.integer) reader.read_rows(c.name, at, std::int64_t(here), piece.data());
      for (size_t i = 0; i < piece.size(); ++i) {
        const double v =
            c.integer ? std::bit_cast<double>(integers[k][size_t(at) * c.columns + i]) : piece[i];
        rows[i / c.columns * layout.size() + c.first + i % c.columns] = v;
      }
    }
    for (size_t i = 0; i < here; ++i)
      to.append(std::span<const double>(rows).subspan(i * layout.size(), layout.size()));
  }
  to.sync();
  return to.mark();
}

}  // namespace

void extend_to(Scene& scene, const std::string& folder, double end) {
  if (!scene.events.empty())
    throw InvalidArgument(
        "a run with events cannot be extended, expected another scene that starts from its "
        "results, "
        "with [initial] from, or a longer duration from the beginning");
  const fs::path out(folder);
  const bool begun = has_checkpoint(out / "checkpoint");
  if (!begun && !has_checkpoint(out / "end"))
    throw InvalidArgument(fmt::format(
        "{} has no finished run that can be continued, expected the results of one", folder));
  if (scene.step_control != integrators::StepControl::fixed)
    throw InvalidArgument(
        "a run with a step control cannot be extended, because its last step was shortened: start "
        "another one from its last state, with [initial] from");
  const Checkpoint c = read_checkpoint(out / (begun ? "checkpoint" : "end"));
  scene.record_every = number_in(c, "record_every");
  scene.record_every_given = true;
  const double before = number_in(c, "duration");
  scene.duration = end;
  if (begun) return;
  if (!(end > before))
    throw InvalidArgument(
        fmt::format("the run in {} ends at {:g} s, expected a later time", folder, before));
  const double step = number_in(c, "step"), reached = c.state.time(step);
  if (std::fabs(reached - before) > 1e-9 * before || c.state.origin_step != 0)
    throw InvalidArgument(fmt::format(
        "the run in {} ended at {:.17g} s between two whole steps, by a stop or a last short step, "
        "and cannot be extended: start another one from its last state, with [initial] from",
        folder, reached));
}

void reopen(const std::string& folder, const Scene& given, const Assembly& assembly) {
  const fs::path out(folder), open = out / "checkpoint";
  if (has_checkpoint(open)) return;
  Checkpoint c = read_checkpoint(out / "end");
  const Scene scene = given.method == auto_method ? with_method_of(c, given) : given;
  const auto now = fingerprint(scene);
  for (auto& [name, value] : c.fingerprint)
    for (const auto& [known, text] : now)
      if (name == "duration" && known == name) value = text;
  if (const auto changes = difference(c.fingerprint, now); !changes.empty())
    throw InvalidArgument(fmt::format("the run in {} is of another scene: {}", folder, changes));
  make_folder(open);
  const LogMark mark = log_again(out / "run.h5", open / "records.bin", scene, assembly);
  if (mark.records != c.log.records || mark.digest != c.log.digest) {
    std::error_code ignored;
    fs::remove_all(open, ignored);
    throw InvalidArgument(fmt::format("{} does not hold the records of the run that ended in {}",
                                      (out / "run.h5").string(), (out / "end").string()));
  }
  if (!scene.text.empty()) write_texts(open, scene);
  write_checkpoint(open, c);
}

}  // namespace porthos::scene
