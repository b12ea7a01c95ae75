#include "integrators/catalogue.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <string_view>

#include "integrators/methods/composition.h"
#include "integrators/methods/discrete_gradient.h"
#include "integrators/methods/gauss.h"
#include "integrators/methods/hbvm.h"
#include "integrators/methods/lobatto.h"
#include "integrators/methods/moreau.h"
#include "integrators/methods/projected_gauss.h"
#include "integrators/methods/radau15.h"
#include "integrators/methods/rattle.h"
#include "integrators/methods/rk4.h"
#include "integrators/methods/semi_implicit_euler.h"
#include "integrators/methods/spark.h"
#include "integrators/methods/splitting.h"
#include "integrators/methods/stormer_verlet.h"
#ifdef PORTHOS_SUNDIALS
#include "integrators/rivals/sundials.h"
#endif
#include "integrators/methods/tao.h"
#include "phs/system/check.h"
#include "phs/system/power_names.h"

namespace porthos::integrators {
namespace {

/// Deques: references stay valid when methods are added.
struct Catalogue {
  std::deque<Entry> entries;
  std::deque<Declaration> declarations;
  size_t own;  ///< the first ones, those of Porthos
  std::map<std::string, std::string> versions;

  Catalogue() {
    for (const auto family : {
             gauss_entries,
             spark_entries,
             projected_gauss_entries,
             rattle_entries,
             composition_entries,
             stormer_verlet_entries,
             lobatto_entries,
             splitting_entries,
             tao_entries,
             hbvm_entries,
             discrete_gradient_entries,
             radau15_entries,
             moreau_entries,
             semi_implicit_euler_entries,
             rk4_entries,
#ifdef PORTHOS_SUNDIALS
             sundials_entries,
#endif
         })
      for (auto& e : family()) add(std::move(e));
    own = entries.size();
  }
  void add(Entry e) {
    declarations.push_back(e.declaration);
    entries.push_back(std::move(e));
  }
};
Catalogue& all() {
  static Catalogue c;
  return c;
}

}  // namespace

const char* to_string(Claim c) {
  return c == Claim::holds ? "holds" : c == Claim::fails ? "fails" : "unknown";
}

const char* to_string(Outcome o) {
  switch (o) {
    case Outcome::ok:
      return "ok";
    case Outcome::not_converged:
      return "the implicit equations did not converge: take a smaller step";
    case Outcome::not_finite:
      return "the state became infinite or not a number: take a smaller step";
    case Outcome::failed:
      return "the method gave up";
    case Outcome::singular:
      return "the loops lose rank at a singular position, where the motion may branch: expected a "
             "coupling that tells the branch, or another motion";
    case Outcome::jammed:
      return "the rigid contacts cannot go on";
  }
  return "unknown";
}

void add_entry(Entry entry, std::string version) {
  Catalogue& c = all();
  const std::string name = entry.declaration.name;
  const bool plain = std::ranges::all_of(name, [](char l) {
    return std::isalnum(static_cast<unsigned char>(l)) || l == '_' || l == '-' || l == '.';
  });
  if (name.empty() || !plain)
    throw InvalidArgument("a method's name is '" + name + "', expected letters, digits, _ - .");
  if (name == "auto")
    throw InvalidArgument("'auto' lets Porthos choose a method, expected another name");
  for (size_t i = 0; i < c.entries.size(); ++i) {
    if (c.entries[i].declaration.name != name) continue;
    if (i < c.own)
      throw InvalidArgument("'" + name + "' is a method of Porthos, expected another name");
    c.versions[name] = std::move(version);
    c.declarations[i] = entry.declaration;
    c.entries[i] = std::move(entry);
    return;
  }
  c.versions[name] = std::move(version);
  c.add(std::move(entry));
}

std::string version_of(const std::string& method) {
  const auto& versions = all().versions;
  const auto found = versions.find(method);
  return found == versions.end() ? "" : found->second;
}

void add_entries(Entries (*family)()) {
  for (auto& e : family()) add_entry(std::move(e));
}

const char* to_string(Solver s) {
  switch (s) {
    case Solver::automatic:
      return "automatic";
    case Solver::fixed_point:
      return "fixed point";
    case Solver::newton_articulated:
      return "Newton, articulated";
    case Solver::newton_dense:
      return "Newton, dense";
    case Solver::newton_krylov:
      return "Newton, Krylov";
  }
  return "unknown";
}

const std::deque<Entry>& entries() { return all().entries; }

const std::deque<Declaration>& catalogue() { return all().declarations; }

const Entry& entry_of(const std::string& method) {
  return find_named(
      entries(), method, "unknown method",
      [](const Entry& e) -> auto& { return e.declaration.name; });
}
const Declaration& declaration_of(const std::string& method) {
  return entry_of(method).declaration;
}
bool knows_method(const std::string& name) {
  return std::ranges::any_of(catalogue(), [&](const auto& d) { return d.name == name; });
}
bool works_to_tolerance(const Declaration& method) { return method.rival || method.order == 0; }

namespace {

/// The rigid contact or stop, or dry joint, whose jumps a power counts; empty: none.
std::string counted(const phs::PowerAccount& p, std::string_view what) {
  if (p.kind != phs::PowerKind::observed || !p.name.ends_with(what)) return "";
  return p.name.substr(0, p.name.size() - what.size());
}
bool has_rigid_contacts(const phs::Description& d) {
  return std::any_of(d.powers.begin(), d.powers.end(),
                     [](const auto& p) { return !counted(p, ".impacts").empty(); });
}

}  // namespace

std::optional<std::string> misfit(const Declaration& d, const phs::Description& system) {
  const auto& traits = system.traits;
  if (!system.constraints.empty() && !d.constraints)
    return "method '" + d.name + "' keeps no constraints, and '" + system.name + "' has '" +
           system.constraints.front().name + "': expected a method such as 'spark16'";
  for (const auto& block : system.constraints)
    if (block.rolling && !d.rolling)
      return "method '" + d.name + "' keeps no constraints on rates alone, and '" + block.name +
             "' rolls: expected a method such as 'pgauss16'";
  std::string rotation, alone;  // blocks
  for (const auto& b : system.blocks) {
    if (b.kind == phs::BlockKind::rotation && rotation.empty()) rotation = b.name;
    if (b.momentum < 0 && alone.empty()) alone = b.name;
  }
  const char* lacks =
      d.needs.canonical && !traits.canonical      ? "a canonical system"
      : d.needs.lossless && !traits.lossless      ? "a system without dissipation"
      : d.needs.separable && !traits.separable    ? "a separable Hamiltonian T(p) + V(q)"
      : d.needs.linear_state && !rotation.empty() ? "a system without quaternion blocks"
      : d.needs.flows && system.flows.empty() && !(traits.canonical && traits.separable)
          ? "a system that offers partial flows or has a separable Hamiltonian"
      : d.needs.contacts && !has_rigid_contacts(system)        ? "rigid contacts or stops"
      : d.rival && d.constraints && system.constraints.empty() ? "a system with constraints"
                                                               : nullptr;
  if (!lacks) return std::nullopt;
  const std::string sentence =
      "method '" + d.name + "' needs " + lacks + ", '" + system.name + "' ";
  if (d.needs.canonical && !traits.canonical && !alone.empty())
    return sentence + "has '" + alone + "', which has no conjugate momentum";
  if (d.needs.lossless && !traits.lossless)
    if (const auto losses = phs::power_names(system, true); !losses.empty())
      return sentence + "has " + losses;
  if (d.needs.contacts) return sentence + "has none";
  if (d.needs.linear_state && !rotation.empty()) return sentence + "has '" + rotation + "'";
  return sentence + "is not one";
}

namespace {

/// Methods know no jumps. A model with rigid contacts counts its <name>.impacts, one with dry
/// friction its <name>.slips.
void refuse_jumps(const Declaration& method, const phs::Description& d) {
  for (const auto& p : d.powers) {
    const std::string rigid = counted(p, ".impacts"), dry = counted(p, ".slips");
    if (!rigid.empty())
      throw InvalidArgument(
          "'" + d.name + "' jumps at the impacts of '" + rigid +
          "', which are rigid: expected a run of a scene, or contact::" +
          (method.needs.contacts ? "with_time_stepping()" : "with_rigid_contacts()"));
    if (!dry.empty())
      throw InvalidArgument("'" + d.name + "' sticks and slides by the dry friction '" + dry +
                            "': expected a run of a scene, or contact::with_dry_friction()");
  }
}

const Entry& fitting_entry(const std::string& method, const phs::Model& model, double h) {
  if (!std::isfinite(h) || h == 0)
    throw InvalidArgument("step is " + std::to_string(h) +
                          " s, expected a finite number other than 0");
  const Entry& e = entry_of(method);
  if (const auto reason = misfit(e.declaration, model.description()))
    throw InvalidArgument(*reason);
  refuse_jumps(e.declaration, model.description());
  return e;
}

}  // namespace

template <class T>
std::unique_ptr<BasicIntegrator<T>> make_basic_integrator(const std::string& method,
                                                          const phs::Model& model, T h,
                                                          const Options& options) {
  const Entry& e = fitting_entry(method, model, phs::to_double(h));
  const Needs& needs = e.declaration.needs;
  if (needs.canonical || needs.separable || (needs.flows && model.description().flows.empty()))
    if (const auto lie = phs::false_trait(model))
      throw InvalidArgument("method '" + method + "' relies on it: " + *lie);
  if (!e.make<T>()) throw InvalidArgument("method '" + method + "' works in double only");
  const OfRun run(model);
  auto made = e.make<T>()(e.declaration, *run.model, h, options);
  made->keep_model(run.kept);
  return made;
}
#define PORTHOS_INSTANTIATE(T)                                           \
  template std::unique_ptr<BasicIntegrator<T>> make_basic_integrator<T>( \
      const std::string&, const phs::Model&, T, const Options&);
PORTHOS_FOR_EACH_STEP_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

std::unique_ptr<LaneIntegrator> make_lane_integrator(const std::string& method,
                                                     const phs::Model& model, double h,
                                                     const Options& options) {
  const Entry& e = fitting_entry(method, model, h);
  if (!e.make_lanes || !model.holds().empty()) return nullptr;
  return e.make_lanes(e.declaration, model, h, options);
}

}  // namespace porthos::integrators
