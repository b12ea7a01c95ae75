// What a trajectory that does not pass would be with columns in another unit or order.
#include "scene/judge/detail/hints.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "phs/system/energy_scale.h"
#include "scene/judge/detail/centre_course.h"
#include "scene/run/ledger.h"

namespace porthos::scene {
namespace {

using phs::BlockKind;

/// How far a trajectory is off; not a number: unknown.
struct Fit {
  double energy = NAN, centre = NAN;  ///< relative
  double rates = NAN;                 ///< of what may be left of the way
  CentreOfMass::Vec fall{0, 0, 0};    ///< the mean acceleration of the centre of mass [m/s²]
};

/// What is more than this is off.
const Fit far_off{1e-3, 1e-3, 1};

Fit fit_of(Trajectory one, const Measuring& by) {
  const Rows& rows = by.rows;
  Fit fit;
  if (const RatesAgreement a = one.agreement(rows); !a.name.empty()) fit.rates = a.value / a.limit;
  const bool all_works = by.d.powers.size() == one.torques().size();
  Ledger ledger(by.d);
  phs::EnergyScale scale(by.d);
  CentreCourse course;
  Numbers works(by.d.powers.size());
  double first = 0, most = 0;
  for (size_t i = 0; i < rows.t.size(); ++i) {
    const auto row = one.row(by.d, i, i > 0 ? rows.interval(i) : 0, by.centre_out);
    if (i > 0 && all_works) {
      one.works(rows.t, i, works);
      ledger.book(works);
    }
    const Measured& m = by.meter.measure(rows.t[i], row.inner);
    if (!m.finite()) return {.energy = INFINITY, .centre = INFINITY, .rates = INFINITY};
    scale.see(m.stored_J);
    const double error = ledger.look(m);
    if (i == 0) first = error;
    most = std::max(most, std::fabs(error - first));
    if (by.centre_out)
      course.add(rows.t[i] - rows.t[0], row.centre, m.scale.linear, by.gravity, by.mass);
  }
  if (all_works) fit.energy = scale.value() > 0 ? most / scale.value() : INFINITY;
  if (by.centre_out) fit.centre = course.error();
  fit.fall = course.fall();
  return fit;
}

std::string in_words(const CentreOfMass::Vec& g) {
  const auto least = 1e-4L * std::sqrt(dot(g, g));
  const auto number = [&](long double x) { return std::fabs(x) < least ? 0.0 : double(x); };
  return fmt::format("({:.4g}, {:.4g}, {:.4g}) m/s²", number(g.x), number(g.y), number(g.z));
}

/// Asks what a trajectory would be otherwise, and keeps the question that explains it best.
class Asking {
 public:
  Asking(const Trajectory& trajectory, const Measuring& by)
      : trajectory_(trajectory), by_(by), is_(fit_of(trajectory.in_units({}), by)) {}

