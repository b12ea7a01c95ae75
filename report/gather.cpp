#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "mechanics/reconfiguration.h"
#include "phs/error.h"
#include "report/detail/pages.h"
#include "report/detail/playback.h"
#include "report/detail/series.h"
#include "report/report.h"
#include "scene/files/files.h"
#include "scene/read/scene_texts.h"
#include "scene/run/checkpoint.h"
#include "scene/session/event_times-inl.h"
#include "scene/session/moved.h"

namespace porthos::report {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t most_buckets = 3000, most_frames = 2000;

/// {mu, state}: a body on its ellipse, which one by date nearly follows for years.
Json ellipse_of(const space::ThirdBody& b) {
  auto [r, v] = std::pair{b.start.r, b.start.v};
  if (b.ephemeris) {
    constexpr double day = 86400;
    r = b.ephemeris->position(0);
    v = (0.5 / day) * (b.ephemeris->position(day) - b.ephemeris->position(-day));
  }
  return {{"mu", b.total_mu}, {"state", {r.x, r.y, r.z, v.x, v.y, v.z}}};
}

void add_once(std::vector<contact::Shape>& to, const contact::Shape& shape) {
  if (std::ranges::find(to, shape) == to.end()) to.push_back(shape);
}

/// The content of one results folder, as far as it can be read. Unreadable parts are named under
/// "missing".
class Gathered {
 public:
  Gathered(fs::path folder, std::vector<fs::path> models, const Part& part)
      : folder_(std::move(folder)), meshes_(std::move(models)), part_(part) {
    stage_.meshes = &meshes_;
  }

  Json json() {
    std::error_code e;
    if (!fs::is_directory(folder_, e))
      throw InvalidArgument(fmt::format("{} is no folder", folder_.string()));
    const fs::path checkpoint = folder_ / "checkpoint";
    comparison_ = json_file(folder_ / "compare.json");
    summary_ = json_file(folder_ / "summary.json");
    if (summary_.is_object() && !readable(summary_)) {
      summary_ = nullptr;
      miss("summary.json is no summary of Porthos, or damaged");
    }
    const bool run = fs::exists(folder_ / "run.h5"), phases = fs::exists(folder_ / "phase_1"),
               begun = scene::has_checkpoint(checkpoint);
    if (!run && !phases && !begun && summary_.is_null() && comparison_.is_null() &&
        missing_.empty()) {
      throw InvalidArgument(
          fmt::format("{} holds no results: expected summary.json, run.h5, compare.json or "
                      "checkpoint/ of a run",
                      folder_.string()));
    }
    if (phases)
      several_phases();
    else if (run)
      finished_run();
    else if (begun)
      unfinished_run(checkpoint);
    else if (comparison_.is_null())
      miss("run.h5 is not there: no time series and no playback");
    if (comparison_.is_null()) look_beside();
    return all(run || phases, begun);
  }

  std::string missing_meshes() const { return meshes_.missing(); }

 private:
  void miss(const std::string& what) { missing_.push_back(what); }
  /// Runs f; an error it throws is named, and the rest of the report continues.
  template <class F>
  void attempt(const char* what, F f) {
    try {
      f();
    } catch (const std::exception& e) {
      miss(fmt::format("{}: {}", what, e.what()));
    }
  }
  Json json_file(const fs::path& path) {
    if (!fs::exists(path)) return nullptr;
    const Json j = Json::parse(scene::read_file(path), nullptr, false);
    if (j.is_object()) return j;
    miss(path.filename().string() + " is damaged: it is no JSON");
    return nullptr;
  }
  static bool readable(const Json& s) {
    return s.contains("verdict") && s.contains("checks") && s["checks"].is_array() &&
           s.contains("energy") && s["energy"].is_object() && s.contains("method") &&
           s["energy"].contains("drift_is_significant");
  }

  /// Reads the scene and assembles it, from the texts in the results.
  void understand(scene::SceneTexts texts) {
    texts_ = std::move(texts);
    if (texts_.scene.empty()) return miss("the results hold no scene: no playback");
    attempt("no playback, the scene cannot be read again", [&] {
      scene_ = scene::read_scene_again((folder_ / "scene.toml").string(), texts_);
      assembly_ = scene::assemble(*scene_);
    });
  }

