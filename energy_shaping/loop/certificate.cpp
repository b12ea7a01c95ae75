#include "energy_shaping/loop/certificate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <span>
#include <utility>

#include "phs/error.h"

namespace porthos::energy_shaping {
namespace {

/// For programs; people read FAILS, and nothing for what is reported.
const char* name_of(Finding f) {
  switch (f) {
    case Finding::holds:
      return "holds";
    case Finding::fails:
      return "fails";
    case Finding::not_judged:
      return "not judged";
    case Finding::reported:
      break;
  }
  return "reported";
}
const char* word(Finding f) {
  return f == Finding::fails ? "FAILS" : f == Finding::reported ? "" : name_of(f);
}

bool stands_open(const CertificateItem& i) {
  return i.finding == Finding::fails || i.finding == Finding::not_judged;
}

std::string list(std::span<const double> numbers) {
  std::string s;
  for (const double x : numbers)
    s += fmt::format("{}{:.5g}", s.empty() ? "" : ", ", unsigned_nan(x));
  return fmt::format("({})", s);
}

/// "joint 0.3, elbow -0.2", and of a state the rest of its numbers behind.
std::string place(const std::vector<double>& at, const std::vector<std::string>& names) {
  if (names.empty() || (at.size() != names.size() && at.size() != 2 * names.size()))
    return list(at);
  std::string s;
  for (size_t i = 0; i < names.size(); ++i)
    s += fmt::format("{}{} {:.5g}", i == 0 ? "" : ", ", names[i], unsigned_nan(at[i]));
  if (at.size() > names.size()) s += ", momenta " + list(std::span(at).subspan(names.size()));
  return s;
}

/// What fails or is not judged, and what to do about each.
std::vector<std::pair<std::string, std::string>> failures(const Certificate& c) {
  std::vector<std::pair<std::string, std::string>> all;
  for (const auto& i : c.items())
    if (stands_open(i)) all.emplace_back(i.name, remedy(i));
  return all;
}

std::string names_of_failures(const Certificate& c) {
  std::string s;
  for (const auto& [name, what] : failures(c)) s += (s.empty() ? "" : "; ") + name;
  return s;
}

/// Of a certificate without failure, with what its conditions do not judge; that of a law of a
/// user's own has no condition.
std::string of_holding(const std::vector<CertificateItem>& items) {
  const auto judged = [](const auto& i) { return i.finding != Finding::reported; };
  if (std::ranges::none_of(items, judged)) return "nothing is checked";
  std::string but;
  for (const auto& i : items)
    if (!judged(i) && !i.help.empty()) but += (but.empty() ? ", but " : "; ") + i.help;
  return "all conditions hold" + but;
}

std::string escaped(const std::string& text) {
  std::string s;
  for (const char c : text)
    s += c == '&'   ? "&amp;"
         : c == '<' ? "&lt;"
         : c == '>' ? "&gt;"
         : c == '"' ? "&quot;"
                    : std::string(1, c);
  return s;
}

nlohmann::json number(double x) {  // JSON has no inf and no NaN
  if (std::isfinite(x)) return x;
  return std::isnan(x) ? "nan" : x > 0 ? "inf" : "-inf";
}

}  // namespace

bool Certificate::has(const std::string& name) const {
  for (const auto& i : items_)
    if (i.name == name) return true;
  return false;
}

const CertificateItem& Certificate::item(const std::string& name) const {
  return find_named(items_, name, "certificate '" + title_ + "' has no item");
}

void Certificate::at_most(const std::string& name, double value, double bound,
                          const std::string& text, std::vector<double> at) {
  add({name,
       value <= bound ? Finding::holds : Finding::fails,
       value,
       bound,
       text,
       {},
       std::move(at)});
}

void Certificate::all_at_most(const std::string& name, double value, double bound,
                              const std::string& text) {
  const auto found =
      std::find_if(items_.begin(), items_.end(), [&](const auto& i) { return i.name == name; });
  if (found != items_.end() && !(value <= found->value)) items_.erase(found);
  if (!has(name)) at_most(name, value, bound, text);
}

void Certificate::at_least(const std::string& name, double value, double bound,
                           const std::string& text, std::vector<double> at) {
  add({name,
       value >= bound ? Finding::holds : Finding::fails,
       value,
       bound,
       text,
       {},
       std::move(at)});
}

void Certificate::report(const std::string& name, double value, const std::string& text,
                         std::vector<double> numbers, std::vector<double> at) {
  add({name, Finding::reported, value, std::numeric_limits<double>::quiet_NaN(), text,
       std::move(numbers), std::move(at)});
}

const CertificateItem* Certificate::failure() const {
  for (const auto& i : items_)
    if (stands_open(i)) return &i;
  return nullptr;
}

std::string Certificate::about(const CertificateItem& i) const {
  std::string s = i.text;
  if (!i.numbers.empty()) s += " " + list(i.numbers);
  if (!i.at.empty()) s += " at " + place(i.at, coordinates_);
  return s;
}

std::string Certificate::text() const {
  std::string s = fmt::format("certificate: {}\n", title_);
  for (const auto& i : items_) {
    s += fmt::format("  {:<34} {:>13.6g} {:>12}  {:<6} {}", i.name, unsigned_nan(i.value),
                     std::isnan(i.bound) ? "" : fmt::format("({:.3g})", i.bound), word(i.finding),
                     about(i));
    s += '\n';
  }
  if (holds()) return s + fmt::format("  {}\n", of_holding(items_));
  s += fmt::format("  NOT certified: {}\n", names_of_failures(*this));
  for (const auto& [name, what] : failures(*this))
    if (!what.empty()) s += fmt::format("    {}: {}\n", name, what);
  return s;
}

std::string Certificate::html() const {
  std::string s = fmt::format(
      "<p><b>{}</b>: {}</p>\n<table>\n<tr><th>condition</th><th>value</th>"
      "<th>bound</th><th></th><th></th></tr>\n",
      escaped(title_),
      holds() ? escaped(of_holding(items_))
              : "not certified: " + escaped(names_of_failures(*this)));
  for (const auto& i : items_) {
    s += fmt::format("<tr><td>{}</td><td>{:.6g}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
                     escaped(i.name), unsigned_nan(i.value),
                     std::isnan(i.bound) ? "" : fmt::format("{:.3g}", i.bound), word(i.finding),
                     escaped(about(i)));
  }
  s += "</table>\n";
  for (const auto& [name, what] : failures(*this))
    if (!what.empty()) s += fmt::format("<p>{}: {}</p>\n", escaped(name), escaped(what));
  return s;
}

std::string Certificate::json() const {
  nlohmann::json j{{"title", title_}, {"holds", holds()}, {"items", nlohmann::json::array()}};
  for (const auto& i : items_) {
    nlohmann::json e{{"name", i.name}, {"value", number(i.value)}, {"text", i.text}};
    e["finding"] = name_of(i.finding);
    if (!std::isnan(i.bound)) e["bound"] = number(i.bound);
    if (stands_open(i) && !remedy(i).empty()) e["remedy"] = remedy(i);
    for (const double x : i.numbers) e["numbers"].push_back(number(x));
    for (const double x : i.at) e["at"].push_back(number(x));
    j["items"].push_back(std::move(e));
  }
  return j.dump(2) + "\n";
}

std::string remedy(const CertificateItem& item) {
  return item.help.empty() ? remedy(item.name) : item.help;
}

std::string remedy(const std::string& condition) {
  static constexpr std::pair<const char*, const char*> all[] = {
      {"M_d > 0", "raise the diagonal of the target mass matrix M_d"},
      {"rank of G", "two actuators act alike there: leave one of them out, or that place"},
      {"H = T + V", "the plant's kinetic energy must be ½ pᵀM⁻¹(q) p, without further terms"},
      {"matching, kinetic energy",
       "M_d or J_2 does not fit the plant there: check its formula and the plant's parameters"},
      {"matching, potential energy",
       "V_d does not fit the plant there: check its formula and the plant's parameters"},
      {"J2 skew", "J_2 + J_2ᵀ must vanish: check the formula of J_2"},
      {"Kv >= 0", "the damping gains must not be negative"},
      {"damping >= 0",
       "friction, of the driven joint too, acts against the shaped kinetic energy: bring M_d "
       "nearer to M, reduce the friction, or design on the plant without it and run that law on "
       "the plant with it"},
      {"rest point", "the springs balance elsewhere: move their rests there, or the rest point"},
      {"gradient of H_d", "the springs balance elsewhere: move their rests there, or the rest"},
      {"Hessian of V_d > 0",
       "raise the stiffness of the coordinate named; of a matched design try another ratio, of the "
       "other sign too"},
      {"Hessian of H_d > 0", "raise the stiffness of the joint named"},
      {"Hessian of H_d >= 0", "raise the stiffness of the controller"},
      {"Riccati equation", "no actuator reaches a motion that does not decay: drive another joint"},
      {"rightmost eigenvalue",
       "a motion near the rest point does not decay: damp a joint that takes part in it"},
      {"H_d' = -∂H_dᵀ R_d ∂H_d",
       "the plant has forces there that the law does not know of: design with them"},
      {"basin, c - H_d(rest)",
       "V_d falls, or stays level, in a direction from the rest point, or the box ends too near: "
       "give each coordinate stiffness, or widen the box"},
  };
  for (const auto& [name, what] : all)
    if (condition == name) return what;
  if (condition.starts_with("run, ") || condition.starts_with("run at "))
    return condition.ends_with("rise of H_d")
               ? "the integrator errs, or the plant has forces that the law does not know of: take "
                 "a shorter step"
               : "start where H_d is below the basin's c, run longer, damp more, raise the limits, "
                 "or hold the law for a shorter period";
  return "";
}

}  // namespace porthos::energy_shaping
