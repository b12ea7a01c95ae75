// The results of porthos identify: table, JSON, picture, scene.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "scene/files/files.h"
#include "scene/files/text_table.h"
#include "scene/identification/identification.h"
#include "scene/plot/shown.h"
#include "scene/plot/trace_plot.h"
#include "scene/read/toml_table-inl.h"
#include "scene/run/provenance.h"

namespace porthos::scene {
namespace {

using Json = nlohmann::ordered_json;  // writes non-finite numbers as null

/// "link_6.mass +1.00, link_6.com.x -0.31": the parameters that move by a tenth of the largest.
std::string moves_text(const Identification& r, const Combination& c) {
  std::vector<size_t> order;
  for (size_t i = 0; i < c.moves.size(); ++i)
    if (std::fabs(c.moves[i]) >= 0.1) order.push_back(i);
  std::ranges::stable_sort(order, std::greater<>(),
                           [&](size_t i) { return std::fabs(c.moves[i]); });
  std::string text;
  for (const size_t i : order)
    add_to_list(text, fmt::format("{} {:+.2f}", r.found[i].of.name, c.moves[i]));
  return text;
}

std::string untold_text(const Identification& r) {
  std::string text;
  for (const Combination& c : r.combinations) {
    if (c.told) continue;
    text += fmt::format("untold      {}: {}\n",
                        std::isfinite(c.deviation) ? fmt::format("1 sigma {:.2g}", c.deviation)
                                                   : std::string("no effect"),
                        moves_text(r, c));
  }
  if (text.empty()) {
    const Combination& last = r.combinations.back();
    return fmt::format("told        all combinations; the least, to {:.2g}: {}\n", last.deviation,
                       moves_text(r, last));
  }
  return text +
         "            the log does not tell these combinations, in parts of each parameter's "
         "size, within a whole change\n";
}

std::string agreement_text(const Identification& r) {
  TextRows rows{{"column", "unit", "rms before", "rms after", "sigma"}};
  for (const Agreement& a : r.columns)
    rows.push_back({a.of.name, a.of.unit, fmt::format("{:.3g}", a.before),
                    fmt::format("{:.3g}", a.after),
                    a.sigma > 0 ? fmt::format("{:.3g}", a.sigma) : "-"});
  return aligned(rows);
}

std::string parameters_text(const Identification& r) {
  TextRows rows{{"parameter", "start", "found", "1 sigma", "unit"}};
  for (const Found& f : r.found)
    rows.push_back({f.of.name, fmt::format("{:.6g}", f.of.start), fmt::format("{:.6g}", f.value),
                    std::isfinite(f.deviation) ? fmt::format("{:.2g}", f.deviation) : "not told",
                    f.of.unit});
  return aligned(rows);
}

/// The size of what is left over at the times, of at most 1000 stretches the largest.
Json sizes_json(const std::vector<double>& residual, size_t stretch) {
  Json all = Json::array();
  for (size_t i = 0; i < residual.size(); i += stretch) {
    double most = 0;
    for (size_t k = i; k < std::min(i + stretch, residual.size()); ++k)
      most = std::max(most, std::fabs(residual[k]));
    all.push_back(most);
  }
  return all;
}
Json residuals_json(const Identification& r) {
  const size_t stretch = (r.times.size() + 999) / 1000;
  Json j{{"t", Json::array()}, {"before", Json::array()}, {"after", Json::array()}};
  for (size_t i = 0; i < r.times.size(); i += stretch) j["t"].push_back(r.times[i]);
  for (size_t c = 0; c < r.columns.size(); ++c) {
    j["before"].push_back(sizes_json(r.before[c], stretch));
    j["after"].push_back(sizes_json(r.after[c], stretch));
  }
  return j;
}

/// The size of what is left over, in sigma, before and after, of up to six columns.
std::string residual_plot(const Identification& r) {
  constexpr size_t most = 6;
  std::vector<TracePanel> panels;
  const auto shown = Shown::bands(std::int64_t(r.times.size()), most_shown);
  const auto t = shown.times(shown.picked(r.times));
  for (size_t i = 0; i < std::min(most, r.columns.size()); ++i) {
    const auto sizes = [&](const std::vector<double>& residual) {
      std::vector<double> all = shown.picked(residual);
      for (double& x : all) x = std::fabs(x);
      return shown.values(all);
    };
    const bool known = r.noise_known();
    panels.push_back(
        {r.columns[i].of.name + (known ? " [sigma]" : " [" + r.columns[i].of.unit + "]"),
         {{"with the start values", t, sizes(r.before[i])}, {"as found", t, sizes(r.after[i])}},
         true});
  }
  return trace_plot(panels, r.title + ": |run - log|",
                    fmt::format("{} by {}, {:g} s a step", r.log, r.method, r.step));
}

/// The text of a scene for another folder, from which it finds the model file.
std::string moved_to(const std::filesystem::path& folder, const Scene& scene,
                     const std::string& text) {
  toml::table root = parse_toml(text, File{scene.path});
  root["model"].as_table()->insert_or_assign(
      "urdf", std::filesystem::proximate(scene.urdf_path, folder).generic_string());
  std::ostringstream moved;
  moved << root << "\n";
  return moved.str();
}

}  // namespace

std::string identification_text(const Identification& r) {
  std::string text = fmt::format(
      "{}: {} from {}, {} times up to {:g} s\n\n", r.title,
      r.found.size() == 1 ? "1 parameter" : fmt::format("{} parameters", r.found.size()), r.log,
      r.times.size(), r.times.back());
  text += parameters_text(r) + "\n" + agreement_text(r) + "\n";
  if (r.noise_known())
    text += fmt::format(
        "residual    chi^2 {:.1f} for {} degrees of freedom, {:+.1f} sigma from "
        "what the noise gives\n",
        r.chi_square, r.freedoms, r.surprise());
  else
    text += fmt::format("residual    the noise is taken from it, {:.3g} {}\n", r.noise,
                        r.columns.front().of.unit);
  text += fmt::format("step        half of it moves the values by {:.2g} sigma at most\n",
                      r.step_error);
  text += untold_text(r);
  if (r.by_momenta)
    text +=
        "start       bodies by least squares of their momenta: nearer to the log than the scene\n";
  text += fmt::format("cost        {} iterations, {} runs, {} of them with {} tangents{}\n",
                      r.iterations, r.runs, r.runs_with_tangents, r.found.size(),
                      r.refused > 0 ? fmt::format("; {} steps refused", r.refused) : "");
  for (const auto& note : r.notes) text += "note        " + note + "\n";
  return text;
}

std::string identification_json(const Scene& scene, const Identification& r) {
  Json j{{"title", r.title},         {"log", r.log},
         {"method", r.method},       {"step_s", r.step},
         {"converged", r.converged}, {"parameters", Json::array()}};
  const size_t n = r.found.size();
  for (const Found& f : r.found)
    j["parameters"].push_back({{"name", f.of.name},
                               {"unit", f.of.unit},
                               {"start", f.of.start},
                               {"found", f.value},
                               {"deviation", f.deviation},
                               {"scale", f.of.scale}});
  j["covariance"] = Json::array();
  for (size_t i = 0; i < n; ++i)
    j["covariance"].push_back(
        std::vector<double>(r.covariance.begin() + std::ptrdiff_t(i * n),
                            r.covariance.begin() + std::ptrdiff_t(i * n + n)));
  j["combinations"] = Json::array();
  for (const Combination& c : r.combinations)
    j["combinations"].push_back({{"deviation", c.deviation}, {"told", c.told}, {"moves", c.moves}});
  j["columns"] = Json::array();
  for (const Agreement& a : r.columns)
    j["columns"].push_back({{"name", a.of.name},
                            {"unit", a.of.unit},
                            {"sigma", a.sigma > 0 ? Json(a.sigma) : Json()},
                            {"rms_before", a.before},
                            {"rms_after", a.after}});
  j["residuals"] = residuals_json(r);
  j["chi_square"] = r.chi_square;
  j["degrees_of_freedom"] = r.freedoms;
  j["noise"] = r.noise;
  j["noise_known"] = r.noise_known();
  j["surprise"] = r.surprise();
  j["step_error"] = r.step_error;
  j["start"] = r.by_momenta ? "momenta" : "scene";
  j["cost"] = {{"iterations", r.iterations},
               {"runs", r.runs},
               {"runs_with_tangents", r.runs_with_tangents},
               {"refused", r.refused}};
  j["notes"] = r.notes;
  for (const auto& [name, value] : provenance(scene)) j["provenance"][name] = value;
  return j.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

void write_identification(const std::string& folder, const Scene& scene, const Identification& r) {
  make_folder(folder);  // before the path of the model from it is asked for
  write_together(folder, {{"found.toml", fmt::format("# Found by porthos identify from {}.\n{}",
                                                     r.log, moved_to(folder, scene, r.scene))},
                          {"identify.svg", residual_plot(r)},
                          {"identify.txt", identification_text(r)},
                          {"identify.json", identification_json(scene, r)}});
}

}  // namespace porthos::scene