  void add_phase(const Records& r, double from) {
    Json phase = {{"from", from}};
    attempt("series", [&] { phase["series"] = Thinned(r, most_buckets).json(); });
    if (stage_.mechanism) {
      stage_.records = &r;
      stage_.recorded = summary_.is_object() && summary_.value("method", "") == "recorded";
      attempt("no motion", [&] {
        phase["motion"] = motion(stage_, most_frames / phase_count_, phase_count_ == 1);
      });
      attempt("no playback",
              [&] { phase["playback"] = playback(stage_, most_frames / phase_count_, part_); });
    }
    phases_.push_back(phase);
  }
  void stage_from_assembly() {
    if (!assembly_) return;
    stage_.mechanism = assembly_->mechanism;
    stage_.bodies = assembly_->parts.bodies();
    stage_.urdf = scene_->urdf_text;
    for (const scene::SceneContact& c : scene_->contacts) {
      for (const std::string& link : c.links)
        if (c.shape) add_once(stage_.touching[link], *c.shape);
      for (const std::string& link : c.against)
        if (link == "world")
          add_once(stage_.world,
                   c.against_shape.value_or(contact::Shape{.kind = contact::Kind::plane}));
        else if (c.against_shape)
          add_once(stage_.touching[link], *c.against_shape);
    }
    stage_.springs = scene::springs_of(*scene_);
    stage_.gravity = scene_->urdf.gravity;
    for (const auto& o : scene_->outputs)
      if (o.quantity == scene::Output::Quantity::joint_wrench)
        stage_.wrenches.emplace_back(o.name, o.of_what);
  }

  void finished_run() {
    attempt("run.h5 is damaged", [&] {
      const auto r = scene::open_run_file(folder_ / "run.h5");
      understand(r->scene());
      stage_from_assembly();
      add_phase(*r, 0);
    });
  }

  void unfinished_run(const fs::path& checkpoint) {
    unfinished_ = true;
    attempt("the unfinished run cannot be read", [&] {
      const auto c = scene::read_checkpoint(checkpoint);
      done_steps_ = c.state.step;
      if (!fs::exists(checkpoint / "scene.toml"))
        return miss("the checkpoint keeps no scene: no time series and no playback");
      understand(scene::texts_beside(checkpoint));
      if (!assembly_) return;
      const auto r = scene::open_log(checkpoint / "records.bin", assembly_->model->description(),
                                     scene::RecordLayout(*scene_, *assembly_));
      if (const std::string trouble = r->trouble(); !trouble.empty()) miss(trouble);
      stage_from_assembly();
      add_phase(*r, 0);
    });
  }

  /// Each phase has a mechanism of its own: the events are applied again to the final states of the
  /// phases.
  void several_phases() {
    int count = 0;
    while (fs::exists(scene::phase_folder(folder_, size_t(count) + 1) / "run.h5")) ++count;
    phase_count_ = std::max(1, count);
    if (summary_.is_null()) unfinished_ = true;
    std::optional<mechanics::MovingMechanism> moving;
    std::vector<std::unique_ptr<Records>> files;  // a damaged one is named below
    for (int k = 0; k < count; ++k) {
      try {
        files.push_back(
            scene::open_run_file(scene::phase_folder(folder_, size_t(k) + 1) / "run.h5"));
      } catch (const std::exception&) {
        break;
      }
    }
    attempt("turning joints", [&] { stage_.run = scene::whole_run(files); });
    double from = 0;
    for (int k = 0; k < count; ++k)
      attempt("a phase of the run cannot be shown", [&] {
        const fs::path folder = scene::phase_folder(folder_, size_t(k) + 1);
        const auto r = scene::open_run_file(folder / "run.h5");
        if (k == 0) {
          understand(r->scene());
          stage_from_assembly();
          if (assembly_) {
            moving.emplace(assembly_->parts);
            pass(*moving, assembly_->initial, 0);
          }
        }
        add_phase(*r, from);
        r->read("time", [&](std::int64_t, std::int64_t rows, int, const double* t) {
          if (rows > 0) from = t[rows - 1];
        });
        if (!moving || k + 1 == count) return;
        pass(*moving, folder, from);
      });
  }
  /// The events after a state, or after that in a folder. The summary has the times of waiting
  /// events.
  template <class At>
  void pass(mechanics::MovingMechanism& moving, const At& last, double time) {
    scene::pass_events(moving, *scene_, last, time, scene::event_times(summary_));
    stage_.mechanism =
        std::shared_ptr<const mechanics::Mechanism>(moving.model, &moving.model->mechanism());
    stage_.bodies = moving.parts.bodies();
  }

