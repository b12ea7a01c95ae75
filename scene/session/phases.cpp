#include "scene/session/phases.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "scene/files/files.h"
#include "scene/run/checkpoint.h"
#include "scene/run/phase_sequence.h"
#include "scene/session/report_reader.h"
#include "scene/session/results.h"

namespace porthos::scene {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

fs::path end_folder(const fs::path& phase) { return phase / "end"; }

Json json_of(const Happened& h, const std::optional<CentreOfMass>& centre) {
  const mechanics::Impact& i = h.impact;
  const auto [P, L] = centre ? centre->in_world(h.at, i.momentum) : i.momentum;
  return {{"at_s", h.at},
          {"event", text(*h.event)},
          {"dissipated_J", i.dissipated_J},
          {"driven_J", i.driven_J},
          {"linear_momentum", {P.x, P.y, P.z}},
          {"angular_momentum", {L.x, L.y, L.z}},
          {"linear_momentum_jump", i.linear_jump},
          {"angular_momentum_jump", i.angular_jump},
          {"largest_twist_jump", i.rate_jump}};
}

/// The phases of a run, each in its folder.
class PhaseFolders {
 public:
  PhaseFolders(const Scene& scene, const Assembly& assembly, const RunOptions& options)
      : scene_(scene), assembly_(assembly), options_(options), phases_(scene, assembly) {}

  RunReport run() {
    make_folder(options_.out);
    if (!options_.resume) {
      refuse_unfinished(options_.out);
      remove_results(options_.out);
    }
    while (const Phase* p = phases_.next()) {
      const fs::path folder = phase_folder(options_.out, size_t(phases_.count()) + 1);
      const bool known = options_.resume && has_checkpoint(end_folder(folder));
      const RunReport r = known ? read(*p, folder) : run(*p, folder);
      try {
        phases_.done(r);
      } catch (const InvalidArgument& why) {
        phases_.give_up(why.what());
      }
      if (r.interrupted) return phases_.finish();
      if (r.outcome != integrators::Outcome::ok) break;
      folders_.push_back(
          {{"folder", folder.filename().string()}, {"from_s", p->from}, {"to_s", phases_.now()}});
    }
    const RunReport r = phases_.finish();
    write_summary(r);
    return r;
  }

 private:
  RunReport run(const Phase& p, const fs::path& folder) const {
    RunOptions o = options_;
    o.out = folder.string();
    o.resume = options_.resume && has_checkpoint(folder / "checkpoint");
    o.until = p.until;
    const double end = p.scene.duration;
    if (options_.progress)
      o.progress = [&, end](double done, double spent, double left) {
        const double now = (p.from + done * (end - p.from)) / scene_.duration;
        options_.progress(
            now, spent,
            now > 0 && done > 0 ? left + spent * (1 - end / scene_.duration) / now : left);
      };
    const RunReport r = scene::run(p.scene, p.assembly, o);
    if (r.interrupted || r.outcome != integrators::Outcome::ok) return r;
    make_folder(end_folder(folder));
    Checkpoint c;
    c.state = r.final_state;
    c.memory = r.held;
    c.fingerprint = fingerprint(p.scene);
    c.statistics = {double(r.until)};
    write_checkpoint(end_folder(folder), c);
    return r;
  }

  /// The report of a phase that an earlier run has finished.
  static RunReport read(const Phase& p, const fs::path& folder) {
    const Checkpoint done = read_checkpoint(end_folder(folder));
    if (const auto changes = difference(done.fingerprint, fingerprint(p.scene)); !changes.empty())
      throw InvalidArgument(
          fmt::format("the phase in {} is of another run: {}", folder.string(), changes));
    RunReport r = read_report(folder, done.state);
    r.held = done.memory;
    r.until = int(done.statistics.at(0));
    return r;
  }

  void write_summary(const RunReport& r) const {
    Json summary = Json::parse(summary_json(scene_, phases_.last(), r, r.final_state));
    summary["events"] = Json::array();
    for (const Happened& h : phases_.happened())
      summary["events"].push_back(json_of(h, assembly_.centre));
    summary["phases"] = folders_;
    const fs::path path = fs::path(options_.out) / "summary.json";
    write_file(path, summary.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
  }

  const Scene& scene_;
  const Assembly& assembly_;
  const RunOptions& options_;
  PhaseSequence phases_;
  Json folders_ = Json::array();
};

}  // namespace

void refuse_unfinished(const std::string& out) {
  const fs::path folder = fs::path(out) / "checkpoint";
  bool unfinished =
      has_checkpoint(folder) && read_checkpoint(folder).outcome == integrators::Outcome::ok;
  const bool finished = fs::exists(fs::path(out) / "summary.json");
  for (size_t k = 1; !finished && fs::exists(phase_folder(out, k)); ++k)
    unfinished |= has_checkpoint(phase_folder(out, k) / "checkpoint") ||
                  has_checkpoint(end_folder(phase_folder(out, k)));
  if (unfinished)
    throw InvalidArgument(
        fmt::format("{} holds an unfinished run: use --resume (in Python resume=True) to continue "
                    "it, or remove the folder",
                    out));
}

RunReport run_phases(const Scene& scene, const Assembly& assembly, const RunOptions& options) {
  (void)rehearse(scene, assembly);
  return PhaseFolders(scene, assembly, options).run();
}

}  // namespace porthos::scene
