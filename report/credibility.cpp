#include "report/detail/pages.h"

#include <fmt/format.h>

#include <algorithm>

#include "integrators/core/integrator.h"

namespace porthos::report {
namespace {

constexpr const char *stated = "stated", *partly = "partly", *not_stated = "not stated";

bool is_recorded(const Json& s) { return s.at("method") == "recorded"; }

Json row(const char* factor, const char* stands, const std::string& text) {
  return {{"factor", factor}, {"stands", stands}, {"text", text}};
}

std::string number(const Json& j, const char* format = "{:.2g}") {
  return j.is_number() ? fmt::format(fmt::runtime(format), j.get<double>()) : "not known";
}

/// The first comment of a model file, on one line, cut if long: authors often state the source of
/// their numbers there.
std::string first_comment(const std::string& urdf) {
  const auto begin = urdf.find("<!--"), end = urdf.find("-->", begin == urdf.npos ? 0 : begin);
  if (begin == urdf.npos || end == urdf.npos) return "";
  std::string text;
  for (const char c : urdf.substr(begin + 4, end - begin - 4)) {
    const bool blank = c == ' ' || c == '\n' || c == '\t' || c == '\r';
    if (!blank)
      text += c;
    else if (!text.empty() && text.back() != ' ')
      text += ' ';
  }
  if (text.size() <= 400) return text;
  size_t cut = 400;
  while (cut > 0 && (static_cast<unsigned char>(text[cut]) & 0xC0) == 0x80) --cut;  // whole letters
  return text.substr(0, cut) + "…";
}

std::string claims(const std::string& method) {
  for (const auto& d : integrators::catalogue()) {
    if (d.name != method) continue;
    std::string text = fmt::format("{} (order {}", method, d.order);
    if (d.symplectic == integrators::Claim::holds) text += ", symplectic";
    if (d.symmetric == integrators::Claim::holds) text += ", symmetric";
    return text + ")";
  }
  return method;
}

Json verification(const Json& s) {
  size_t passed = 0, axioms = 0;
  bool symmetry = false;
  for (const auto& c : s.at("checks")) {
    passed += c.at("pass").get<bool>();
    axioms += c.at("name").get<std::string>().rfind("axiom", 0) == 0;
    symmetry |= c.at("name") == "symmetry";
  }
  std::string text = fmt::format("{} of {} checks passed, {}. ", passed, s.at("checks").size(),
                                 is_recorded(s) ? "of a trajectory that another program made"
                                                : "integrated by " + claims(s.at("method")));
  bool undecided = false;
  if (s.contains("not_applicable"))
    for (const auto& n : s.at("not_applicable")) {
      undecided |= n.value("undecided", false);
      text += fmt::format("Not applicable: {}, {}. ", n.value("name", ""), n.value("why", ""));
    }
  if (s.at("verdict") == "not judged")
    text += undecided ? "The run is not judged. "
                      : "No check tells of the motion: the run is not judged. ";
  if (is_recorded(s))
    text += "Whether the motion obeys the forces is not among them.";
  else
    text += axioms > 0 ? fmt::format("{} axioms of the system were tested at random states{}.",
                                     axioms, symmetry ? ", and the way forth and back" : "")
                       : "The axioms of the system and its symmetry in time were not tested here: "
                         "porthos verify does.";
  return row("Verification", s.at("verdict") == "not judged" ? partly : stated, text);
}

Json uncertainty(const Json& s, const Json& comparison) {
  const auto& e = s.at("energy");
  const std::string growth = e.value("growth", "grew in a way not recorded");
  std::string text =
      e.at("max_rel_error").is_null()
          ? fmt::format("Numerical: the energy error {}. ", growth)
          : fmt::format("Numerical: the energy error is at most {} relative; it {}. ",
                        number(e.at("max_rel_error")), growth);
  if (comparison.is_object() && comparison.contains("trajectory") &&
      comparison.at("trajectory").at("reference_error").is_number())
    text += fmt::format("Trajectories were compared with a reference known to {}. ",
                        number(comparison.at("trajectory").at("reference_error")));
  return row("Uncertainty", partly, text + "Uncertainty of the parameters: not stated.");
}

Json robustness(const Json& s, const Json& comparison) {
  if (is_recorded(s))
    return row("Robustness", not_stated,
               "How the trajectory depends on method, step and start values of the program that "
               "made it is not known here.");
  if (!comparison.is_object())
    return row(
        "Robustness", not_stated,
        "Sensitivity to method, step and start values was not examined: porthos compare does.");
  std::string text =
      fmt::format("{} trials by other methods and steps. ", comparison.at("runs").size());
  const auto& l = comparison.at("lyapunov");
  text += l.at("chaotic").get<bool>()
              ? fmt::format("Small deviations grow e-fold in {} s. ", number(l.at("time_s")))
              : fmt::format("Small deviations grew {}-fold in {} s, not exponentially. ",
                            number(l.at("growth")), number(l.at("observed_s")));
  return row("Robustness", stated, text + "Sensitivity to the parameters: not stated.");
}

}  // namespace

Json credibility(const Json& s, const Json& comparison, const scene::Scene* scene) {
  Json list = Json::array();
  const std::string source = scene ? first_comment(scene->urdf_text) : "";
  list.push_back(source.empty() ? row("Data pedigree", not_stated,
                                      "The model file says nothing of where its numbers are from.")
                                : row("Data pedigree", partly,
                                      "The model file says of itself: “" + source + "”"));
  list.push_back(verification(s));
  list.push_back(
      row("Validation", not_stated, "No comparison with a measurement is known to this run."));
  std::string inputs =
      fmt::format("{} and model are kept in the results and named by their SHA-256 (below).",
                  is_recorded(s) ? "The scene of the map" : "Scene");
  if (scene && scene->random)
    inputs += fmt::format(" Start values are random, seed {}.", scene->random->seed);
  list.push_back(row("Input pedigree", partly, inputs + " Who chose them, and why: not stated."));
  list.push_back(uncertainty(s, comparison));
  list.push_back(robustness(s, comparison));
  list.push_back(
      row("History of use", not_stated, "Earlier uses of this model are not known to this run."));
  const std::string hash =
      s.contains("provenance") ? s.at("provenance").value("git_hash", "unknown") : "unknown";
  list.push_back(row("Management", hash == "unknown" ? not_stated : partly,
                     hash == "unknown" ? "The program does not know its commit."
                     : is_recorded(s)
                         ? "Of the program that judged, compiler and flags are recorded (below)."
                         : "Program, compiler and flags are recorded (below). Whether the "
                           "sources were those of the commit: not stated."));
  return list;
}

}  // namespace porthos::report