  /// results/compare_<name> of the same scene and model.
  void look_beside() {
    if (!summary_.is_object() || !summary_.contains("provenance")) return;
    const fs::path here = fs::absolute(folder_).lexically_normal();
    const std::string name = (here.has_filename() ? here : here.parent_path()).filename().string();
    const fs::path path = here / ".." / ("compare_" + name) / "compare.json";
    const Json c = fs::exists(path) ? Json::parse(scene::read_file(path), nullptr, false) : Json();
    if (!c.is_object() || !c.contains("provenance")) return;
    for (const char* digest : {"scene_sha256", "model_sha256"})
      if (!c["provenance"].contains(digest) || !summary_["provenance"].contains(digest) ||
          c["provenance"][digest] != summary_["provenance"][digest])
        return;
    comparison_ = c;
  }

  Json all(bool finished, bool begun) {
    Json j;
    j["format"] = 1;
    j["kind"] = summary_.is_null() && comparison_.is_object() ? "comparison" : "run";
    j["status"] = status(finished, begun);
    j["folder"] = folder_.filename().string();
    j["missing"] = missing_;
    j["summary"] = summary_;
    j["comparison"] = comparison_;
    j["phases"] = phases_;
    j["meshes"] = meshes_.json();
    if (scene_) describe(j);
    j["texts"] = {{"scene", texts_.scene}, {"model", texts_.urdf}};
    if (summary_.is_object())
      attempt("credibility", [&] {
        j["credibility"] = credibility(summary_, comparison_, scene_ ? &*scene_ : nullptr);
      });
    return j;
  }
  Json status(bool finished, bool begun) const {
    if (unfinished_) {
      std::string text = "This run has not come to its end. The page shows what it had recorded.";
      if (scene_ && done_steps_ > 0)
        text = fmt::format(
            "This run has not come to its end: its checkpoint is at step {} of about {:.0f}. "
            "The page shows what it had recorded.",
            done_steps_, scene_->step > 0 ? scene_->duration / scene_->step : 0);
      return {{"state", "unfinished"}, {"text", text}};
    }
    if (!missing_.empty())
      return {{"state", "damaged"}, {"text", "Part of the results could not be read."}};
    if (finished && begun && summary_.is_object() && summary_.contains("outcome") &&
        summary_["outcome"] == "ok")
      return {{"state", "complete"},
              {"text",
               "A newer run is under way in this folder or was interrupted; this is the "
               "finished one before it."}};
    return {{"state", "complete"}, {"text", ""}};
  }
  void describe(Json& j) const {
    const auto& s = *scene_;
    j["scene"] = {{"title", s.title},
                  {"method", s.method},
                  {"step_s", s.step},
                  {"duration_s", s.duration},
                  {"energy_limit", s.verify.energy ? Json(*s.verify.energy) : Json(nullptr)}};
    if (s.orbit) {
      const auto& p = s.orbit->environment.planet;
      j["planet"] = {{"mu", p.mu},
                     {"radius", p.radius},
                     {"axis", {p.axis.x, p.axis.y, p.axis.z}},
                     {"rate", p.rotation_rate.value_or(0)},
                     {"greenwich", s.orbit->environment.greenwich}};
      for (const auto& body : s.orbit->environment.third_bodies)
        if (body.name == "sun") j["planet"]["sun"] = ellipse_of(body);
    }
    Json notes = Json::array();
    if (assembly_)
      for (const auto& n : assembly_->notes) {
        const auto slash = n.where.rfind('/');
        notes.push_back({{"where", slash == n.where.npos ? n.where : n.where.substr(slash + 1)},
                         {"text", n.text}});
      }
    if (const auto missing = meshes_.missing(); !missing.empty())
      notes.push_back({{"where", "playback"}, {"text", missing}});
    j["model_notes"] = notes;
  }

  fs::path folder_;
  Json summary_, comparison_, phases_ = Json::array();
  std::vector<std::string> missing_;
  scene::SceneTexts texts_;
  std::optional<scene::Scene> scene_;
  std::optional<scene::Assembly> assembly_;
  MeshShelf meshes_;
  Part part_;
  Stage stage_;
  int phase_count_ = 1;
  bool unfinished_ = false;
  std::int64_t done_steps_ = 0;
};

}  // namespace

PageData page_data(const fs::path& folder, const std::vector<fs::path>& models, const Part& part) {
  std::error_code e;
  const auto text = [](const Json& j) {
    return j.dump(-1, ' ', false, Json::error_handler_t::replace);
  };
  const bool run = fs::exists(folder / "summary.json", e) || fs::exists(folder / "run.h5", e);
  if (!run && holds_ensemble(folder)) return {text(ensemble_page(folder)), ""};
  if (!run && holds_identification(folder)) return {text(identification_page(folder)), ""};
  Gathered gathered(folder, models, part);
  return {text(gathered.json()), gathered.missing_meshes()};
}

}  // namespace porthos::report