  bool is_far_off() const {
    return is_.energy > far_off.energy || is_.centre > far_off.centre || is_.rates > far_off.rates;
  }
  void ask(const Trajectory& other, const std::string& question) {
    weigh(fit_of(other, by_), question);
  }
  void weigh(const Fit& fit, const std::string& question) {
    constexpr double most_left = 0.1;
    if (fit.energy > most_left || fit.centre > most_left) return;
    if (!(explains(is_.energy, fit.energy, far_off.energy) &&
          explains(is_.centre, fit.centre, far_off.centre) &&
          explains(is_.rates, fit.rates, far_off.rates)))
      return;
    const double left = size(fit.energy) * size(fit.centre);
    if (!(left < 0.5 * least_)) return;  // the first one of equals
    least_ = left;
    best_ = fit;
    question_ = question;
  }
  void about_degrees() {
    constexpr double to = M_PI / 180;
    const bool joints = trajectory_.has(BlockKind::angle),
               attitudes = trajectory_.has(BlockKind::rotation);
    const auto ask_for = [&](const char* what, const Trajectory::Units& units) {
      ask(trajectory_.in_units(units), fmt::format("are {} in degrees? expected radians.", what));
    };
    if (joints) {
      ask_for("angles and rates", {to, to, to});
      ask_for(attitudes ? "the joints' angles" : "angles", {.angles = to});
      ask_for(attitudes ? "all angular rates" : "rates", {1, to, to});
    }
    if (joints && attitudes) {
      ask_for("the joints' angles and rates", {to, to});
      ask_for("the joints' rates", {.angle_rates = to});
    }
    if (attitudes) ask_for("the rates of the attitude", {.attitude_rates = to});
  }
  /// Before lengths: in kilometres, these fit times in milliseconds too.
  void about_times() {
    Numbers t = by_.rows.t;
    for (double& x : t) x *= 1e-3;
    const Rows seconds(t);
    weigh(fit_of(trajectory_.in_units({}),
                 {seconds, by_.d, by_.meter, by_.centre_out, by_.gravity, by_.mass}),
          "are times in milliseconds? expected seconds.");
  }
  void about_lengths() {
    if (!trajectory_.has(BlockKind::linear)) return;
    for (const auto& [unit, to] : {std::pair{"milli", 1e-3}, {"kilo", 1e3}})
      for (const auto& [what, of_lengths, of_velocities] :
           {std::tuple{"lengths and velocities", to, to},
            {"lengths", to, 1.0},
            {"velocities", 1.0, to}})
        ask(trajectory_.in_units({.lengths = of_lengths, .velocities = of_velocities}),
            fmt::format("are {} in {}metres? expected metres.", what, unit));
  }
  void about_attitudes() {
    if (trajectory_.has(BlockKind::rotation))
      ask(trajectory_.with_scalar_last(), "is the quaternion x y z w? expected w x y z.");
  }
  void about_rate_axes() {
    if (!trajectory_.has(BlockKind::rotation)) return;
    const auto is = trajectory_.rate_axes();
    const auto of = [](bool own) { return own ? "the base's own" : "the world's"; };
    const auto word = [](bool own) { return own ? "body" : "world"; };
    const bool linear = !is.linear_in_body, angular = is.angular_in_world;  // the other axes
    const std::string lines[] = {fmt::format("linear_velocity_axes = \"{}\"", word(linear)),
                                 fmt::format("angular_velocity_axes = \"{}\"", word(angular))};
    if (trajectory_.has(BlockKind::linear))
      ask(trajectory_.with_rates_along({linear, is.angular_in_world}),
          fmt::format("are linear velocities along {} axes? {} in the map.", of(linear), lines[0]));
    ask(trajectory_.with_rates_along({is.linear_in_body, !angular}),
        fmt::format("are angular velocities along {} axes? {} in the map.", of(angular), lines[1]));
    if (trajectory_.has(BlockKind::linear))
      ask(trajectory_.with_rates_along({linear, !angular}),
          fmt::format("are all velocities along other axes? {} and {} in the map.", lines[0],
                      lines[1]));
  }
  void about_axes() {
    if (!trajectory_.has(BlockKind::linear)) return;
    for (const auto& [a, b] : {std::pair<size_t, size_t>{0, 1}, {0, 2}, {1, 2}})
      for (const auto& [what, q, v] : {std::tuple{"positions", true, false},
                                       {"velocities", false, true},
                                       {"positions and velocities", true, true}})
        ask(trajectory_.with_axes_exchanged(a, b, q, v),
            fmt::format("are {} and {} of the {} in each other's place?", "xyz"[a], "xyz"[b],
                        what));
  }
  /// After lengths: in millimetres, a fall is a thousand times faster too.
  void about_gravity() {
    if (!by_.centre_out) return;
    const auto& g = by_.gravity;
    const bool none = dot(is_.fall, is_.fall) < 1e-6 * dot(g, g);
    const auto fall = none ? CentreOfMass::Vec{0, 0, 0} : is_.fall;
    const std::string question =
        none ? fmt::format("is the file without gravity? the map has {}.", in_words(g))
             : fmt::format("does the file fall by {}? the map has {}.", in_words(fall),
                           dot(g, g) > 0 ? in_words(g) : "no gravity");
    weigh(fit_of(trajectory_.in_units({}),
                 {by_.rows, by_.d, by_.meter, by_.centre_out, fall, by_.mass}),
          question);
  }
  static constexpr size_t most_joints = 8;
  bool may_exchange_joints() const { return trajectory_.joints().size() <= most_joints; }
  void about_joints() {
    if (!may_exchange_joints()) return;
    const auto& joints = trajectory_.joints();
    for (size_t b = 0; b < joints.size(); ++b)
      for (size_t a = 0; a < b; ++a)
        for (const auto& [what, q, v] : {std::tuple{"columns", true, true},
                                         {"positions", true, false},
                                         {"rates", false, true}})
          ask(trajectory_.exchanged(joints[a], joints[b], q, v),
              fmt::format("are the {} of '{}' and '{}' in each other's place?", what, joints[a],
                          joints[b]));
  }
  /// The question and what speaks for it; empty if none explains the file.
  std::string note() const {
    if (question_.empty()) return "";
    const auto would = [&](const char* what, double then, double now) {
      return fmt::format("{} The error of the {} would be {:.2g} relative in place of {:.2g}",
                         question_, what, then, now);
    };
    if (is_.energy > far_off.energy) return would("energy", best_.energy, is_.energy);
    if (is_.centre > far_off.centre) return would("centre of mass", best_.centre, is_.centre);
    return question_ + " Positions would move as their rates say";
  }

 private:
  static bool explains(double is, double would, double off) {
    constexpr double clearly = 0.1;
    return std::isnan(is) || (is > off ? would < clearly * is : !(would > off));
  }
  static double size(double error) { return std::isnan(error) ? 1 : std::max(error, 1e-12); }

  const Trajectory& trajectory_;
  const Measuring& by_;
  const Fit is_;
  Fit best_;
  double least_ = INFINITY;
  std::string question_;
};

}  // namespace

bool ask_about_columns(RunReport& r, const Trajectory& trajectory, const Measuring& by) {
  if (!trajectory.has_rates()) return false;
  Asking asking(trajectory, by);
  if (!asking.is_far_off()) return false;
  asking.about_degrees();
  asking.about_attitudes();
  asking.about_rate_axes();
  asking.about_times();
  asking.about_lengths();
  asking.about_axes();
  asking.about_gravity();
  asking.about_joints();
  const std::string note = asking.note();
  if (!note.empty()) r.notes.push_back(note);
  if (note.empty() && !asking.may_exchange_joints())
    r.notes.push_back("exchanged joints were not tried: more than eight");
  return !note.empty();
}

}  // namespace porthos::scene
